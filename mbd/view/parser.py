"""A parser of command lines that takes no abbreviations and suggests what a misspelt word was to be."""

import argparse
import contextlib
import difflib
import re
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, NoReturn

from mbd.bodies.values import printable


class Parser(argparse.ArgumentParser):
    """`argparse.ArgumentParser` with suggestions; ``--unti`` is no ``--until``."""

    def __init__(self, **how: object) -> None:
        super().__init__(**(how | {"allow_abbrev": False}))  # type: ignore[arg-type]

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As its parent, but what a command does not know is an error of that command, which knows its options."""
        found, left = super().parse_known_args(args, namespace)
        if left:
            self.error(f"unrecognized arguments: {' '.join(left)}")
        return found, left

    def error(self, message: str) -> NoReturn:
        """Usage, what is wrong, and what was probably meant."""
        # of the argument that an error is about, and of what is expected of it, the spelling is right
        wrong = re.sub(r"^argument [^:]*: (?!invalid choice).*", "", message.partition("(choose")[0])
        words = re.findall(r"invalid choice: '([^']*)'|(--[\w-]+)", wrong)
        known = [option for action in self._actions for option in (*action.option_strings, *(action.choices or ()))]
        meant = [each for pair in words for each in difflib.get_close_matches("".join(pair), known, n=1)]
        super().error(message + (f"; did you mean {' or '.join(repr(each) for each in meant)}?" if meant else ""))


def writable(folder: str | Path) -> Path:
    """A folder for results in which a file was written, and which is gone again if it was not there; ~ is the home.

    Raises
    ------
    ModelError
        for control characters, which a terminal would obey.
    OSError
        that names the folder and why not, before any work is done.
    """
    asked = f"--out {str(folder)!r}"
    if not str(folder).strip():
        raise FileNotFoundError(f"{asked} names no folder; leave it out, or give the name of one")
    place = Path(printable(str(folder), "--out")).expanduser()
    try:
        above = next(each for each in (place, *place.absolute().parents) if each.exists())
        if not above.is_dir():
            raise NotADirectoryError(f"{asked}: {str(above)!r} is a file, not a folder; give another folder")
        made = [each for each in (place, *place.absolute().parents) if not each.exists()]
        try:
            place.mkdir(parents=True, exist_ok=True)
            with TemporaryFile(dir=place):
                pass
        finally:
            for each in made:
                with contextlib.suppress(OSError):
                    each.rmdir()
    except NotADirectoryError:
        raise
    except (OSError, ValueError) as error:  # no rights, a name that is too long or has a character of no file's name
        why = getattr(error, "strerror", None) or error
        raise PermissionError(f"{asked}: nothing can be written there ({why}); give another folder") from error
    return place
