"""Scenes on which multibody systems fail, often silently: definitions, references, and what must hold."""

import re
from importlib import import_module

from mbd.hardcases.case import HardCase

__all__ = ["CASES"]

NAMES = (
    "absent_effects", "balls", "blocks", "clearances", "cradles", "driven_leg", "four_bars", "frictions",
    "governor", "grazes", "hills", "knees", "light_links", "long_run", "mass_ratios", "mats", "pushed_tables",
    "redundant_rows", "resting", "rods", "rotations", "shakers", "singular_poses", "sleighs", "starts",
    "straight_slides", "tables_and_jumps", "tiny_steps", "user_force", "vanishing_forces", "walls", "wheel",
)  # fmt: skip
"""Of the files of cases."""


def _place(case: HardCase) -> tuple[str, int, str]:
    """j2 before j10, b2 before b2b; cases of one beginning stay as their module has them."""
    found = re.match(r"([a-z])(\d+)([a-z]*)-", case.id)
    assert found is not None, case.id
    return found[1], int(found[2]), found[3]


_FILES = [import_module(f"mbd.hardcases.{name}") for name in NAMES]
CASES: tuple[HardCase, ...] = tuple(sorted((case for file in _FILES for case in file.CASES), key=_place))
"""Every case, in the order of the table."""
