"""The promises of measures (where) and constraints (what law)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

from mbd.bodies.domains import Parameterized
from mbd.forces.quantities import Mention
from mbd.scope import Scope
from mbd.tape.node import Scalar

__all__ = ["Constraint", "Measure", "VelocityConstraint"]


class Measure(ABC):
    """Where: a signed distance or angle g of the posture, with ``g ≥ 0`` open where it serves a contact.

    A new measure is a frozen dataclass; it knows the geometry and nothing of laws or of when they act.
    """

    @abstractmethod
    def gap(self, scope: Scope) -> Scalar:
        """g [unit], scaled so that ``|∇g| = 1`` at contact where it is a distance."""

    @property
    @abstractmethod
    def unit(self) -> str:
        """'m' or 'rad'."""

    @abstractmethod
    def mentions(self) -> list[Mention]:
        """The frames, joints and named quantities it refers to."""

    def captured(self, scope: Scope) -> Sequence[Scalar]:
        """Quantities whose values are held from the instant of closing, the anchors; by default none."""
        return ()

    def tangents(self, scope: Scope, anchors: Sequence[Scalar]) -> Sequence[tuple[str, Scalar]]:
        """(part, residual) of the rows that hold a sticking contact; zero at the anchors. None without a tangent.

        Parameters
        ----------
        anchors : one for each of `captured`
        """
        return ()

    @property
    def has_tangents(self) -> bool:
        """Whether it can stick."""
        return False

    @property
    def title(self) -> str:
        """What it measures, in a word: 'distance'."""
        return type(self).__name__.lower()

    @property
    def reaction(self) -> str:
        """What its multiplier is called in results: 'force', or 'tension'."""
        return "force"

    def faults(self, owner: str) -> list[str]:
        """What is geometrically impossible about it, one sentence each."""
        return []


class Constraint(Parameterized, ABC):
    """A law on a measure; a new constraint is a frozen dataclass with a `name`."""

    @property
    @abstractmethod
    def kind(self) -> str:
        """'bilateral', 'nonholonomic', 'unilateral', 'penalty' or 'event'."""

    @abstractmethod
    def mentions(self) -> list[Mention]:
        """The frames, joints and named quantities it refers to."""

    @property
    def others(self) -> tuple[str, ...]:
        """Names of the other constraints it refers to."""
        return ()

    def instants(self) -> tuple[float, ...]:
        """Times at which its sampled signals have a kink [s]."""
        return ()


class VelocityConstraint(Constraint):
    """Rows ``a(q, t) · v + b(q, t) = 0`` that hold velocities and need not come from positions.

    A new one is a frozen dataclass with a `name`. Its multipliers λ enter the balance as ``+aᵀ λ``, so −λ is the force
    of the row on the mechanism.
    """

    @property
    @abstractmethod
    def unit(self) -> str:
        """'m' or 'rad': that of the rows times seconds."""

    @abstractmethod
    def rates(self, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """(part, a · v + b) of each row, linear in velocities [unit/s]; a single row has the part ''."""

    @property
    def kind(self) -> str:
        """'nonholonomic'."""
        return "nonholonomic"

    @property
    def contact(self) -> str | None:
        """The contact that must be closed for its rows to hold; None: they hold at all times."""
        return None
