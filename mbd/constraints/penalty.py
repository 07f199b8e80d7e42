"""A contact by a force law."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from mbd.bodies.domains import Domain, at_least_zero, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import among, name_of, number
from mbd.constraints.base import Constraint
from mbd.constraints.bristles import Bristles
from mbd.constraints.law import Closing, Drag, Hold, Law
from mbd.constraints.measure import Measure, gap_of
from mbd.constraints.penalty_parameters import largest_dt
from mbd.constraints.restitution import KELVIN_VOIGT, MIN_RESTITUTION, chi_for, damping_ratio_for, law_of, wanted
from mbd.constraints.rules import condition_details, condition_faults, condition_of, contacts_of, mentions_of
from mbd.constraints.unilateral import measure_of
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.quantities import Mention
from mbd.joints.losses.base import StateRates
from mbd.tape.derivatives import substitute
from mbd.tape.functions import maximum, sqrt
from mbd.tape.node import Node, Scalar

MIN_APPROACH_SPEED = 1e-6
"""Least approach speed of the χ laws [m/s or rad/s], the default of 'name.slowest': a touch at rest divides by it."""

CREEP_SPEED = 1e-3
"""Speed at which friction is 1/√2 of what it becomes, the default of 'name.creep' [m/s]."""

NUMBERS = ("stiffness", "damping", "exponent", "creep")
"""Arguments that are always numbers."""


@dataclass(frozen=True)
class Penalty(Constraint):
    """A force law on the penetration ``δ = −g`` while it acts: a rubber stop, a mat, a ball on a plate.

    Without restitution, ``p = k δⁿ + c δ̇`` (Kelvin & Voigt for n = 1). With it, ``p = max(0, k δⁿ (1 + χ δ̇/δ̇₀))``,
    δ̇₀ the approach speed as it closes; χ gives that restitution exactly, whatever k, m and n are, or is that of a
    published law, which only comes near it (see `mbd.constraints.restitution`). It begins to act as g falls through
    zero. `mbd.penalty_parameters` finds k and a safe dt.

    Parameters
    ----------
    name : its name
    measure : where
    stiffness : k [N/mⁿ, or N m/radⁿ]
    damping : c [N s/m, or N m s/rad]
    exponent : n ≥ 1, fixed when the model is built (3/2 for Hertz)
    restitution : e of an impact without other forces, 0.05 to 1, instead of `damping`
    law : how e becomes a loss: 'exact' (default), 'hunt-crossley', 'lankarani-nikravesh', 'flores', 'gonthier', or
        'kelvin-voigt', a damper for the `effective_mass` (n = 1)
    release : of Kelvin–Voigt. 'gap': it acts until g > 0 again and may pull just before; 'pull': until the force would
        attract. The χ laws never pull and end at g = 0
    effective_mass : mass that the contact feels, ``1/(J M⁻¹ Jᵀ)`` with J = ∂g/∂q [kg, or kg m²], for 'kelvin-voigt'
        with a restitution
    friction : μ ≥ 0, opposite to the velocity γ along the surface, ``f = −μ p γ/√(‖γ‖² + creep²)``: under a load T
        below μ p it creeps with ``creep T/√((μ p)² − T²)``. `mbd.Bristles` stick elastically, a `Unilateral` truly
    creep : speed at which friction is 1/√2 of μ p [m/s]
    only_while : name of a contact that must be closed, or what must be positive (a measure, a function of named
        quantities, an expression), for it to begin to act
    """

    name: str
    measure: Measure
    stiffness: float
    damping: float = 0.0
    exponent: float = 1.0
    restitution: float | None = None
    law: str | None = None
    release: str = "gap"
    effective_mass: float | None = None
    friction: float | Bristles = 0.0
    creep: float = CREEP_SPEED
    only_while: Any = None

    kind = "penalty"

    def __post_init__(self) -> None:
        name_of(self.name, "Penalty")
        object.__setattr__(self, "measure", measure_of(self.measure, f"Penalty '{self.name}'"))
        for field in (*NUMBERS, "restitution", "effective_mass"):
            if getattr(self, field) is not None or field in NUMBERS:
                object.__setattr__(self, field, number(getattr(self, field), f"{field} of '{self.name}'"))
        if not isinstance(self.friction, Bristles):
            object.__setattr__(self, "friction", number(self.friction, f"friction of '{self.name}'"))
        if not among(self.release, ("gap", "pull")):
            raise ModelError(f"release of Penalty '{self.name}' is 'gap' or 'pull', got {self.release!r}")
        object.__setattr__(self, "only_while", condition_of(self.only_while, self.name))
        law_of(self.law, f"Penalty '{self.name}'")
        contradictions = self._contradictions()
        if contradictions:
            raise ModelError(contradictions)
        if self.restitution is not None:
            wanted(self.restitution, f"Penalty '{self.name}'")

    def _contradictions(self) -> list[str]:
        """Arguments that say the same thing twice, or nothing without another."""
        title, found = f"Penalty '{self.name}'", []
        if self.restitution is None:
            if self.law not in (None, KELVIN_VOIGT):
                found.append(f"{title}: law={self.law!r} turns a restitution into a loss; give restitution too")
            if self.effective_mass is not None:
                found.append(f"{title}: effective_mass serves law='{KELVIN_VOIGT}' with a restitution; give both")
            return found
        if self.damping != 0.0:
            found.append(
                f"{title}: damping {self.damping:g} and restitution {self.restitution:g} both say how much is lost; "
                "give one of them"
            )
        if self.law != KELVIN_VOIGT:
            if self.effective_mass is not None:
                found.append(
                    f"{title}: effective_mass serves law='{KELVIN_VOIGT}' only, got law={self.law!r}, which needs no "
                    "mass; leave one of them out"
                )
            return found
        return found + self._contradictions_of_kelvin_voigt(title)

    def _contradictions_of_kelvin_voigt(self, title: str) -> list[str]:
        """What that law needs besides a restitution."""
        found = []
        if self.exponent != 1.0:
            found.append(
                f"{title}: law='{KELVIN_VOIGT}' reaches a restitution for exponent 1 only, got exponent "
                f"{self.exponent:g}; use law='exact'"
            )
        if self.effective_mass is None or self.effective_mass <= 0.0:
            found.append(
                f"{title}: law='{KELVIN_VOIGT}' reaches a restitution for one effective_mass only; give it, a positive "
                f"one (got {self.effective_mass}), or use law='exact'"
            )
        return found

    @property
    def chi(self) -> float | None:
        """χ of its law; None where a damper takes the energy."""
        if self.restitution is None or self.law == KELVIN_VOIGT:
            return None
        return chi_for(self.restitution, law_of(self.law, self.name))

    @property
    def damper(self) -> float:
        """c: `damping`, or that of Kelvin–Voigt for a restitution, ``2 ζ √(k m)`` [N s/m, or N m s/rad]."""
        if self.restitution is None or self.effective_mass is None:
            return self.damping
        ratio = damping_ratio_for(self.restitution, self.release)
        return 2.0 * ratio * math.sqrt(max(self.stiffness, 0.0) * self.effective_mass)

    @property
    def opens_on(self) -> Literal["gap", "pull"]:
        """'gap' or 'pull'."""
        return "gap" if self.chi is not None or self.release == "gap" else "pull"

    def act(self, scope: Scope, hold: Hold) -> Law:
        """Its force, and the energy of its spring."""
        gap = gap_of(self.measure, scope)
        rate = scope.rate(gap)
        push = self.force(gap, rate, scope, *hold(self.captured(rate)))
        contact = Closing(gap, self.measure.unit, self.opens_on, only_while=self.only_while)
        slips = _slip_velocities(self.measure, scope, hold) if self.has_friction else []
        drags: list[Drag] = []
        rates: StateRates = ()
        open_rates: bool | Sequence[Scalar] = True
        if isinstance(self.friction, Bristles):
            drags, rates, open_rates = self.friction.act(slips, push, scope, self.name)
        elif self.has_friction:
            coefficient = scope.parameter(self.name, "mu", self.friction)
            creep = scope.parameter(self.name, "creep", self.creep)
            drags = _rub(slips, coefficient * push, creep)
        return Law(
            contact=contact,
            push=push,
            drags=drags,
            elastic=self.elastic_energy(gap, scope),
            rates=rates,
            rates_while_open=open_rates,
        )

    @property
    def has_friction(self) -> bool:
        """Whether friction resists its sliding."""
        return self.friction != 0.0

    def anchors(self, scope: Scope) -> int:
        """The approach speed, where its loss follows it, and with friction the place of touchdown."""
        return len(self.captured(0.0)) + (len(self.measure.captured(scope)) if self.has_friction else 0)

    def bare(self) -> dict[str, Constraint | None]:
        """Its friction, beside itself."""
        return super().bare() | ({f"{self.name} friction": replace(self, friction=0.0)} if self.has_friction else {})

    def resolving_dt(self, values: Mapping[str, float], mass: float, speed: float) -> float:
        """A fifth of the time until the deepest point, as `mbd.penalty_parameters` has it."""
        k, c, chi = (values.get(f"{self.name}.{field}", 0.0) for field in ("stiffness", "damping", "chi"))
        return largest_dt(k, self.exponent, c, chi, mass, speed)

    @property
    def details(self) -> str:
        """Where, how stiff, and what it loses."""
        loss = f"damping {self.damper:.6g}" if self.chi is None else f"chi {self.chi:.6g}"
        friction = f", friction {self._friction_text}" if self.has_friction else ""
        condition = condition_details(self.only_while)
        return f", {self.measure.details}, stiffness {self.stiffness:.6g}, {loss}{friction}{condition}"

    @property
    def _friction_text(self) -> str:
        """Its friction as it was given."""
        return repr(self.friction) if isinstance(self.friction, Bristles) else f"{self.friction:.6g}"

    def captured(self, gap_rate: Scalar) -> tuple[Scalar, ...]:
        """What is held from the instant of closing: the approach speed −ġ, where χ needs it."""
        return () if self.chi is None else (-gap_rate,)

    def force(self, gap: Scalar, gap_rate: Scalar, scope: Scope, approach: Scalar = 1.0) -> Scalar:
        """p [N or N m] of g, ġ and the approach speed as it closed."""
        k = scope.parameter(self.name, "stiffness", self.stiffness)
        chi = self.chi
        if chi is None:
            return k * self._power(-gap, scope) - scope.parameter(self.name, "damping", self.damper) * gap_rate
        slowest = scope.parameter(self.name, "slowest", MIN_APPROACH_SPEED)
        loss = scope.parameter(self.name, "chi", chi) * gap_rate / maximum(approach, slowest)
        pushing: Scalar = maximum(1.0 - loss, 0.0)
        return k * self._power(-gap, scope) * pushing

    def elastic_energy(self, gap: Scalar, scope: Scope) -> Scalar | None:
        """∫ k δⁿ dδ [J] from touch to the depth δ = −g: what the contact can give back; None where its law is another.

        The energy ledger books it apart from what is lost, so that an impact of few steps is booked rightly too.
        """
        own = type(self)
        if own.force is not Penalty.force or own._power is not Penalty._power:
            return None
        k, power = scope.parameter(self.name, "stiffness", self.stiffness), scope.tape.power
        depth = -gap if self._is_odd else maximum(-gap, gap if self.opens_on == "pull" else 0.0)
        energy: Scalar = k * power(depth, self.exponent + 1.0) / (self.exponent + 1.0)
        return energy

    @property
    def _is_odd(self) -> bool:
        """Whether δⁿ is negative, and not 0, where δ is."""
        return self.chi is None and self.exponent % 2.0 == 1.0

    def _power(self, depth: Scalar, scope: Scope) -> Scalar:
        """δⁿ; where δ < 0 it is 0, or negative where the sign of the force tells when to open."""
        power = scope.tape.power
        if self._is_odd:
            return power(depth, self.exponent)
        pressed: Scalar = power(maximum(depth, 0.0), self.exponent)
        if self.opens_on == "pull":
            pressed = pressed - power(maximum(-depth, 0.0), self.exponent)
        return pressed

    @property
    def others(self) -> tuple[str, ...]:
        """The contact of `only_while`."""
        return contacts_of(self.only_while)

    def mentions(self) -> list[Mention]:
        """What its measures depend on."""
        return [*self.measure.mentions(), *mentions_of(self.only_while)]

    def parameters(self) -> dict[str, float]:
        """`stiffness`, `damping` or `chi` and `slowest`, those of its friction, and those of its measure."""
        chi = self.chi
        loss = {"damping": self.damper} if chi is None else {"slowest": MIN_APPROACH_SPEED, "chi": chi}
        friction: dict[str, float] = {}
        if isinstance(self.friction, Bristles):
            friction = self.friction.fields()
        elif self.has_friction:
            friction = {"mu": self.friction, "creep": self.creep}
        own = {
            f"{self.name}.{field}": value for field, value in {"stiffness": self.stiffness, **loss, **friction}.items()
        }
        return own | self.measure.parameters()

    def domains(self) -> dict[str, Domain]:
        """A stiffness > 0, damping ≥ 0; χ from that of no loss to that of the least restitution."""
        domains = {"stiffness": positive("does not push; give a positive one")}
        if self.chi is None:
            domains["damping"] = at_least_zero("would feed energy in; give a value ≥ 0")
        else:
            largest = chi_for(MIN_RESTITUTION, law_of(self.law, self.name))
            problem = f"is not between 0 and {largest:g}, which belong to the restitutions 1 and {MIN_RESTITUTION:g}"
            domains |= {"chi": Domain(low=0.0, high=largest, problem=problem), "slowest": positive(unit="m/s")}
        if isinstance(self.friction, Bristles):
            domains |= self.friction.domains()
        elif self.has_friction:
            domains["mu"] = Domain(low=0.0, problem="is negative; give 0 for none", called="friction")
            domains["creep"] = positive(unit="m/s")
        return {f"{self.name}.{field}": domain for field, domain in domains.items()} | self.measure.domains()

    def faults(self) -> list[str]:
        """A law that would not push, or would feed energy in."""
        faults = self.measure.faults(self.name) + super().faults() + condition_faults(self.only_while, self.name)
        if self.exponent < 1.0:
            faults.append(f"'{self.name}': exponent {self.exponent:g} is below 1, endlessly stiff at touch; give n ≥ 1")
        if self.has_friction and not (self.measure.has_tangents or self.measure.has_slip_velocities):
            faults.append(
                f"'{self.name}': friction {self._friction_text} on a {self.measure.title}, which has no direction to "
                "slide in; use mbd.touchdown, give mbd.measure(…, tangents=…), or friction=0"
            )
        return faults


def _slip_velocities(measure: Measure, scope: Scope, hold: Hold) -> list[tuple[str, Scalar]]:
    """(part, velocity [m/s]) of the contact point along the surface, forward and sideways.

    Those of a measure with tangents are the rates of their residuals, with the directions at the point of now.
    """
    captured = measure.captured(scope)
    held = hold(captured)
    here = {anchor: value for anchor, value in zip(held, captured, strict=True) if isinstance(anchor, Node)}
    found: list[tuple[str, Scalar]] = []
    for part, residual in measure.tangents(scope, held):
        rate = scope.rate(residual)
        found.append((part, substitute([rate], here)[0] if isinstance(rate, Node) else rate))
    return found + [(part, velocity) for part, velocity in measure.slip_velocities(scope)]


def _rub(velocities: Sequence[tuple[str, Scalar]], limit: Scalar, creep: Scalar) -> list[Drag]:
    """``f = −limit γ/√(‖γ‖² + creep²)``: opposite to γ in the plane of contact, limit where it slides fast.

    Parameters
    ----------
    velocities : γ, one or two parts [m/s]; a force acts along those that the mechanism can change
    limit : μ p [N]
    creep : speed at which friction is 1/√2 of that [m/s]
    """
    square: Scalar = creep * creep
    for _, velocity in velocities:
        square = square + velocity * velocity
    size: Scalar = maximum(limit, 0.0) / sqrt(square)
    if len(velocities) == 1:
        return [Drag(velocity, -1.0 * size * velocity) for _, velocity in velocities]
    return [Drag(velocity, -1.0 * size * velocity, f"friction.{part}", True) for part, velocity in velocities]
