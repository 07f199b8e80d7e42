"""Results of studies that are tables: columns by their titles, with a line for each of what was tried."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.errors import UnknownNameError, nearest

if TYPE_CHECKING:
    from pandas import DataFrame

__all__ = ["Titled"]


class Titled(ABC):
    """A result whose columns have titles."""

    known_as = "table"
    """What errors call it."""

    @property
    @abstractmethod
    def columns(self) -> dict[str, Any]:
        """The columns by title, all of one length."""

    def __getitem__(self, title: str) -> Any:
        """A column as an array."""
        columns = self.columns
        if title not in columns:
            raise UnknownNameError(nearest(title, columns, "column", f"The {self.known_as} has"))
        return np.array(columns[title])

    def to_dataframe(self) -> DataFrame:
        """A pandas table of the columns."""
        from mbd.results.tables import library

        return library("pandas", "data", f"{type(self).__name__}.to_dataframe()").DataFrame(self.columns)
