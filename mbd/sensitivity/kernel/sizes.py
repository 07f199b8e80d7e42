"""Names of the numbers in `S`, which all functions of this folder take; and of those of an entry of a program."""

from __future__ import annotations

__all__ = [
    "ALL_ROWS", "AT_LAM", "AT_Q", "AT_RATE", "AT_X", "AT_Y", "BASE", "COLUMN", "COLUMNS", "COORDINATES", "ENTRIES",
    "EQUATION", "GROUPS", "LISTED", "NEAR", "PARTS", "PLACE", "PLACES", "RATES", "ROWS", "STABILIZED", "TARGET",
    "WIDTH",
]  # fmt: skip

RATES = 0
"""n: rates (v̇, ż)."""
PLACES = 1
"""n_v: velocities."""
COORDINATES = 2
"""n_q."""
ALL_ROWS = 3
"""R: rows of the mechanism."""
ROWS = 4
"""m: those that act and do not depend on others."""
WIDTH = 5
"""D: directions, and zeros up to a multiple of four."""
ENTRIES = 6
"""Derivatives of a program that are not always zero, in the present mode."""
COLUMNS = 7
"""Of derivatives: x (n_v), y (n), rates (n), λ (m), t, anchors, parameters, bases of charts."""
STABILIZED = 8
"""1: rows hold velocities as well as positions."""
AT_Q = 9
AT_Y = 10
AT_RATE = 11
AT_LAM = 12
"""Where the block of a program has coordinates, velocities, rates, multipliers."""
AT_X = 13
"""Where it has what steps move: increments in charts; coordinates, where they add."""
BASE = 14
"""The first column of the bases of charts."""
GROUPS = 15
"""Joints whose coordinates do not add."""
LISTED = 16
"""Where the first velocity and the number of velocities of each of these begin."""

EQUATION = 0
"""Of an entry: 0 … n − 1 the balance, then rows: ḣ (m), h (m) of `steps`, ḧ (m) of `consistent`."""
COLUMN = 1
PLACE = 2
"""Of an entry: where the program writes it."""
TARGET = 3
"""Of an entry: the line of a system of equations that it stands in, −1: none."""
NEAR = 4
"""Of an entry: its line among the equations of position corrections, −1: none."""
PARTS = 5
"""Numbers of an entry."""
