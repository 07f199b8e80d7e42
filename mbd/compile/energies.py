"""Kinetic and potential energy at many states: by numpy at first, by machine code where it is asked for often."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

from mbd.arrays import Matrix, Vector
from mbd.compile.backend import Function
from mbd.compile.layout import Layout
from mbd.compile.many import at_inputs
from mbd.compile.python import ArrayFunction, array_function
from mbd.equations.equations import Equations
from mbd.tape.derivatives import live
from mbd.tape.node import Node

MIN_CALLS = 4
"""Calls after which machine code is made: it takes some milliseconds, and saves one of a large mechanism in each."""
MIN_STATES = 256
"""States above which numpy is as fast."""
NAME = "energies"


class Energies:
    """T and V [J] of a mechanism: ``f({'t': (R,), 'q': (R, n_q), …}, parameters) → [T (R,), V (R,)]``.

    Parameters are one vector for all rows, or an (R, n_p) array. `machine` gives functions by name and outputs; None
    where there is no machine code.
    """

    def __init__(
        self, equations: Equations, layout: Layout, machine: Callable[[str, Sequence[Node]], Function] | None
    ) -> None:
        self._equations, self._layout, self._machine = equations, layout, machine
        self.calls = 0

    @cached_property
    def _arrays(self) -> ArrayFunction:
        equations = self._equations
        with equations.tape.lock:
            return array_function([equations.kinetic, equations.potential])

    @cached_property
    def _function(self) -> Function:
        assert self._machine is not None
        return self._machine(NAME, [self._equations.kinetic, self._equations.potential])

    @cached_property
    def kinds(self) -> frozenset[str]:
        """The kinds of inputs that the energies depend on."""
        nodes = live([self._equations.kinetic, self._equations.potential])
        return frozenset(node.data[0] for node in nodes if node.op == "input")

    def __call__(self, inputs: Mapping[str, Any], parameters: Vector | Matrix) -> list[Vector]:
        self.calls += 1
        rows = len(inputs["t"])
        if self._machine is None or self.calls <= MIN_CALLS or rows > MIN_STATES:
            return self._arrays(inputs, parameters)
        out = at_inputs(self._function, self._layout, inputs, parameters)
        return [out[:, 0].copy(), out[:, 1].copy()]
