"""Results of the mechanism as a whole: center of mass, momentum, angular momentum, center of pressure.

They are offered by name, and not listed: they cost nothing until somebody asks for them.
"""

from collections.abc import Callable, Mapping
from functools import cached_property

from mbd.bodies.algebra import cross, difference, dot, rotate, scaled, total
from mbd.bodies.mass import MassProperties
from mbd.bodies.scope import Triple
from mbd.dataclass import dataclass
from mbd.equations.derivation_context import DerivationContext
from mbd.equations.kinematics import Moving
from mbd.equations.outputs import AXES, Outputs
from mbd.tape.functions import sqrt, where
from mbd.tape.node import Node, Scalar

ZERO: Triple = (0.0, 0.0, 0.0)


def offer_whole_body(outputs: Outputs, scope: DerivationContext, masses: Mapping[str, MassProperties]) -> None:
    """Offer the results of all bodies together, in ground axes.

    With masses m, places p of the centers, velocities v, accelerations a, inertias I about the centers:

    - 'center of mass' ``c = Σ m p / M`` [m], with '.vx', '.ax' and so on;
    - 'extrapolated center of mass' ``c + ċ √(c_y/|g|)`` [m] (A. L. Hof, M. G. J. Gazendam & W. E. Sinke, J. Biomech. 38
      (2005) 1), whose distance from the edge of the support is the margin of stability;
    - 'momentum' ``Σ m v`` [N s]; 'angular momentum' about c, ``Σ m (p − c) × (v − ċ) + I ω`` [N m s];
    - 'external force' ``F = Σ m (a − g)`` [N], the sum of all forces from outside but gravity, and 'external moment'
      ``Σ p × m (a − g) + I α + ω × I ω`` [N m] about the origin of the ground;
    - 'center of pressure', where on y = 0 these have no moment but a vertical one [m]: that of the ground where nothing
      else acts from outside; NaN while less than a thousandth of the weight pushes.
    """
    moving = [body for body in scope.bodies.values() if body.parent is not None]
    whole = _Whole(scope, [(body, masses[body.body.name]) for body in moving])
    if not whole.parts:
        return
    made: dict[str, tuple[Callable[[], Triple], tuple[str, ...]]] = {
        "center of mass": (lambda: whole.center, ("x", "y", "z")),
        "momentum": (lambda: whole.momentum, ("x", "y", "z")),
        "angular momentum": (lambda: whole.angular_momentum, ("x", "y", "z")),
        "extrapolated center of mass": (lambda: whole.extrapolated, ("x", "y", "z")),
        "external force": (lambda: whole.loads[0], ("x", "y", "z")),
        "external moment": (lambda: whole.loads[1], ("x", "y", "z")),
        "center of pressure": (lambda: whole.pressure, ("x", "y", "z")),
    }
    for name, (make, suffixes) in made.items():
        outputs.triple(name, make, suffixes, listed=False)
    outputs.triple("center of mass", lambda: whole.velocity, [f"v{axis}" for axis in AXES], listed=False)
    outputs.triple("center of mass", lambda: whole.acceleration, [f"a{axis}" for axis in AXES], listed=False)


@dataclass(frozen=True)
class _Whole:
    """Sums over the bodies, made when they are asked for."""

    scope: DerivationContext
    bodies: list[tuple[Moving, MassProperties]]

    @cached_property
    def parts(self) -> list[tuple[Moving, MassProperties]]:
        """The bodies that have a mass."""
        return [(body, mass) for body, mass in self.bodies if not _is_zero(mass.mass)]

    @cached_property
    def mass(self) -> Scalar:
        sum_: Scalar = 0.0
        for _, mass in self.parts:
            sum_ = sum_ + mass.mass
        return sum_

    def _mean(self, of: Callable[[Moving], Triple]) -> Triple:
        sum_ = ZERO
        for body, mass in self.parts:
            sum_ = total(sum_, scaled(mass.mass, of(body)))
        return scaled(1.0 / self.mass, sum_)

    def _center(self, body: Moving) -> Triple:
        return self.scope.frame(body.body.center).position

    def _speed(self, body: Moving) -> Triple:
        return self.scope.frame(body.body.center).velocity

    @cached_property
    def center(self) -> Triple:
        return self._mean(self._center)

    @cached_property
    def velocity(self) -> Triple:
        return self._mean(self._speed)

    @cached_property
    def acceleration(self) -> Triple:
        x, y, z = (self.scope.change(speed) for speed in self.velocity)
        return x, y, z

    @cached_property
    def momentum(self) -> Triple:
        return scaled(self.mass, self.velocity)

    @cached_property
    def angular_momentum(self) -> Triple:
        sum_ = ZERO
        for body, mass in self.parts:
            apart = difference(self._center(body), self.center)
            speed = difference(self._speed(body), self.velocity)
            R = self.scope.frame(body.body.center).rotation
            spin = rotate(R, rotate(mass.inertia, body.angular_velocity))
            sum_ = total(sum_, total(scaled(mass.mass, cross(apart, speed)), spin))
        return sum_

    @cached_property
    def extrapolated(self) -> Triple:
        size = sqrt(self._gravity_squared)
        ratio = sqrt(self.center[1] / size)
        return total(self.center, scaled(ratio, self.velocity))

    @property
    def _gravity_squared(self) -> Scalar:
        pull = self.scope.bodies["ground"].acceleration
        return self.scope.tape.lift(dot(pull, pull))

    @cached_property
    def loads(self) -> tuple[Triple, Triple]:
        force, moment = ZERO, ZERO
        for body, mass in self.parts:
            R = self.scope.frame(body.body.center).rotation
            pull = rotate(R, scaled(mass.mass, body.acceleration_at(mass.center)))
            turning = rotate(mass.inertia, body.angular_acceleration)
            gyration = cross(body.angular_velocity, rotate(mass.inertia, body.angular_velocity))
            force = total(force, pull)
            moment = total(moment, total(cross(self._center(body), pull), rotate(R, total(turning, gyration))))
        return force, moment

    @cached_property
    def pressure(self) -> Triple:
        force, moment = self.loads
        # part of the weight below which nothing is taken to push on the ground, so that there is no center of pressure
        least = 1e-3 * self.mass * sqrt(self._gravity_squared)
        acts = where(force[1] > least, 1.0, 0.0)  # 0/0 where nothing pushes
        up = force[1] * acts
        return (moment[2] * acts) / up, (0.0 * acts) / up, (-moment[0] * acts) / up


def _is_zero(value: Scalar) -> bool:
    return value.is_zero if isinstance(value, Node) else value == 0.0
