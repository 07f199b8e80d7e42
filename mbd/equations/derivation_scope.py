"""What the derivation of forces and constraints asks of its surroundings: a tree of bodies, or bare coordinates."""

from collections.abc import Sequence
from typing import Protocol

from mbd.bodies.scope import Scope
from mbd.equations.dynamics import Work
from mbd.equations.equations import Coordinate
from mbd.equations.inputs import Inputs
from mbd.equations.kinematic_proxies import View
from mbd.equations.parameters import ParameterTable
from mbd.joints.base import Joint
from mbd.tape.node import Node, Scalar, Tape


class Resolving(Protocol):
    """What stands for places and velocities in words' expressions."""

    def real(self, outputs: Sequence[Node]) -> list[Node]:
        """The expressions with the motion itself in its place."""

    def inside(self, outputs: Sequence[Node]) -> list[View]:
        """What of it some expressions are made of."""

    def rates(self, outputs: Sequence[Node]) -> dict[Node, Scalar]:
        """How it changes in time."""


class DerivationScope(Scope, Protocol):
    """A `Scope` in which equations are derived; see `DerivationContext` for what its members mean."""

    tape: Tape
    inputs: Inputs
    parameters: ParameterTable
    states: list[tuple[Coordinate, Node]]
    first_anchor: int
    modes: dict[str, tuple[str, ...]]
    held_parameters: dict[str, Node]
    parameters_by_state: dict[str, tuple[Node, tuple[tuple[str, float | None], ...]]]

    @property
    def views(self) -> Resolving: ...

    @property
    def cuts(self) -> tuple[Joint, ...]: ...

    def cut_rows(self, joint: Joint) -> tuple[list[tuple[str, Node]], bool]:
        """(part, residual) of a cut joint, and whether its places are written in ground axes."""

    def real(self, value: Scalar) -> Node:
        """A word's expression with the motion itself in place of the views."""

    def rates(self, values: Sequence[Node]) -> list[Node]:
        """d/dt, in views, of words' functions of t and q ⊕ x."""

    def change(self, value: Scalar) -> Node:
        """d/dt of a word's function of t, q ⊕ x, v and z."""


class Generalized(Protocol):
    """Generalized forces of virtual work."""

    def generalized(self, work: Work) -> list[Node]:
        """Σ multiplier ∂value/∂x + Σ force ∂velocity/∂v (length n_v)."""
