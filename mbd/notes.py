"""What mbd says without being asked: notes to the logger ``mbd``, doubts as warnings, each once.

A note tells what happened on purpose but might surprise: a row that was left out, a parameter that was derived again.
It is a record of level INFO of ``logging.getLogger("mbd")``, which nobody sees who has not asked for it. A doubt,
something possible that was hardly meant or a result that is in doubt, is an `MbdWarning`. Both are filtered as
everything of `logging` and `warnings` is. Runs keep theirs in ``run.stats["notes"]``, from where they go to pages and
records.
"""

import logging
import sys
import warnings
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

from mbd.errors import MbdWarning


class _Process:
    """What a doubt is of that concerns no model."""


PROCESS = _Process()

_PACKAGE = str(Path(__file__).parent)
_DOOR = str(Path(__file__).with_name("arguments.py"))
_LOGGER = logging.getLogger("mbd")
_LOGGER.addHandler(logging.NullHandler())
_TOLD: WeakKeyDictionary[Any, set[str]] = WeakKeyDictionary()


def is_heard() -> bool:
    """Whether somebody listens to notes."""
    return _LOGGER.isEnabledFor(logging.INFO)


def note(sentence: str) -> None:
    """Tell those who listen to the logger."""
    _LOGGER.info(sentence)


def doubt(*sentences: str, of: Any = None) -> None:
    """Warn at the user's line, of each sentence once for the object that it is `of`, a model or `PROCESS`."""
    known = set() if of is None else _TOLD.setdefault(of, set())
    for sentence in sentences:
        if sentence not in known:
            known.add(sentence)
            warnings.warn(sentence, MbdWarning, stacklevel=_level())


def called_from_outside() -> bool:
    """Whether the function that asks was called by something that is no part of mbd."""
    frame = sys._getframe(2)
    if frame.f_code.co_filename == _DOOR and frame.f_back is not None:
        frame = frame.f_back
    return not frame.f_code.co_filename.startswith(_PACKAGE)


def _level() -> int:
    """Which frame above `doubt` is the user's."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, level = frame.f_back, level + 1
    return level
