"""A contact by Lagrange multipliers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

from mbd.bodies.domains import Domain
from mbd.bodies.values import name_of, number
from mbd.constraints.base import Constraint
from mbd.constraints.expressions import is_expression
from mbd.constraints.law import Closing, Equation, Hold, Law
from mbd.constraints.measure import Measure, gap_of
from mbd.constraints.rules import When, condition_of, releases_of
from mbd.constraints.user_measure import measure
from mbd.errors import ModelError
from mbd.forces.quantities import Mention
from mbd.scope import Scope
from mbd.tape.functions import maximum
from mbd.tape.node import Scalar

__all__ = ["Unilateral"]


@dataclass(frozen=True)
class Unilateral(Constraint):
    """``0 ≤ g ⟂ p ≥ 0``: a foot on the ground, a locking knee.

    While it is closed ``g = 0`` and p = −λ pushes; it closes with an impact ``γ⁺ = −e γ⁻`` and opens when p would pull,
    or by its release rule.

    Parameters
    ----------
    name : its name
    measure : where
    restitution : e of Newton's law, 0 (plastic) to 1
    friction : None: it sticks where the measure has tangents; 0: it slides freely; μ > 0: Coulomb's law,
        ``‖λ_T‖ ≤ μ p``, it sticks, slips and turns around; in space it slides in a plane, opposite to its velocity
    release : `When` another contact closes (or several of them), instead of on pull, or besides (`may_pull=False`);
        while it pulls it has no friction
    only_while : name of a contact that must be closed, or a measure that must be positive, for this one to be watched
    """

    name: str
    measure: Measure
    restitution: float = 0.0
    friction: float | None = None
    release: When | tuple[When, ...] | None = None
    only_while: str | Measure | None = None

    def __post_init__(self) -> None:
        name_of(self.name, "Unilateral")
        put = object.__setattr__
        put(self, "measure", measure_of(self.measure, f"Unilateral '{self.name}'"))
        put(self, "restitution", number(self.restitution, f"restitution of '{self.name}'"))
        if self.friction is not None:
            put(self, "friction", number(self.friction, f"friction of '{self.name}'"))
        put(self, "release", releases_of(self.release, self.name) or None)
        put(self, "only_while", condition_of(self.only_while, self.name))

    @property
    def kind(self) -> str:
        """'unilateral'."""
        return "unilateral"

    @property
    def releases(self) -> tuple[When, ...]:
        """The rules that open it; empty where it opens on pull."""
        return releases_of(self.release, self.name)

    @property
    def opens_on(self) -> Literal["pull", "when"]:
        """'pull', or 'when' where every rule lets it pull until then."""
        return "when" if self.release and all(rule.may_pull is not False for rule in self.releases) else "pull"

    @property
    def sticks(self) -> bool:
        """Whether tangent rows hold it while it is closed."""
        return self.friction is None and (self.measure.has_tangents or self.measure.has_slip_velocities)

    @property
    def slides(self) -> bool:
        """Whether Coulomb friction resists its sliding."""
        return self.friction is not None and self.friction > 0.0

    def act(self, scope: Scope, hold: Hold) -> Law:
        """A normal row, and tangent rows that hold the place of touchdown where and while it sticks."""
        gap, unit = gap_of(self.measure, scope), self.measure.unit
        rows = [Equation(gap, "normal", unit)]
        if self.sticks or self.slides:
            limit = partial(self._limit, scope) if self.slides else None
            tangents = self.measure.tangents(scope, hold(self.measure.captured(scope)))
            rows += [Equation(slip, part, limit=limit, may_fold=True) for part, slip in tangents]
            rows += [
                Equation(slip, part, level="velocity", limit=limit)
                for part, slip in self.measure.slip_velocities(scope)
            ]
        contact = Closing(gap, unit, self.opens_on, self.releases, self.only_while, self.restitution)
        return Law(rows, contact)

    def anchors(self, scope: Scope) -> int:
        """The place of touchdown, where it holds one."""
        return len(self.measure.captured(scope)) if self.sticks or self.slides else 0

    def _limit(self, scope: Scope, push: Scalar) -> Scalar:
        """μ p, none while a rule lets it pull."""
        coefficient = scope.parameter(self.name, "mu", self.friction or 0.0)
        return coefficient * (maximum(push, 0.0) if self.opens_on == "when" else push)

    def bare(self) -> dict[str, Constraint | None]:
        """Its friction."""
        return {f"{self.name} friction": replace(self, friction=0.0)} if self.slides else {}

    @property
    def details(self) -> str:
        """Where, and when it opens."""
        text = f", {self.measure.details}" + (", sticks" if self.sticks else "")
        rules = [f"'{rule.other}' closes{' (after the impact)' if rule.after_impact else ''}" for rule in self.releases]
        on_pull = ["on pull"] if self.opens_on == "pull" else []
        text += ", opens " + " or ".join((["as " + " or ".join(rules)] if rules else []) + on_pull)
        if self.only_while is None:
            return text
        other = self.only_while
        return text + (f", only while {other.details} > 0" if isinstance(other, Measure) else f", only while '{other}'")

    def parameters(self) -> dict[str, float]:
        """'<name>.mu' where it slides with friction, and those of its measure."""
        return ({f"{self.name}.mu": self.friction} if self.friction else {}) | self.measure.parameters()

    def domains(self) -> dict[str, Domain]:
        """μ ≥ 0."""
        mu = Domain(low=0.0, problem="is negative; give 0, or None to stick", called="friction")
        return {f"{self.name}.mu": mu} | self.measure.domains()

    @property
    def others(self) -> tuple[str, ...]:
        """The contacts of its rules."""
        names = [rule.other for rule in self.releases]
        return (*names, self.only_while) if isinstance(self.only_while, str) else tuple(names)

    def mentions(self) -> list[Mention]:
        """What its measures depend on."""
        condition = self.only_while.mentions() if isinstance(self.only_while, Measure) else []
        return [*self.measure.mentions(), *condition]

    def faults(self) -> list[str]:
        """An impossible restitution or friction, a rule that names itself."""
        faults = self.measure.faults(self.name) + super().faults()
        if not 0.0 <= self.restitution <= 1.0:
            faults.append(f"'{self.name}': restitution {self.restitution:g} is not between 0 and 1")
        if self.slides and not (self.measure.has_tangents or self.measure.has_slip_velocities):
            faults.append(
                f"'{self.name}': friction {self.friction:g} on a {self.measure.title}, which has no direction to slide "
                "in; use mbd.touchdown, give mbd.measure(…, tangents=…), or friction=0"
            )
        if any(rule.other == self.name for rule in self.releases):
            faults.append(f"'{self.name}': release=When('{self.name}') names itself; name the contact that opens it")
        if self.only_while == self.name:
            faults.append(f"'{self.name}': only_while='{self.name}' names itself; name another contact")
        return faults


def measure_of(value: object, what: str) -> Measure:
    """A measure, checked at the border; a sympy expression of a `Lagrangian`'s coordinates is one [m]."""
    if is_expression(value):
        return measure(value)
    if not isinstance(value, Measure):
        raise ModelError(f"{what} needs a measure such as mbd.touchdown(shank.end) or mbd.flexion(knee), got {value!r}")
    return value
