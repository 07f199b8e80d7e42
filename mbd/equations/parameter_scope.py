"""What every derivation offers to words, with bodies or without: the time, parameters, tables."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from mbd.equations.inputs import Inputs
from mbd.equations.parameters import ParameterTable
from mbd.tape.node import Node, Scalar, Table, Tape

__all__ = ["ParameterScope"]


class ParameterScope:
    """A tape with the inputs of the equations and the run-time parameters.

    Parameters
    ----------
    n_q, n_v : coordinates and velocities
    tunable : names of parameters that stay inputs even at an exact 0 or ±1
    """

    def __init__(self, n_q: int, n_v: int, tunable: Collection[str]) -> None:
        self.tape = Tape()
        self.inputs = Inputs.sized(self.tape, n_q, n_v)
        self.parameters = ParameterTable(self.tape, tunable)

    @property
    def time(self) -> Node:
        """t [s]."""
        return self.inputs.t

    def parameter(self, owner: str, field: str, value: float) -> Node:
        """The run-time input named ``owner.field``."""
        return self.parameters.node(f"{owner}.{field}", value)

    def increment(self, owner: str, field: str) -> Scalar:
        """What a linearization adds to a law; 0 in every other derivation."""
        return self.parameters.increment(f"{owner}.{field}")

    def table(
        self,
        owner: str,
        breaks: Sequence[float],
        coefficients: Sequence[Sequence[float]],
        jumps: Sequence[int] | None = None,
    ) -> Table:
        """A piecewise cubic; equal ones are one table, named for the owner that asked first."""
        return self.tape.table(owner, breaks, coefficients, jumps)
