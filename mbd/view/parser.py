"""A parser of command lines that takes no abbreviations and suggests what a misspelt word was to be."""

from __future__ import annotations

import argparse
import difflib
import os
import re
from pathlib import Path
from typing import NoReturn

__all__ = ["Parser", "writable"]


class Parser(argparse.ArgumentParser):
    """`argparse.ArgumentParser` with suggestions; ``--unti`` is no ``--until``."""

    def __init__(self, **how: object) -> None:
        super().__init__(**(how | {"allow_abbrev": False}))  # type: ignore[arg-type]

    def error(self, message: str) -> NoReturn:
        """Usage, what is wrong, and what was probably meant."""
        words = re.findall(r"invalid choice: '([^']*)'|(--[\w-]+)", message.partition("(choose")[0])
        known = [option for action in self._actions for option in (*action.option_strings, *(action.choices or ()))]
        meant = [each for pair in words for each in difflib.get_close_matches("".join(pair), known, n=1)]
        super().error(message + (f"; did you mean {' or '.join(repr(each) for each in meant)}?" if meant else ""))


def writable(folder: str | Path) -> Path:
    """A folder for results that can be made and written; an error says so before any work is done."""
    place = Path(folder)
    above = next(each for each in (place, *place.absolute().parents) if each.exists())
    if not above.is_dir():
        raise NotADirectoryError(f"--out {str(folder)!r}: {str(above)!r} is a file, not a folder; give another folder")
    if not os.access(above, os.W_OK | os.X_OK):
        raise PermissionError(f"--out {str(folder)!r}: {str(above)!r} may not be written; give another folder")
    return place
