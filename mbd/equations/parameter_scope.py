"""What every derivation offers to words, with bodies or without: the time, parameters, tables."""

from collections.abc import Collection, Sequence

from mbd.equations.inputs import Inputs
from mbd.equations.parameters import ParameterTable
from mbd.errors import UnknownNameError, nearest
from mbd.tape.node import Node, Scalar, Table, Tape
from mbd.tape.selection import by_state


class ParameterScope:
    """A tape with the inputs of the equations and the run-time parameters.

    Parameters
    ----------
    n_q, n_v : coordinates and velocities
    tunable : names of parameters that stay inputs even at an exact 0 or ±1

    Attributes
    ----------
    first_anchor : number of the first anchor behind those of machines
    modes : names of the states of each mode
    held_parameters : parameters that machines hold, by name
    parameters_by_state : (number of the state, (name, value) of each parameter in its place by state; None: its own)
    """

    def __init__(self, n_q: int, n_v: int, tunable: Collection[str]) -> None:
        self.tape = Tape()
        self.inputs = Inputs.sized(self.tape, n_q, n_v)
        self.parameters = ParameterTable(self.tape, tunable)
        self.first_anchor = 0
        self.modes: dict[str, tuple[str, ...]] = {}
        self.held_parameters: dict[str, Node] = {}
        self.parameters_by_state: dict[str, tuple[Node, tuple[tuple[str, float | None], ...]]] = {}

    @property
    def time(self) -> Node:
        """t [s]."""
        return self.inputs.t

    def parameter(self, owner: str, field: str, value: float) -> Node:
        """The run-time input named ``owner.field``, or what a machine sets in its place."""
        name = f"{owner}.{field}"
        if name in self.held_parameters:
            return self.held_parameters[name]
        if name in self.parameters_by_state:
            index, values = self.parameters_by_state[name]
            nodes = [self.parameters.node(other, value if given is None else given) for other, given in values]
            return self.tape.lift(by_state(index, nodes))
        return self.parameters.node(name, value)

    def state_names(self, mode: str) -> Sequence[str]:
        """The states of a mode."""
        if mode not in self.modes:
            raise UnknownNameError(nearest(mode, self.modes, "mode", "There are"))
        return self.modes[mode]

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
