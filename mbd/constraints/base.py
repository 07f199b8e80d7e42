"""The promise of constraints: what law."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

from mbd.bodies.domains import Parameterized
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of
from mbd.constraints.law import Equation, Hold, Law
from mbd.constraints.measure import mentioned_names
from mbd.forces.quantities import Mention
from mbd.tape.node import Scalar

KINDS = ("bilateral", "nonholonomic", "unilateral", "penalty", "event", "machine", "impulse")
"""What a constraint may be to the active-set manager."""


class Constraint(Parameterized, ABC):
    """A law on a measure; a new constraint is a frozen dataclass with a `name`: see `mbd.constraints.law`."""

    @property
    @abstractmethod
    def kind(self) -> str:
        """What it is to the active-set manager.

        'bilateral' (rows that always act), 'nonholonomic' (those on velocities), 'unilateral' (rows that close and
        open), 'penalty' (a force law that does), 'event', 'machine' (discrete states), or
        'impulse'.
        """

    @abstractmethod
    def mentions(self) -> list[Mention]:
        """The frames, joints and named quantities it refers to."""

    def act(self, scope: Scope, hold: Hold) -> Law:
        """Its rows or forces, and when they act; of every kind but 'event', 'machine' and 'impulse'.

        Parameters
        ----------
        scope : motions, parameters and named quantities
        hold : gives values as they were at the instant of closing; for laws that close
        """
        raise NotImplementedError(f"{type(self).__name__} '{self.name}' has no act(scope, hold)")

    def anchors(self, scope: Scope) -> int:
        """How many values it holds from the instant of closing."""
        held: list[Scalar] = []

        def hold(values: Sequence[Scalar]) -> Sequence[Scalar]:
            held.extend(values)
            return values

        self.act(scope, hold)
        return len(held)

    def held_at(self, place: Sequence[float]) -> Sequence[float] | None:
        """What it holds where its foot was set down at a place (x, y) or (x, y, z) [m], which no body tells.

        None, the default: the place is that of a body, or it has none.
        """
        return None

    @property
    def others(self) -> tuple[str, ...]:
        """Names of the other constraints it refers to."""
        return ()

    def bare(self) -> dict[str, Constraint | None]:
        """Effects of it that a model can be `without`, by name, each with the constraint that lacks it; None: nothing.

        By default the friction of rows on velocities that have a limit.
        """
        return {f"{self.name} friction": None} if self.kind == "nonholonomic" else {}

    def resolving_dt(self, values: Mapping[str, float], mass: float, speed: float) -> float:
        """The step that resolves an impact of an effective mass [kg, kg m²] at an approach speed [m/s, rad/s]; [s].

        Parameters
        ----------
        values : of its parameters by full name
        """
        return math.inf

    @property
    def details(self) -> str:
        """What a page of text says of it behind its name and class."""
        return f", {self.kind}, on " + self._mentioned()

    def _mentioned(self) -> str:
        return mentioned_names(self.mentions())

    def missing(self) -> list[str]:
        """What it lacks that equations and active-set manager would ask for, one sentence each."""
        name_of(self.name, type(self).__name__)
        title = f"'{self.name}' ({type(self).__name__})"
        if self.kind not in KINDS:
            return [f"{title} is of kind {self.kind!r}, which nothing serves; the kinds are {', '.join(KINDS)}"]
        if self.kind == "event":
            lacks = [name for name in ("guard", "direction", "terminal", "reset") if not hasattr(self, name)]
            return [f"{title} is an event without {', '.join(lacks)}; use mbd.Event"] if lacks else []
        if self.kind in ("machine", "impulse") or type(self).act is not Constraint.act:
            return []
        return [
            f"{title} has no act(scope, hold), which says by which rows or force it acts: it would act by none; return "
            "an mbd.constraints.Law, or use mbd.Bilateral, mbd.Nonholonomic, mbd.Unilateral or mbd.Penalty"
        ]


class VelocityConstraint(Constraint):
    """Rows ``a(q, t) · v + b(q, t) = 0`` that hold velocities and need not come from positions.

    A new one is a frozen dataclass with a `name`. Its multipliers λ enter the balance as ``+aᵀ λ``, so −λ is the force
    of the row on the mechanism.
    """

    kind = "nonholonomic"

    @property
    @abstractmethod
    def unit(self) -> str:
        """'m' or 'rad': that of the rows times seconds."""

    @abstractmethod
    def rates(self, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """(part, a · v + b) of each row, linear in velocities [unit/s]; a single row has the part ''."""

    @property
    def contact(self) -> str | None:
        """The contact that must be closed for its rows to hold; None: they hold at all times."""
        return None

    def bare(self) -> dict[str, Constraint | None]:
        """Nothing: its rows have no limit."""
        return {}

    def act(self, scope: Scope, hold: Hold) -> Law:
        """Its rows."""
        rows = [Equation(value, part, self.unit, "velocity") for part, value in self.rates(scope)]
        return Law(rows, while_closed=self.contact)

    @property
    def details(self) -> str:
        """What it holds the velocities of."""
        return ", on the velocities of " + self._mentioned()
