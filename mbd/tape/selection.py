"""One of several values, by a number that is known as the program runs."""

from collections.abc import Sequence

from mbd.tape.functions import where
from mbd.tape.node import Scalar


def by_state(index: Scalar, values: Sequence[Scalar]) -> Scalar:
    """The value of the state with this number; equal values are one."""
    found = values[-1]
    for number in range(len(values) - 2, -1, -1):
        if values[number] is not found:
            found = where(index < number + 0.5, values[number], found)
    return found
