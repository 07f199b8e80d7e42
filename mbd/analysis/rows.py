"""What results of analyses share: rows of figures as a pandas table and as a file."""

from __future__ import annotations

import csv
from abc import ABC, abstractmethod
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbd.results.archive import named_file, write_whole
from mbd.results.tables import library, text_cell

if TYPE_CHECKING:
    from pandas import DataFrame

__all__ = ["Rows"]


class Rows(ABC):
    """A result that is a list of things measured, each with the same figures."""

    @abstractmethod
    def rows(self) -> list[dict[str, Any]]:
        """One flat dictionary for each thing measured, all with the same keys."""

    def to_dataframe(self) -> DataFrame:
        """A pandas table of the rows."""
        return library("pandas", "data", "result.to_dataframe()").DataFrame(self.rows())

    def to_csv(self, path: str | Path) -> Path:
        """The same as a file of comma-separated values."""
        target = named_file(path)
        rows = self.rows()

        def fill(partial: Path) -> None:
            with partial.open("w", newline="", encoding="utf-8") as file:
                writer = csv.DictWriter(file, list(rows[0]) if rows else [])
                writer.writeheader()
                writer.writerows({title: text_cell(value) for title, value in row.items()} for row in rows)

        write_whole(target, fill)
        return target
