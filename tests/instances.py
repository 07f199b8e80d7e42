"""The lists that the law tests run over: (id, factory). A new idea adds one line here, `several` where it has settings.

JOINTS    factory(parent, child) → joint, between any two frames
LOSSES    factory() → loss
FORCES    factory(a, b, joint) → force, from two frames of different bodies and a joint named 'hinge' with an `angle`
MEASURES  factory(a, b, joint) → measure, from the same
CONSTRAINTS  factory(a, b, joint) → constraint, from the same, whose first body floats on the joint 'float thigh'
INTEGRATORS  schemes
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import mbd
from mbd.bodies.base import Frame
from mbd.constraints.base import Constraint
from mbd.constraints.measure import Measure
from mbd.forces.base import Force
from mbd.integrators import Integrator
from mbd.joints.base import Joint
from mbd.joints.losses.base import Loss
from mbd.scope import Triple
from mbd.tape.node import Scalar

TILTED = (1.0, 2.0, -2.0)
"""A direction along no axis."""


def several(title: str, make: Callable[..., Any], **configurations: dict[str, Any]) -> list[tuple[str, Any]]:
    """One instance for each configuration of a word: (title and label, factory); '_' in a label is a space.

    ``several("screw", lambda a, b, **how: mbd.Screw("joint", a, b, **how), plain={"pitch": 0.2}, steep={"pitch": 2})``
    """
    signature = inspect.signature(make)
    own = [each for each in signature.parameters.values() if each.kind is not each.VAR_KEYWORD]

    def instance(how: dict[str, Any]) -> Any:
        def factory(*given: Any) -> Any:
            return make(*given, **how)

        factory.__signature__ = signature.replace(parameters=own)  # type: ignore[attr-defined]
        return factory

    return [(f"{title} {label.replace('_', ' ')}", instance(how)) for label, how in configurations.items()]


JOINTS: list[tuple[str, Callable[[Frame, Frame], Joint]]] = [
    *several(
        "revolute", lambda a, b, **how: mbd.Revolute("joint", a, b, **how),
        plain={}, about_minus_z={"axis": (0, 0, -1)}, about_x={"axis": (1, 0, 0)}, tilted={"axis": TILTED},
        with_loss_and_spring={"loss": mbd.Viscous(0.3), "stiffness": 4.0},
    ),
    *several(
        "prismatic", lambda a, b, **how: mbd.Prismatic("joint", a, b, **how),
        plain={}, along_y={"axis": (0, 1, 0)}, tilted={"axis": TILTED},
    ),
    *several(
        "translation", lambda a, b, **how: mbd.Translation("joint", a, b, **how),
        xy={}, xyz={"axes": "xyz"}, z={"axes": "z"},
    ),
    ("planar", lambda a, b: mbd.Planar("joint", a, b)),
    *several(
        "cylindrical", lambda a, b, **how: mbd.Cylindrical("joint", a, b, **how), plain={}, tilted={"axis": TILTED}
    ),
    *several(
        "universal", lambda a, b, **how: mbd.Universal("joint", a, b, **how),
        plain={}, about_y_and_z={"axis": (0, 1, 0), "second_axis": (0, 0, 1)},
    ),
    *several(
        "screw", lambda a, b, **how: mbd.Screw("joint", a, b, **how),
        plain={"pitch": 0.2}, tilted={"pitch": -0.7, "axis": TILTED},
    ),
    ("weld", lambda a, b: mbd.Weld("joint", a, b)),
]  # fmt: skip

LOSSES: list[tuple[str, Callable[[], Loss]]] = [
    ("viscous", lambda: mbd.Viscous(0.7)),
    ("quadratic", lambda: mbd.Quadratic(0.4)),
    ("coulomb smoothed", lambda: mbd.Coulomb(2.0, smoothing=0.05)),
    ("coulomb", lambda: mbd.Coulomb(2.0)),
    ("pin friction", lambda: mbd.PinFriction(0.3, 0.02)),
    ("dry and viscous", lambda: mbd.Coulomb(2.0) + mbd.Viscous(0.7) + mbd.PinFriction(0.3, 0.02)),
    ("tabulated", lambda: mbd.Tabulated([-4.0, -1.0, 2.0, 5.0], [-9.0, -1.5, 1.0, 8.0])),
    ("dissipation of a function", lambda: mbd.Dissipation(cosh_dissipation)),
    ("viscous and quadratic", lambda: mbd.Viscous(0.7) + mbd.Quadratic(0.4)),
]


def cosh_dissipation(rate: float) -> float:
    """D(v) = cosh(v/10) − 1."""
    result: float = mbd.cosh(rate / 10.0) - 1.0
    return result


def quartic(angle: float) -> float:
    """V(q) = q⁴/4."""
    return 0.25 * angle**4


def pull(t: float, angle: float) -> tuple[float, float]:
    """A force in the plane."""
    return 3.0 * t, mbd.sin(angle)


def hill(x: float) -> float:
    """A wavy ground."""
    height: float = 0.2 * mbd.sin(x)
    return height


def dune(x: float, z: float) -> float:
    """A wavy ground in two directions."""
    height: float = 0.2 * mbd.sin(x) * mbd.cos(z)
    return height


def swell(x: float, t: float) -> float:
    """A ground that moves up and down, a wave running over it."""
    height: float = 0.1 * mbd.sin(2.0 * x - 3.0 * t)
    return height


def waves(x: float, z: float, t: float) -> float:
    """The same in two directions."""
    height: float = 0.1 * mbd.sin(2.0 * x + z - 3.0 * t) + 0.05 * t
    return height


def skid(vx: float, vy: float, angle: float) -> float:
    """Velocity across a direction."""
    row: float = vx * mbd.sin(angle) - vy * mbd.cos(angle)
    return row


SKID = ("float thigh.x.rate", "float thigh.y.rate", "float thigh.angle")


def first_of(p: Triple, q: Triple) -> Scalar:
    """The x of the first point."""
    return p[0]


SOLE = [(-0.06, 0.01), (0.0, 0.0), (0.08, 0.006), (0.16, 0.03)]
"""A sole from heel to toe."""


def egg(psi: float) -> float:
    """The support function of an egg."""
    depth: float = 0.3 + 0.02 * mbd.sin(psi) + 0.01 * mbd.cos(2.0 * psi)
    return depth


FORCES: list[tuple[str, Callable[[Frame, Frame, Joint], Force]]] = [
    ("spring", lambda a, b, joint: mbd.Spring("force", a, b, stiffness=50.0, length=0.3)),
    ("spring without length", lambda a, b, joint: mbd.Spring("force", a, b, stiffness=50.0)),
    ("damper", lambda a, b, joint: mbd.Damper("force", a, b, 3.0)),
    ("orifice damper", lambda a, b, joint: mbd.Damper("force", a, b, mbd.Quadratic(2.0))),
    ("torsion spring", lambda a, b, joint: mbd.TorsionSpring("force", joint, stiffness=7.0, rest=0.2)),
    ("constant force", lambda a, b, joint: mbd.Applied("force", a, force=(2.0, 3.0, 4.0))),
    ("constant torque", lambda a, b, joint: mbd.Applied("force", a, torque=2.0)),
    ("force by a function", lambda a, b, joint: mbd.Applied("force", a, force=pull, arguments=("t", "hinge.angle"))),
    ("sampled force", lambda a, b, joint: mbd.Applied("force", a, force=(mbd.Samples([0, 1, 3], [0, 2, 1]), 1.5))),
    (
        "force in axes of its body",
        lambda a, b, joint: mbd.Applied("force", a, force=(2.0, 3.0, 4.0), torque=(0.5, -1.0, 2.0), axes=a),
    ),
    ("motor", lambda a, b, joint: mbd.Motor("force", joint, torque=4.0)),
    ("potential", lambda a, b, joint: mbd.Potential("force", quartic, "hinge.angle")),
]

MEASURES: list[tuple[str, Callable[[Frame, Frame, Joint], Measure]]] = [
    ("touchdown", lambda a, b, joint: mbd.touchdown(a)),
    ("touchdown on a plane", lambda a, b, joint: mbd.touchdown(a, mbd.Plane((0.3, 1.0, -0.2), 0.4))),
    ("touchdown on a hill", lambda a, b, joint: mbd.touchdown(a, hill)),
    ("touchdown on dunes", lambda a, b, joint: mbd.touchdown(a, dune)),
    ("touchdown on a body", lambda a, b, joint: mbd.touchdown(a, mbd.Plane((0.3, 1.0, -0.2), 0.1, frame=b))),
    ("touchdown on a belt", lambda a, b, joint: mbd.touchdown(a, mbd.Plane(velocity=(0.4, 0.0, 0.1)))),
    ("touchdown on a swell", lambda a, b, joint: mbd.touchdown(a, swell)),
    ("touchdown on waves", lambda a, b, joint: mbd.touchdown(a, waves)),
    ("arc on the ground", lambda a, b, joint: mbd.rolling_touchdown(a, 0.3)),
    ("arc on a body", lambda a, b, joint: mbd.rolling_touchdown(a, 0.3, mbd.Plane((0.3, 1.0, 0.0), 0.1, frame=b))),
    ("sole on the ground", lambda a, b, joint: mbd.profile_touchdown(a, SOLE)),
    ("sole on a body", lambda a, b, joint: mbd.profile_touchdown(b, egg, mbd.Plane((0.3, 1.0, 0.0), frame=a))),
    ("height", lambda a, b, joint: mbd.height(a)),
    ("flexion", lambda a, b, joint: mbd.flexion(joint)),
    ("extension", lambda a, b, joint: mbd.extension(joint, offset=0.1)),
    ("distance", lambda a, b, joint: mbd.distance(a, b)),
    ("separation", lambda a, b, joint: mbd.separation(a, b, (1, 1, 0))),
    ("named measure", lambda a, b, joint: mbd.measure("hinge.angle", unit="rad")),
    ("measure of points", lambda a, b, joint: mbd.measure(lambda p, q: p[1] - 2.0 * q[0], a, b, tangents=first_of)),
]

CONSTRAINTS: list[tuple[str, Callable[[Frame, Frame, Joint], Constraint]]] = [
    ("foot that sticks", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(a))),
    ("foot that bounces", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(b), restitution=0.7, friction=0.0)),
    ("foot with friction", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(a), friction=0.4)),
    ("foot on a hill", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(b, hill))),
    ("foot on a plate", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(b, mbd.Plane(frame=a)), friction=0.0)),
    ("foot on a belt", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(b, mbd.Plane(velocity=(0.4, 0.0))))),
    ("foot on a swell", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(b, swell))),
    ("ball on a swell", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(a, swell), 0.7, friction=0.0)),
    ("round foot", lambda a, b, joint: mbd.Unilateral("law", mbd.rolling_touchdown(a, 0.3))),
    ("round foot with friction", lambda a, b, joint: mbd.Unilateral("law", mbd.rolling_touchdown(a, 0.3), friction=0.3)),
    ("sole", lambda a, b, joint: mbd.Unilateral("law", mbd.profile_touchdown(b, SOLE))),
    ("round mat", lambda a, b, joint: mbd.Penalty("law", mbd.rolling_touchdown(a, 0.3), 1e4, damping=10.0)),
    ("knee lock", lambda a, b, joint: mbd.Unilateral("law", mbd.flexion(joint))),
    ("rubber stop", lambda a, b, joint: mbd.Penalty("law", mbd.flexion(joint), stiffness=1e3, damping=2.0)),
    ("mat", lambda a, b, joint: mbd.Penalty("law", mbd.touchdown(a), 1e4, damping=10.0, release="pull")),
    ("raft", lambda a, b, joint: mbd.Penalty("law", mbd.touchdown(a, swell), 1e4, damping=10.0, release="pull")),
    ("ball", lambda a, b, joint: mbd.Penalty("law", mbd.height(a), 1e5, exponent=1.5, restitution=0.5)),
    ("rod", lambda a, b, joint: mbd.Bilateral("law", mbd.distance(a, b), value=0.6)),
    ("slot", lambda a, b, joint: mbd.Bilateral("law", mbd.separation(a, b, (1, 1, 0)))),
    ("prescribed motion", lambda a, b, joint: mbd.Bilateral("law", joint, value=lambda t: 0.3 * mbd.sin(3.0 * t))),
    ("blade", lambda a, b, joint: mbd.KnifeEdge("law", a)),
    ("nonholonomic row", lambda a, b, joint: mbd.Nonholonomic("law", skid, arguments=SKID)),
    ("rolling", lambda a, b, joint: mbd.Rolling("law", a, radius=0.3)),
    ("rolling on a belt", lambda a, b, joint: mbd.Rolling("law", a, 0.3, mbd.Plane(velocity=(0.4, 0.0)))),
]

INTEGRATORS: list[Integrator] = [
    mbd.Newmark(),
    mbd.Newmark(beta=0.31, gamma=0.6),
    mbd.Newmark(formulation="index3"),
    mbd.HHT(alpha=0.05),
    mbd.HHT(alpha=0.05, formulation="index3"),
    mbd.HHT(alpha=0.05, form="averaged"),
    mbd.GeneralizedAlpha(rho_inf=0.9),
    mbd.GeneralizedAlpha(rho_inf=0.0),
    mbd.RadauIIA(),
    mbd.RungeKutta853(),
]
