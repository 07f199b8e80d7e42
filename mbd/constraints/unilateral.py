"""A contact by Lagrange multipliers."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal

from mbd.bodies.domains import Domain
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of, number
from mbd.constraints.base import Constraint
from mbd.constraints.expressions import is_expression
from mbd.constraints.law import Closing, Equation, Hold, Law, Rubbing
from mbd.constraints.measure import Measure, gap_of
from mbd.constraints.rules import (
    When,
    condition_details,
    condition_faults,
    condition_of,
    contacts_of,
    mentions_of,
    releases_of,
)
from mbd.constraints.user_measure import measure
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.quantities import Mention
from mbd.joints.losses.base import Loss, without_states
from mbd.joints.losses.isotropic import isotropic
from mbd.tape.functions import maximum
from mbd.tape.node import Scalar


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
        ``‖λ_T‖ ≤ μ p``, it sticks, slips and turns around; in space it slides in a plane, opposite to its velocity.
        A loss: its force per newton of normal force at the speed of the slip; ``Viscous(μ)``, μ in s/m, is
        ``λ_T = μ p γ``, ``Coulomb(0.3) + Viscous(0.1)`` sticks, and grows with speed beyond 0.3 p. Parameters are
        'name.mu', or 'name friction.coefficient', …
    release : `When` another contact closes (or several of them), instead of on pull, or besides (`may_pull=False`);
        while it pulls it has no friction
    only_while : name of a contact that must be closed, or what must be positive (a measure, a function of named
        quantities, an expression), for this one to be watched
    spin_friction : ρ ≥ 0 of friction against spin about the normal, ``|M| ≤ ρ p`` [m], the parameter 'name.mu_spin'; it
        sticks and slips by itself, as 'name spin', and 'name.spin.torque' is M on the body [N m]. Of feet of bodies
        that turn in space: `touchdown` and `sphere_touchdown`. A round patch of radius R has ρ = ⅔ μ R under even load
    """

    name: str
    measure: Measure
    restitution: float = 0.0
    friction: float | Loss | None = None
    release: When | tuple[When, ...] | None = None
    only_while: Any = None
    spin_friction: float = 0.0

    kind = "unilateral"

    def __post_init__(self) -> None:
        name_of(self.name, "Unilateral")
        put = object.__setattr__
        put(self, "measure", measure_of(self.measure, f"Unilateral '{self.name}'"))
        put(self, "restitution", number(self.restitution, f"restitution of '{self.name}'"))
        put(self, "friction", _friction_of(self.friction, self.name))
        put(self, "spin_friction", number(self.spin_friction, f"spin_friction of '{self.name}'"))
        put(self, "release", releases_of(self.release, self.name) or None)
        put(self, "only_while", condition_of(self.only_while, self.name))

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
        """Whether friction resists its sliding: Coulomb's, which may stick, or a smooth one."""
        return isinstance(self.friction, Loss) or (self.friction is not None and self.friction > 0.0)

    @property
    def spins(self) -> bool:
        """Whether friction resists its spin about the normal."""
        return self.spin_friction > 0.0

    def act(self, scope: Scope, hold: Hold) -> Law:
        """A normal row, and tangent rows that hold the place of touchdown where and while it sticks."""
        gap, unit = gap_of(self.measure, scope), self.measure.unit
        rows, rubbing = [Equation(gap, "normal", unit)], None
        if self.sticks or self.slides:
            limit = partial(self._limit, scope) if self.slides else None
            tangents = self.measure.tangents(scope, hold(self.measure.captured(scope)))
            sliding = partial(self._sliding, scope) if isinstance(self.friction, Loss) else None
            slips = [Equation(slip, part, limit=limit, may_fold=True, sliding=sliding) for part, slip in tangents]
            slips += [
                Equation(slip, part, level="velocity", limit=limit, sliding=sliding)
                for part, slip in self.measure.slip_velocities(scope)
            ]
            loss = self.friction
            rows += slips if not isinstance(loss, Loss) or loss.sticks else []
            if isinstance(loss, Loss) and loss.smooth is not None:
                rubbing = Rubbing(slips, partial(self._resistance, scope, loss))
        if self.spins:
            spin = self.measure.spin(scope)
            rows.append(Equation(spin, "spin", "rad", "velocity", limit=partial(self._spin_limit, scope)))
        contact = Closing(gap, unit, self.opens_on, self.releases, self.only_while, self.restitution)
        return Law(rows, contact, rubbing=rubbing)

    def anchors(self, scope: Scope) -> int:
        """The place of touchdown, where it holds one."""
        return len(self.measure.captured(scope)) if self.sticks or self.slides else 0

    def _limit(self, scope: Scope, push: Scalar) -> Scalar:
        """μ p, none while a rule lets it pull."""
        if isinstance(self.friction, Loss):
            coefficient = self.friction.dry(0.0, scope, f"{self.name} friction")
        else:
            coefficient = scope.parameter(self.name, "mu", self.friction or 0.0)
        return coefficient * self._pushing(push)

    def _sliding(self, scope: Scope, push: Scalar, speed: Scalar) -> Scalar:
        """The same at the speed of its slip."""
        assert isinstance(self.friction, Loss)
        return self.friction.sliding(0.0, speed, scope, f"{self.name} friction") * self._pushing(push)

    def _resistance(self, scope: Scope, loss: Loss, push: Scalar, speeds: Sequence[Scalar]) -> Sequence[Scalar]:
        """Smooth friction along its slips, none while a rule lets it pull."""
        return _resistance(loss, self._pushing(push), speeds, scope, f"{self.name} friction")

    def _spin_limit(self, scope: Scope, push: Scalar) -> Scalar:
        """ρ p, none while a rule lets it pull."""
        return scope.parameter(self.name, "mu_spin", self.spin_friction) * self._pushing(push)

    def _pushing(self, push: Scalar) -> Scalar:
        pushing: Scalar = maximum(push, 0.0) if self.opens_on == "when" else push
        return pushing

    def bare(self) -> dict[str, Constraint | None]:
        """Its friction, and that of its spin."""
        found: dict[str, Constraint | None] = {}
        if self.slides:
            found[f"{self.name} friction"] = replace(self, friction=0.0)
        if self.spins:
            found[f"{self.name} spin friction"] = replace(self, spin_friction=0.0)
        return found

    @property
    def details(self) -> str:
        """Where, and when it opens."""
        text = f", {self.measure.details}" + (", sticks" if self.sticks else "")
        rules = [f"'{rule.other}' closes{' (after the impact)' if rule.after_impact else ''}" for rule in self.releases]
        on_pull = ["on pull"] if self.opens_on == "pull" else []
        text += ", opens " + " or ".join((["as " + " or ".join(rules)] if rules else []) + on_pull)
        return text + condition_details(self.only_while)

    def parameters(self) -> dict[str, float]:
        """'name.mu' where it slides with friction, or those of the loss; 'name.mu_spin'; and those of its measure."""
        own: dict[str, float] = {}
        if isinstance(self.friction, Loss):
            own = self.friction.parameters(f"{self.name} friction")
        elif self.friction:
            own = {f"{self.name}.mu": self.friction}
        if self.spin_friction:
            own |= {f"{self.name}.mu_spin": self.spin_friction}
        return own | self.measure.parameters()

    def domains(self) -> dict[str, Domain]:
        """μ ≥ 0, ρ ≥ 0."""
        mu = Domain(low=0.0, problem="is negative; give 0, or None to stick", called="friction")
        rho = Domain(low=0.0, problem="is negative; give 0 for none", unit="m", called="spin_friction")
        return {f"{self.name}.mu": mu, f"{self.name}.mu_spin": rho} | self.measure.domains()

    def value_faults(self, values: Mapping[str, float]) -> list[str]:
        """Values that its friction cannot have."""
        loss = self.friction.value_faults(f"{self.name} friction", values) if isinstance(self.friction, Loss) else []
        return loss + super().value_faults(values)

    @property
    def others(self) -> tuple[str, ...]:
        """The contacts of its rules."""
        return (*(rule.other for rule in self.releases), *contacts_of(self.only_while))

    def mentions(self) -> list[Mention]:
        """What its measures depend on."""
        return [*self.measure.mentions(), *mentions_of(self.only_while)]

    def faults(self) -> list[str]:
        """An impossible restitution or friction, a rule that names itself."""
        faults = self.measure.faults(self.name) + super().faults()
        if not 0.0 <= self.restitution <= 1.0:
            faults.append(f"'{self.name}': restitution {self.restitution:g} is not between 0 and 1")
        if isinstance(self.friction, Loss):
            faults += self.friction.faults(f"{self.name} friction")
        if self.spins and not self.measure.has_spin:
            faults.append(
                f"'{self.name}': spin_friction on a {self.measure.title}, which has no spin about a normal; use "
                "mbd.touchdown or mbd.sphere_touchdown, or leave it out"
            )
        if self.slides and not (self.measure.has_tangents or self.measure.has_slip_velocities):
            size = self.friction if isinstance(self.friction, Loss) else f"{self.friction:g}"
            faults.append(
                f"'{self.name}': friction {size} on a {self.measure.title}, which has no direction to slide "
                "in; use mbd.touchdown, give mbd.measure(…, tangents=…), or friction=0"
            )
        if any(rule.other == self.name for rule in self.releases):
            faults.append(f"'{self.name}': release=When('{self.name}') names itself; name the contact that opens it")
        return faults + condition_faults(self.only_while, self.name)


def measure_of(value: object, what: str) -> Measure:
    """A measure, checked at the border; a sympy expression of a `Lagrangian`'s coordinates is one [m]."""
    if is_expression(value):
        return measure(value)
    if not isinstance(value, Measure):
        raise ModelError(f"{what} needs a measure such as mbd.touchdown(shank.end) or mbd.flexion(knee), got {value!r}")
    return value


def _friction_of(value: Any, name: str) -> float | Loss | None:
    """What a contact's friction may be: None, μ, or a loss of the slip's speed, its force per newton of normal force.

    Raises
    ------
    ModelError
        for anything else, and a loss that follows the force in a joint.
    """
    if isinstance(value, Loss):
        if value.needs_reaction:
            raise ModelError(
                f"friction of '{name}': {value!r} follows the force in a joint; friction of a contact follows its "
                "normal force by itself: give μ, or mbd.Viscous(…)"
            )
        instead = "give a contact mbd.Coulomb, mbd.Stribeck, mbd.Viscous or μ"
        return without_states(value, f"friction of '{name}'", instead)
    if value is None:
        return None
    return number(value, f"friction of '{name}'")


def _resistance(loss: Loss, push: Scalar, speeds: Sequence[Scalar], scope: Scope, owner: str) -> list[Scalar]:
    """Forces on the mechanism along one slip, or two that are perpendicular: −p F(‖γ‖) γ/‖γ‖, F of the smooth part."""
    return [-push * part for part in isotropic(loss, speeds, scope, owner)]
