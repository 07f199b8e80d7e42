"""The lists that the law tests run over: (id, factory). A new idea adds one line here, `several` where it has settings.

JOINTS    factory(parent, child) → joint, between any two frames
LOSSES    factory() → loss
FORCES    factory(a, b, joint) → force, from two frames of different bodies and a joint named 'hinge' with an `angle`
MEASURES  factory(a, b, joint) → measure, from the same
CONSTRAINTS  factory(a, b, joint) → constraint, from the same, whose first body floats on the joint 'float thigh'
INTEGRATORS  schemes
PARTS     parts of a leg with their benches
"""

import inspect
from collections.abc import Callable
from typing import Any

import mbd
from mbd import parts
from mbd.bodies.base import Frame
from mbd.bodies.scope import Triple
from mbd.constraints.base import Constraint
from mbd.constraints.measure import Measure
from mbd.forces.base import Force
from mbd.integrators import Integrator
from mbd.joints.base import Joint
from mbd.joints.losses.base import Loss
from mbd.tape.node import Scalar
from tests.parts.benches import Part

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
    *several(
        "spherical", lambda a, b, **how: mbd.Spherical("joint", a, b, **how),
        with_loss_and_spring={"loss": {"angular_velocity.y": mbd.Quadratic(0.2)}, "stiffness": 4.0},
    ),
    *several(
        "free", lambda a, b, **how: mbd.Free("joint", a, b, **how),
        with_losses={"loss": {"y": mbd.Viscous(0.4), "angular_velocity.z": mbd.Viscous(0.3)}},
    ),
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
    ("valves", lambda: mbd.Valves(backward=mbd.Quadratic(0.8), forward=mbd.Viscous(0.2) + mbd.Quadratic(0.1))),
    ("friction that falls with speed", lambda: mbd.AffineFriction(3.0, -0.2, smoothing=0.05)),
    ("friction that grows with speed", lambda: mbd.AffineFriction(3.0, 0.2, smoothing=0.05)),
    ("stribeck", lambda: mbd.Stribeck(3.0, 2.0, 0.05)),
    ("stribeck and viscous", lambda: mbd.Stribeck(3.0, 2.0, 0.05) + mbd.Viscous(0.7)),
    ("dahl", lambda: mbd.Dahl(3.0, 400.0)),
    ("lugre", lambda: mbd.LuGre(3.0, 2.0, 0.5, 400.0, 0.8) + mbd.Viscous(0.6)),
    ("lugre whose damping falls", lambda: mbd.LuGre(3.0, 2.0, 0.5, 400.0, 0.8, damping_rate=0.1)),
    ("compressible damper", lambda: mbd.CompressibleDamper(3.0, 0.8, 400.0)),
    (
        "valves with compressible oil",
        lambda: mbd.Valves(mbd.CompressibleDamper(3.0, 0.8, 400.0), mbd.CompressibleDamper(1.0, 0.1, 400.0)),
    ),
    (
        "valves with slow oil in one direction",
        lambda: mbd.Valves(mbd.CompressibleDamper(10.0, 0.0, 400.0), mbd.CompressibleDamper(1000.0, 0.1, 400.0)),
    ),
    ("valves of dahl", lambda: mbd.Valves(mbd.Dahl(1.0, 400.0), mbd.Dahl(5.0, 200.0))),
    ("valves of lugre", lambda: mbd.Valves(mbd.LuGre(3.0, 2.0, 0.5, 4e2, 0.01), mbd.LuGre(6.0, 5.0, 0.5, 4e2, 0.01))),
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
    ("measured spring", lambda a, b, joint: mbd.TabulatedSpring("force", joint, [-0.4, 0.0, 0.3], [-30.0, 0.0, 50.0])),
    ("electric motor", lambda a, b, joint: mbd.DCMotor("force", joint, 3.0, resistance=2.0, constant=0.1)),
    ("constant force", lambda a, b, joint: mbd.Applied("force", a, force=(2.0, 3.0, 4.0))),
    ("constant torque", lambda a, b, joint: mbd.Applied("force", a, torque=2.0)),
    ("force by a function", lambda a, b, joint: mbd.Applied("force", a, force=pull, arguments=("t", "hinge.angle"))),
    ("sampled force", lambda a, b, joint: mbd.Applied("force", a, force=(mbd.Samples([0, 1, 3], [0, 2, 1]), 1.5))),
    (
        "force in axes of its body",
        lambda a, b, joint: mbd.Applied("force", a, force=(2.0, 3.0, 4.0), torque=(0.5, -1.0, 2.0), axes=a),
    ),
    ("rotor", lambda a, b, joint: mbd.Rotor("force", joint, 2e-3, ratio=9.0)),
    (
        "bushing",
        lambda a, b, joint: mbd.Bushing(
            "force", a, b, 40.0, (1.0, 2.0, 3.0), damping=(1.0, 0.5, 0.0), rotational_damping=0.2
        ),
    ),
    ("motor", lambda a, b, joint: mbd.Motor("force", joint, torque=4.0)),
    *several(
        "muscle",
        lambda a, b, joint, **how: mbd.Muscle("force", (a, b), 900.0, 0.12, 0.2, 0.3, 0.4, **how),
        elastic={},
        rigid={"tendon": "rigid"},
        activated={"activation_time": 0.0, "deactivation_time": 0.0},
    ),
    (
        "muscle by a polynomial",
        lambda a, b, joint: mbd.Muscle("force", mbd.PolynomialPath(joint, {0: 0.3, 1: -0.04}), 900.0, 0.1, 0.2),
    ),
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
    ("ball on a plane", lambda a, b, joint: mbd.sphere_touchdown(a, 0.2, mbd.Plane((0.3, 1.0, -0.2), frame=b))),
    ("ball on dunes", lambda a, b, joint: mbd.sphere_touchdown(a, 0.1, dune)),
    ("ball on a ball", lambda a, b, joint: mbd.sphere_touchdown(a, 0.2, mbd.Ball(b, 0.1))),
    ("ball in a hollow one", lambda a, b, joint: mbd.sphere_touchdown(a, 0.2, mbd.Ball(b, 3.0, hollow=True))),
    ("disk on dunes", lambda a, b, joint: mbd.disk_touchdown(a, 0.1, (0.2, 0.3, 1.0), dune)),
    ("height", lambda a, b, joint: mbd.height(a)),
    ("flexion", lambda a, b, joint: mbd.flexion(joint)),
    ("extension", lambda a, b, joint: mbd.extension(joint, offset=0.1)),
    ("cone", lambda a, b, joint: mbd.cone(joint, 1.2, (1.0, 2.0, 0.0))),
    ("twist", lambda a, b, joint: mbd.twist(joint, -0.8, (0.0, 0.0, 1.0))),
    ("distance", lambda a, b, joint: mbd.distance(a, b)),
    ("separation", lambda a, b, joint: mbd.separation(a, b, (1, 1, 0))),
    ("named measure", lambda a, b, joint: mbd.measure("hinge.angle", unit="rad")),
    ("measure of points", lambda a, b, joint: mbd.measure(lambda p, q: p[1] - 2.0 * q[0], a, b, tangents=first_of)),
]

CONSTRAINTS: list[tuple[str, Callable[[Frame, Frame, Joint], Constraint]]] = [
    ("foot that sticks", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(a))),
    ("foot that bounces", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(b), restitution=0.7, friction=0.0)),
    ("foot with friction", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(a), friction=0.4)),
    (
        "foot with viscous friction",
        lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(a), friction=mbd.Coulomb(0.3) + mbd.Viscous(0.2)),
    ),
    ("foot on a hill", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(b, hill))),
    ("foot on a plate", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(b, mbd.Plane(frame=a)), friction=0.0)),
    ("foot on a belt", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(b, mbd.Plane(velocity=(0.4, 0.0))))),
    ("foot on a swell", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(b, swell))),
    ("ball on a swell", lambda a, b, joint: mbd.Unilateral("law", mbd.touchdown(a, swell), 0.7, friction=0.0)),
    ("rolling on waves", lambda a, b, joint: mbd.Unilateral("law", mbd.sphere_touchdown(a, 0.1, waves))),
    ("slipping on dunes", lambda a, b, joint: mbd.Unilateral("law", mbd.sphere_touchdown(a, 0.1, dune), friction=0.3)),
    (
        "ball on a ball",
        lambda a, b, joint: mbd.Unilateral("law", mbd.sphere_touchdown(a, 0.2, mbd.Ball(b, 0.1)), friction=0.3),
    ),
    (
        "disk on a swell",
        lambda a, b, joint: mbd.Unilateral("law", mbd.disk_touchdown(b, 0.1, "z", swell)),
    ),
    ("round foot", lambda a, b, joint: mbd.Unilateral("law", mbd.rolling_touchdown(a, 0.3))),
    (
        "round foot with friction",
        lambda a, b, joint: mbd.Unilateral("law", mbd.rolling_touchdown(a, 0.3), friction=0.3),
    ),
    ("sole", lambda a, b, joint: mbd.Unilateral("law", mbd.profile_touchdown(b, SOLE))),
    ("round mat", lambda a, b, joint: mbd.Penalty("law", mbd.rolling_touchdown(a, 0.3), 1e4, damping=10.0)),
    ("knee lock", lambda a, b, joint: mbd.Unilateral("law", mbd.flexion(joint))),
    ("rubber stop", lambda a, b, joint: mbd.Penalty("law", mbd.flexion(joint), stiffness=1e3, damping=2.0)),
    ("viscoelastic stop", lambda a, b, joint: mbd.MaxwellStop("law", mbd.flexion(joint), 1e3, 2e3, 20.0)),
    ("hysteretic stop", lambda a, b, joint: mbd.HystereticStop("law", mbd.flexion(joint), 1e3, 0.4, 0.02)),
    ("mat", lambda a, b, joint: mbd.Penalty("law", mbd.touchdown(a), 1e4, damping=10.0, release="pull")),
    (
        "rubbing mat",
        lambda a, b, joint: mbd.Penalty("law", mbd.touchdown(a), 1e4, damping=10.0, friction=0.3, creep=0.1),
    ),
    (
        "bristles",
        lambda a, b, joint: mbd.Penalty("law", mbd.touchdown(a), 1e4, 10.0, friction=mbd.Bristles(0.3, 2e3, 40.0)),
    ),
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
    mbd.RungeKutta4(),
]

BENT = {"part.angle": (-1.5, -0.1, ""), "part.angle.rate": (-5.0, 5.0, "1/s")}
TURNED = {"part.angle": (-0.2, 0.2, ""), "part.angle.rate": (-5.0, 5.0, "1/s")}


def rubber(u: Any) -> dict[str, float]:
    """A stop in some units."""
    return {"stiffness": 1300.0 * u.Nm, "restitution": 0.4}


PARTS: list[tuple[str, Part]] = [
    ("point foot", Part("foot", lambda m, a, u: parts.point_foot(
        m, "part", a.point(0.0, -0.2 * u.m), friction=0.4), {})),
    ("arc foot", Part("foot", lambda m, a, u: parts.arc_foot(
        m, "part", a.point(0.0, 0.1 * u.m, name="arc"), 0.3 * u.m), {})),
    ("profile foot", Part("foot", lambda m, a, u: parts.profile_foot(
        m, "part", a.point(0.0, -0.2 * u.m), [(x * u.m, y * u.m) for x, y in SOLE], friction=0.5), {})),
    ("heel and toe", Part("foot", lambda m, a, u: parts.heel_and_toe(
        m, "part", a.point(-0.06 * u.m, -0.2 * u.m), a.point(0.14 * u.m, -0.2 * u.m), friction=0.6), {})),
    ("polygon foot", Part("foot", lambda m, a, u: parts.polygon_foot(
        m, "part", [a.point(x * u.m, y * u.m) for x, y in ((-0.06, -0.2), (0.14, -0.2))], friction=0.6), {})),
    ("capsule foot", Part("foot", lambda m, a, u: parts.capsule_foot(
        m, "part", a.point(-0.06 * u.m, -0.15 * u.m), a.point(0.14 * u.m, -0.15 * u.m), 0.05 * u.m,
        friction=0.6), {})),
    ("keel foot", Part("foot", lambda m, a, u: parts.keel_foot(
        m, "part", a.point(-0.06 * u.m, -0.22 * u.m), a.point(0.0, -0.2 * u.m), length=0.2 * u.m,
        stiffness=4e4 * u.N / u.m, mass=0.2 * u.kg, loss=mbd.Viscous(0.5 * u.Nm * u.s), friction=0.6), {})),
    ("locking knee", Part("knee", lambda m, a, b, u: parts.locking_knee(m, "part", a.end, b.start), BENT)),
    ("stop knee", Part("knee", lambda m, a, b, u: parts.stop_knee(m, "part", a.end, b.start, stop=rubber(u)), BENT)),
    ("friction brake knee", Part("knee", lambda m, a, b, u: parts.friction_brake_knee(
        m, "part", a.end, b.start, mu=0.4, radius=0.03 * u.m, stop=rubber(u)), BENT)),
    ("hydraulic knee", Part("knee", lambda m, a, b, u: parts.hydraulic_knee(
        m, "part", a.end, b.start, flexion=0.8 * u.inertia, extension=0.2 * u.inertia, stop=rubber(u)), BENT)),
    ("pneumatic knee", Part("knee", lambda m, a, b, u: parts.pneumatic_knee(
        m, "part", a.end, b.start, volume=6e-5 * u.m**3, swept=1.2e-5 * u.m**3, pressure=101325.0 * u.N / u.m**2,
        stop=rubber(u)), BENT)),
    ("magnetorheological knee", Part("knee", lambda m, a, b, u: parts.magnetorheological_knee(
        m, "part", a.end, b.start, torques=dict(zip(parts.PHASES, [20 * u.Nm, 5 * u.Nm, 2 * u.Nm, u.Nm], strict=True)),
        viscous=0.3 * u.Nm * u.s, foot=parts.point_foot(m, "foot", b.point(0.0, -0.1 * u.m), ground=mbd.Plane(
            offset=-0.5 * u.m), friction=0.0).name, threshold=20.0 * u.N, period=2e-3 * u.s, smoothing=0.01 / u.s,
        stop=rubber(u)), BENT)),
    ("powered knee, short-circuited", Part("knee", lambda m, a, b, u: parts.powered_knee(
        m, "part", a.end, b.start, voltage=0.0, resistance=0.3 * u.V, constant=0.03 * u.Nm, inductance=1e-3 * u.V * u.s,
        gear=50.0, rotor=1e-5 * u.inertia, mass=0.1 * u.kg, stop=rubber(u)), BENT)),
    ("four-bar knee", Part("knee", lambda m, a, b, u: parts.four_bar_knee(
        m, "part", a.end, b.start, stop={"stiffness": 2000.0, "damping": 5.0}), {
            "part front upper.angle": (0.2, 1.2, ""), "part rear lower.angle": (0.0, 0.0, ""),
            "part front upper.angle.rate": (-2.0, 2.0, "1/s"), "part rear lower.angle.rate": (0.0, 0.0, "1/s")},
        unscaled=True)),
    ("tabulated ankle", Part("ankle", lambda m, a, b, u: parts.tabulated_ankle(
        m, "part", a.end, b.origin, angle=[-0.15, 0.0, 0.1, 0.2], torque=[x * u.Nm for x in (-20.0, 0.0, 30.0, 90.0)]),
        TURNED)),
    ("bumper ankle", Part("ankle", lambda m, a, b, u: parts.bumper_ankle(
        m, "part", a.end, b.origin, heel={"stiffness": 150.0 * u.Nm, "damping": u.Nm * u.s, "release": "pull"},
        toe={"stiffness": 600.0 * u.Nm, "restitution": 0.5}, clearance=0.02), {
            "part.angle": (-0.015, 0.015, ""), "part.angle.rate": (-5.0, 5.0, "1/s")})),
    ("hydraulic ankle", Part("ankle", lambda m, a, b, u: parts.hydraulic_ankle(
        m, "part", a.end, b.origin, plantarflexion=0.2 * u.Nm * u.s, dorsiflexion=0.5 * u.Nm * u.s,
        stiffness=50.0 * u.Nm), TURNED)),
    ("series-elastic ankle, idle", Part("ankle", lambda m, a, b, u: parts.series_elastic_ankle(
        m, "part", a.end, b.origin, torque=0.0, stiffness=60.0 * u.Nm, inertia=0.02 * u.inertia, mass=0.3 * u.kg,
        motor_loss=mbd.Viscous(0.05 * u.Nm * u.s)), TURNED)),
    ("socket", Part("ankle", lambda m, a, b, u: parts.elastic_socket(
        m, "part", a.end, b.origin, stiffness=(3e3 * u.N / u.m, 6e3 * u.N / u.m, 80.0 * u.Nm),
        damping=(3.0 * u.N * u.s / u.m, 6.0 * u.N * u.s / u.m, 0.1 * u.Nm * u.s)), {"part.y": (-0.01, 0.01, "m")})),
    ("ligaments", Part("ankle", lambda m, a, b, u: parts.passive_moment(
        m, "ligaments", parts.stop_knee(m, "part", a.end, b.origin), of="ankle"), TURNED, unscaled=True)),
]  # fmt: skip
"""Each part as a user adds it, in any units: it takes energy, or keeps it."""
