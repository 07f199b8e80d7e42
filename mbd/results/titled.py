"""Results of studies that are tables: columns by their titles, with a line for each of what was tried."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.errors import UnknownNameError, nearest
from mbd.results.archive import named_file, write_whole

if TYPE_CHECKING:
    from pandas import DataFrame


class Tabular(ABC):
    """A result that is a table."""

    @property
    @abstractmethod
    def columns(self) -> dict[str, Any]:
        """The columns by title, all of one length."""

    def to_dataframe(self) -> DataFrame:
        """A pandas table of the columns."""
        from mbd.results.tables import library

        return library("pandas", "data", f"{type(self).__name__}.to_dataframe()").DataFrame(self.columns)

    def to_csv(self, path: str | Path) -> Path:
        """The same as a file of comma-separated values, a line for each of what was tried."""
        import csv

        from mbd.results.tables import text_cell

        target, columns = named_file(path), self.columns

        def fill(partial: Path) -> None:
            with partial.open("w", newline="", encoding="utf-8") as file:
                writer = csv.writer(file)
                writer.writerow(map(text_cell, columns))
                writer.writerows(map(text_cell, row) for row in zip(*columns.values(), strict=True))

        write_whole(target, fill)
        return target


class Titled(Tabular):
    """A table that is asked for its columns by their titles."""

    known_as = "table"
    """What errors call it."""

    def __getitem__(self, title: str) -> Any:
        """A column as an array."""
        columns = self.columns
        if title not in columns:
            raise UnknownNameError(nearest(title, columns, "column", f"The {self.known_as} has"))
        return np.array(columns[title])


def by_title(rows: Sequence[dict[str, Any]]) -> dict[str, list[Any]]:
    """The columns of rows, all of which have the same titles."""
    return {title: [row[title] for row in rows] for title in (rows[0] if rows else ())}
