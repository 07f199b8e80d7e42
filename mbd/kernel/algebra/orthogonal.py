"""The steps of Gram–Schmidt on rows of n numbers that lie one behind another in an array."""

from mbd.kernel.records import Reals
from mbd.kernel.tangent_rules import takes_part


def square(V: Reals, row: int, n: int) -> float:
    """w · w of the row that begins at `row`."""
    total = 0.0
    for j in range(n):
        total += V[row + j] * V[row + j]
    return total


def clear_row(V: Reals, row: int, unit: int, n: int) -> float:
    """Take from the row w that begins at `row` its part along the unit vector u that begins at `unit`; w · u."""
    part = 0.0
    for j in range(n):
        part += V[unit + j] * V[row + j]
    if takes_part(part):  # rows of large mechanisms have little in common
        for j in range(n):
            V[row + j] -= part * V[unit + j]
    return part
