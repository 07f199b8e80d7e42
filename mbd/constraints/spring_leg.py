"""A leg of no mass that is a spring: runners and hoppers on springs."""

import math
from collections.abc import Sequence

from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain, positive
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of, number
from mbd.constraints.base import Constraint
from mbd.constraints.law import Closing, Drag, Hold, Law
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import frame_of
from mbd.forces.quantities import Mention
from mbd.tape.functions import cos, sin, sqrt, where

FIELDS = ("stiffness", "length", "touchdown_angle")


@dataclass(frozen=True)
class SpringLeg(Constraint):
    """A spring without mass between a hip and its foot on level ground, y = 0 (spring-loaded inverted pendulum).

    In flight the leg has its rest length l and the angle α to the ground, with the foot at ``x + l cos α`` ahead of the
    hip. It touches down as ``y = l sin α`` falls through zero, its foot stays there, and it pushes with ``k (l − r)``
    along the line of length r from foot to hip until that is zero. There is no impact, and no energy is lost. Where
    the next apex is not above ``l sin α`` there is no place for the leg: a runner stumbles. As its hip comes
    down to the ground the run ends with an error.

    R. Blickhan, The spring-mass model for running and hopping, J. Biomech. 22 (1989) 1217; A. Seyfarth, H. Geyer, M.
    Günther & R. Blickhan, A movement criterion for running, J. Biomech. 35 (2002) 649.

    One leg stands for both of a runner, of which at most one is on the ground.

    Parameters
    ----------
    name : its name
    hip : the point from which it pushes, of a body that moves in the plane x, y
    stiffness : k > 0 [N/m]
    length : l > 0 [m]
    touchdown_angle : α of the leg in flight, 0 < α < π [rad]; beyond π/2 the foot is behind the hip

    Results: 'name.force' its part along y, 'name.thrust' that along x [N], 'name.foot' where its foot is [m]. In the
    ledger both have a line of the kind 'penalty', whose sum is what its spring gives; what it holds is part of the
    energy of a gait.
    """

    name: str
    hip: Frame
    stiffness: float
    length: float
    touchdown_angle: float

    kind = "penalty"

    def __post_init__(self) -> None:
        name_of(self.name, "SpringLeg")
        frame_of(self.hip, f"hip of SpringLeg '{self.name}'")
        for field in FIELDS:
            object.__setattr__(self, field, number(getattr(self, field), f"{field} of '{self.name}'"))
        wrong = [
            fault
            for name, domain in self.domains().items()
            for fault in domain.faults(f"SpringLeg '{self.name}'", name.rpartition(".")[2], self.parameters()[name])
        ]
        if wrong:
            raise ModelError(wrong)

    @property
    def undefined(self) -> str:
        """What it means that the hip is below the ground."""
        return (
            "its hip has come down to the ground, where the leg finds no place: it has fallen; to end such a run "
            "before, give an mbd.Event on a height, with terminal=True"
        )

    def mentions(self) -> list[Mention]:
        """Its hip."""
        return [self.hip]

    def parameters(self) -> dict[str, float]:
        """`stiffness`, `length`, `touchdown_angle`."""
        return {f"{self.name}.{field}": float(getattr(self, field)) for field in FIELDS}

    def domains(self) -> dict[str, Domain]:
        """k > 0, l > 0, 0 < α < π."""
        angle = Domain(
            0.0, math.pi, (0.0, math.pi), "is not between 0 and π; give that of the leg to the ground", "rad"
        )
        return {
            f"{self.name}.stiffness": positive("does not push; give a positive one", "N/m"),
            f"{self.name}.length": positive(unit="m"),
            f"{self.name}.touchdown_angle": angle,
        }

    def held_at(self, place: Sequence[float]) -> Sequence[float]:
        """The foot's x [m]."""
        return [float(place[0])]

    def act(self, scope: Scope, hold: Hold) -> Law:
        """k (l − r) along the leg, from where its foot touched down."""
        k, length, angle = (scope.parameter(self.name, field, getattr(self, field)) for field in FIELDS)
        motion = scope.frame(self.hip)
        x, y, _ = motion.position
        (foot,) = hold([x + length * cos(angle)])
        r = sqrt((x - foot) * (x - foot) + y * y)
        tension = k * (length - r) / r
        above = where(y > 0.0, y, sqrt(y))  # no number below the ground
        swung = (x + length * cos(angle), y - length * sin(angle), 0.0)
        return Law(
            contact=Closing(above - length * sin(angle), opens_on="pull"), push=tension * y,
            elastic=0.5 * k * (length - r) * (length - r),
            drags=[Drag(motion.velocity[0], tension * (x - foot), "thrust")], foot=((foot, 0.0, 0.0), swung),
        )  # fmt: skip
