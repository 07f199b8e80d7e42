"""Figures that users look at: a window of a script, or the cell of a notebook. Importing this needs matplotlib."""

from typing import Any

from matplotlib import get_backend, pyplot
from matplotlib.figure import Figure


class OnceShown(Figure):
    """A figure that a notebook shows once.

    A notebook shows the value of a cell, and as the cell ends every figure that pyplot still knows. So pyplot forgets
    this one as it is shown first; a figure that is no cell's value is shown at the end.
    """

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        if get_backend().endswith("inline"):
            pyplot.close(self)
        return {}
