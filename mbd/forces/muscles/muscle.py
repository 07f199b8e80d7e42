"""A muscle: activation, contraction of its fibers, an elastic or a rigid tendon, and a path over joints."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from mbd.bodies.domains import Domain, at_least_zero, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import among, name_of, number
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import Action, Force, Result
from mbd.forces.muscles.curves import CURVES, Curves
from mbd.forces.muscles.paths import path_of
from mbd.forces.quantities import Mention, OfQuantities, Quantity, arguments_of, mentioned, quantity_of, scalar
from mbd.tape.functions import sin, sqrt, tanh
from mbd.tape.node import Scalar

TENDONS = ("elastic", "rigid")
NUMBERS = (
    "max_force", "fiber_length", "tendon_length", "pennation", "max_velocity", "damping", "activation_time",
    "deactivation_time", "smoothing",
)  # fmt: skip
DELAYS, ABSENT = NUMBERS[-3:], ("pennation", "damping")
"""Of these those of activation, and those that are not there where they are exactly 0."""


@dataclass(frozen=True)
class Muscle(OfQuantities, Force):
    """A muscle of the Hill type, which pulls along its path with the force of its tendon F.

    Fibers of the length l with pennation α and the tendon between them fill the path, ``l_MT(q) = l cos α + l_T``, at a
    constant thickness ``l sin α``. They carry

        ``F_max (a f_L(l) f_V(l̇) + f_P(l) + β l̇) cos α = F_max f_T(l_T) = F``,

    with lengths over `fiber_length` or `tendon_length` and l̇ over `max_velocity` `fiber_length`. An elastic tendon
    makes l a first-order state, 'name.fiber_length'; its rate is the solution of this equation (damped equilibrium). A
    rigid one makes l follow the posture, and F what the fibers carry. The activation a follows the excitation e

        ``ȧ = (e − a) [(½ + f)/(τ_a (½ + 3a/2)) + (½ − f)(½ + 3a/2)/τ_d]``, ``f = ½ tanh(b (e − a))``,

    as the state 'name.activation'; with activation_time=0 and deactivation_time=0 it is e itself. The force acts on the
    rate of the path, so that the moment arm about a coordinate is −∂l_MT/∂q exactly.

    F. De Groote, A. L. Kinney, A. V. Rao and B. J. Fregly, Ann. Biomed. Eng. 44 (2016) 2922 (curves, activation), with
    the constants of OpenSim's class of this name: ``f_T = 0.2 (6^(s/0.049) − 1)`` of a strain s vanishes at slack
    length, which that of the article does not;
    M. Millard, T. Uchida, A. Seth and S. L. Delp, J. Biomech. Eng. 135 (2013) 021005 (curves, damped equilibrium). Of
    bench tests, those authors found mean errors of 9 % of the largest force at full activation, 16 % below it.

    Parameters
    ----------
    name : its name
    path : points on bodies from origin to insertion (frames or `ViaPoint`), between them surfaces that it wraps around
        (`WrappingSphere`, `WrappingCylinder`), or a `PolynomialPath`
    max_force : F_max of the fibers, isometric [N]
    fiber_length : optimal length of the fibers [m]
    tendon_length : slack length of the tendon [m]
    pennation : α at the optimal length [rad]
    excitation : e from 0 to 1: a number (the parameter 'name.excitation'), a function, an expression or `Samples`
    tendon : 'elastic' or 'rigid'
    curves : 'de groote' or 'millard'
    max_velocity : of the fibers, in optimal lengths [1/s]
    damping : β ≥ 0 [-]; an elastic tendon needs 0.01 with Millard's curves
    activation_time, deactivation_time : τ_a, τ_d [s]
    smoothing : b, steepness between rise and fall [-]
    arguments : what a function is called with, as for `mbd.Applied`

    Raises
    ------
    ModelError
        for a path of fewer than two points, values outside their domains, an undamped elastic muscle of Millard.
    """

    name: str
    path: Any
    max_force: float
    fiber_length: float
    tendon_length: float
    pennation: float = 0.0
    excitation: Quantity = 0.01
    tendon: str = "elastic"
    curves: str = "de groote"
    max_velocity: float = 10.0
    damping: float = 0.1
    activation_time: float = 0.015
    deactivation_time: float = 0.060
    smoothing: float = 10.0
    arguments: Any = ("t",)

    kind = "applied"
    quantities = ("excitation",)

    def __post_init__(self) -> None:
        put = object.__setattr__
        name_of(self.name, "Muscle")
        put(self, "path", path_of(self.path, f"path of Muscle '{self.name}'"))
        for field, known in ("tendon", TENDONS), ("curves", tuple(CURVES)):
            if not among(getattr(self, field), known):
                listed = " or ".join(map(repr, known))
                raise ModelError(f"{field} of Muscle '{self.name}' is {listed}, got {getattr(self, field)!r}")
        for field in NUMBERS:
            put(self, field, number(getattr(self, field), f"{field} of '{self.name}'"))
        put(self, "excitation", quantity_of(self.excitation, f"excitation of '{self.name}'"))
        put(self, "arguments", arguments_of(self.arguments, f"Muscle '{self.name}'"))
        wrong = [
            fault
            for name, value in [*self._numbers().items(), *self._excited()]
            for fault in self.domains()[name].faults(f"Muscle '{self.name}'", name.rpartition(".")[2], value)
        ]
        if (self.activation_time == 0.0) != (self.deactivation_time == 0.0):
            wrong.append(f"Muscle '{self.name}': activation_time and deactivation_time are both 0 or both positive")
        if self.is_elastic and self.damping == 0.0 < self._curves.least_damping:
            wrong.append(
                f"Muscle '{self.name}': with curves={self.curves!r} and an elastic tendon damping must be "
                f"{self._curves.least_damping:g} at least, got {self.damping:g}; the paper takes 0.1"
            )
        if wrong:
            raise ModelError(wrong)

    @property
    def _curves(self) -> Curves:
        return CURVES[self.curves]

    @property
    def is_elastic(self) -> bool:
        """Whether the length of its fibers is a state."""
        return self.tendon == "elastic"

    @property
    def is_delayed(self) -> bool:
        """Whether its activation is a state."""
        return self.activation_time != 0.0

    def mentions(self) -> list[Mention]:
        """What its path and its excitation refer to."""
        return [*self.path.mentions(), *mentioned(self.arguments)]

    def _numbers(self) -> dict[str, float]:
        fields = [field for field in NUMBERS if self.is_delayed or field not in DELAYS]
        values = {field: getattr(self, field) for field in fields}
        return {f"{self.name}.{k}": value for k, value in values.items() if value != 0.0 or k not in ABSENT}

    def _excited(self) -> list[tuple[str, float]]:
        return [(f"{self.name}.excitation", self.excitation)] if isinstance(self.excitation, float) else []

    def parameters(self) -> dict[str, float]:
        """All numbers, the excitation where it is one, and its arguments."""
        points: dict[str, float] = self.path.parameters(self.name)
        return self._numbers() | super().parameters() | points

    def domains(self) -> dict[str, Domain]:
        """Positive sizes, a pennation below 90°, an excitation from 0 to 1."""
        units = {"max_force": "N", "fiber_length": "m", "tendon_length": "m", "max_velocity": "1/s", "smoothing": ""}
        found = {f"{self.name}.{field}": positive(unit=unit) for field, unit in units.items()}
        if self.is_delayed:
            times = ("activation_time", "deactivation_time")
            found |= {f"{self.name}.{field}": positive(unit="s") for field in times}
        found[f"{self.name}.pennation"] = Domain(0.0, 1.5, unit="rad")
        least = self._curves.least_damping if self.is_elastic else 0.0
        found[f"{self.name}.damping"] = Domain(low=least) if least else at_least_zero()
        found[f"{self.name}.excitation"] = Domain(0.0, 1.0)
        of_path: dict[str, Domain] = self.path.domains(self.name)
        return found | of_path

    # what happens -------------------------------------------------------------------------------------------------
    def act(self, scope: Scope) -> Action:
        """−F on the rate of the path, and the rates of activation and fibers."""
        length = self.path.length(scope, self.name)
        rates: list[Any] = []
        if self.is_delayed:
            rates.append((self._activation(scope), self._activation_rate(scope)))
        if self.is_elastic:
            state = scope.state(self.name, "fiber_length", self.fiber_length)
            rates.append((state, self._fiber_velocity(scope)))
        return Action(pairs=((scope.rate(scope.tape.lift(length)), -self._force(scope)),), rates=tuple(rates))

    def _number(self, scope: Scope, field: str) -> Scalar:
        return scope.parameter(self.name, field, getattr(self, field))

    def _excitation(self, scope: Scope) -> Scalar:
        return scalar(self.excitation, self.arguments, scope, self.name, "excitation")

    def _activation(self, scope: Scope) -> Any:
        if not self.is_delayed:
            return self._excitation(scope)
        start = self.excitation if isinstance(self.excitation, float) else 0.01
        return scope.state(self.name, "activation", start)

    def _activation_rate(self, scope: Scope) -> Scalar:
        a = self._activation(scope)
        missing = self._excitation(scope) - a
        rise = 0.5 * tanh(self._number(scope, "smoothing") * missing)
        scale = 0.5 + 1.5 * a
        up = (0.5 + rise) / (self._number(scope, "activation_time") * scale)
        down = (0.5 - rise) * scale / self._number(scope, "deactivation_time")
        rate: Scalar = missing * (up + down)
        return rate

    def _thickness(self, scope: Scope) -> Any:
        """``l sin α``, constant."""
        if self.pennation == 0.0:
            return 0.0
        return self._number(scope, "fiber_length") * sin(self._number(scope, "pennation"))

    def _fiber(self, scope: Scope) -> tuple[Any, Any]:
        """Length of the fibers, and what of it lies along the tendon [m]."""
        thickness = self._thickness(scope)
        if self.is_elastic:
            fiber: Any = scope.state(self.name, "fiber_length", self.fiber_length)
            along = fiber if self.pennation == 0.0 else sqrt(fiber * fiber - thickness * thickness)
            return fiber, along
        along = self.path.length(scope, self.name) - self._number(scope, "tendon_length")
        return (along if self.pennation == 0.0 else sqrt(along * along + thickness * thickness)), along

    def _load(self, scope: Scope) -> Any:
        """f_T."""
        tendon = self.path.length(scope, self.name) - self._fiber(scope)[1]
        return self._curves.tendon(tendon / self._number(scope, "tendon_length"))

    def _fiber_velocity(self, scope: Scope) -> Any:
        """Rate of the length of the fibers [m/s]."""
        fiber, along = self._fiber(scope)
        if not self.is_elastic:
            path = scope.tape.lift(self.path.length(scope, self.name))
            return scope.rate(path) * along / fiber
        optimal = self._number(scope, "fiber_length")
        force = self._load(scope) * fiber / along - self._curves.passive(fiber / optimal)
        active = self._activation(scope) * self._curves.active(fiber / optimal)
        damping = self._number(scope, "damping") if self.damping != 0.0 else 0.0
        velocity = self._curves.velocity(active, damping, force, damped=self.damping != 0.0)
        return velocity * self._number(scope, "max_velocity") * optimal

    def _force(self, scope: Scope) -> Any:
        if self.is_elastic:
            return self._number(scope, "max_force") * self._load(scope)
        return self._activation(scope) * self._strength(scope) + self._passive_force(scope)

    def _strength(self, scope: Scope) -> Any:
        """F_max f_L f_V cos α."""
        fiber, along = self._fiber(scope)
        optimal = self._number(scope, "fiber_length")
        speed = self._fiber_velocity(scope) / (self._number(scope, "max_velocity") * optimal)
        shape = self._curves.active(fiber / optimal) * self._curves.speed(speed)
        return self._number(scope, "max_force") * shape * along / fiber

    def _passive_force(self, scope: Scope) -> Any:
        """F_max (f_P + β l̇) cos α."""
        fiber, along = self._fiber(scope)
        optimal = self._number(scope, "fiber_length")
        speed = self._fiber_velocity(scope) / (self._number(scope, "max_velocity") * optimal)
        shape = self._curves.passive(fiber / optimal)
        if self.damping != 0.0:
            shape = shape + self._number(scope, "damping") * speed
        return self._number(scope, "max_force") * shape * along / fiber

    def results(self) -> dict[str, Result]:
        """'force' F [N], 'length' l_MT and 'fiber_length' l [m], 'fiber_velocity' [m/s], 'activation', 'excitation'.

        'active_strength' is F at a = 1 without the passive part, and 'passive_force' that part along the tendon [N].
        """
        found: dict[str, Callable[[Scope], Any]] = {
            "force": self._force, "length": lambda scope: self.path.length(scope, self.name),
            "fiber_velocity": self._fiber_velocity, "excitation": self._excitation,
            "active_strength": self._strength, "passive_force": self._passive_force,
        }  # fmt: skip
        if not self.is_delayed:
            found["activation"] = self._activation
        if not self.is_elastic:
            found["fiber_length"] = lambda scope: self._fiber(scope)[0]
        return {field: Result(partial(_value, function)) for field, function in found.items()}

    def fiber_at(self, length: float, activation: float, parameters: Mapping[str, float] | None = None) -> float:
        """The length of the fibers at rest [m], where they and the tendon carry the same.

        Give it to `mbd.assemble` as 'name.fiber_length', so that a run begins without a jerk of the fibers.

        Parameters
        ----------
        length : l_MT of the path [m], a state's ``state["name.length"]``
        activation : a ≥ 0 [-]
        parameters : values that differ from those of the muscle, by name, such as ``state.parameters``

        Returns
        -------
        float
            [m]

        Raises
        ------
        ModelError
            for a path so short that its tendon is slack.
        """
        from math import sqrt as root

        from scipy.optimize import brentq

        length = number(length, f"length of '{self.name}'")
        activation = number(activation, f"activation of '{self.name}'")
        given = {field: (parameters or {}).get(f"{self.name}.{field}", getattr(self, field)) for field in NUMBERS}
        optimal, slack = (number(given[f], f"{f} of '{self.name}'") for f in ("fiber_length", "tendon_length"))
        thickness = optimal * float(sin(number(given["pennation"], f"pennation of '{self.name}'")))

        def apart(fiber: float) -> float:
            along = root(fiber * fiber - thickness * thickness)
            curves, size = self._curves, fiber / optimal
            carried = (activation * float(curves.active(size)) + float(curves.passive(size))) * along / fiber
            return carried - float(curves.tendon((length - along) / slack))

        low = max(0.05 * optimal, thickness * (1.0 + 1e-9))
        high = max(root(length * length + thickness * thickness), 2.0 * low)
        if not apart(low) < 0.0 < apart(high):
            raise ModelError(
                f"Muscle '{self.name}' is slack at length {length:.3g} m with activation {activation:.3g}: fibers and "
                f"a tendon of {slack:.3g} m have no equilibrium there; give the length of a stretched path"
            )
        return float(brentq(apart, low, high, xtol=1e-15, rtol=1e-14))


def _value(function: Callable[[Scope], Any], scope: Scope) -> Scalar:
    found: Scalar = function(scope)
    return found
