"""The player of a run in the cell of a notebook."""

from html import escape
from os import PathLike

from mbd.bodies.values import is_number
from mbd.errors import ModelError
from mbd.results.trajectory import Trajectory
from mbd.view.page import html

MIN_HEIGHT = 200
"""Height that has room for the mechanism [pixels]."""


class Animation:
    """A frame that holds the page of a run, whole: nothing is fetched, and its script reaches nothing outside.

    Parameters
    ----------
    run : what it plays
    height : of the frame [pixels]
    """

    def __init__(self, run: Trajectory, height: int) -> None:
        hint = "; run.page(path) writes it to a file" if isinstance(height, str | PathLike) else ""
        if not is_number(height) or not MIN_HEIGHT <= height < 1e5:
            raise ModelError(
                f"height of an animation must be a number of pixels from {MIN_HEIGHT} on, not {height!r}{hint}"
            )
        self.run, self.height = run, int(height)

    def __repr__(self) -> str:
        return f"<animation of {self.run.name!r}; a notebook shows it, run.page(path) writes it>"

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{escape(html(self.run))}" title="{escape(self.run.name)}, animated" '
            f'sandbox="allow-scripts allow-downloads" style="width:100%;height:{self.height}px;border:0"></iframe>'
        )
