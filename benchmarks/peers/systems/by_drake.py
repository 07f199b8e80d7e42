"""Drake: `MultibodyPlant` with error-controlled integrators, or in discrete (SAP) mode; two of its own examples."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib.metadata import version as version_of
from typing import Any

import numpy as np
from pydrake.all import (
    DiagramBuilder,
    DiscreteContactApproximation,
    FixedOffsetFrame,
    LinearSpringDamper,
    MultibodyPlant,
    PrismaticJoint,
    PrismaticSpring,
    ResetIntegratorFromFlags,
    RevoluteJoint,
    RigidTransform,
    RotationalInertia,
    Simulator,
    SpatialInertia,
)  # fmt: skip
from pydrake.examples import CompassGait, RimlessWheel

from benchmarks.peers.race import Attempt, Outcome, Sweep, seconds
from benchmarks.peers.scenes import ANDREWS, CHAINS, COMPASS, ELASTIC, FOUR_BARS, LEG, WHEEL, G, Scene
from benchmarks.peers.systems import space_drake

AXIS = np.array([0.0, -1.0, 0.0])
GIVE_UP = 8.0
"""Seconds of processor time after which a run is given up."""


def version() -> str:
    return version_of("drake")


def _solid(mass: float, inertia: float, center: complex) -> Any:
    place = [np.real(center), 0.0, np.imag(center)]
    return SpatialInertia.MakeFromCentralInertia(mass, place, RotationalInertia(inertia, inertia, inertia))


def _shift(at: complex) -> Any:
    return RigidTransform([float(np.real(at)), 0.0, float(np.imag(at))])


class Plant:
    """A plant to be filled; `h` = 0 is continuous."""

    def __init__(self, h: float = 0.0, gravity: float = G) -> None:
        self.builder, self.gravity = DiagramBuilder(), gravity
        self.plant = self.builder.AddSystem(MultibodyPlant(time_step=h))
        if h:
            self.plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
        self.joints: list[Any] = []

    def body(
        self, parent: Any, at: complex, mass: float, inertia: float, center: complex, turn: float = 1.0,
        damping: float = 0.0, limits: tuple[float, float] = (-np.inf, np.inf),
    ) -> Any:  # fmt: skip
        """A body on a hinge; `parent` None is the ground."""
        name = f"b{len(self.joints)}"
        body = self.plant.AddRigidBody(name, _solid(mass, inertia, center))
        base = self.plant.world_frame() if parent is None else parent.body_frame()
        frame = self.plant.AddFrame(FixedOffsetFrame(f"f{name}", base, _shift(at)))
        joint = RevoluteJoint(f"j{name}", frame, body.body_frame(), turn * AXIS, *limits, damping)
        self.joints.append(self.plant.AddJoint(joint))
        return body

    def run(
        self, scene: Scene, q: Any, read: Callable[[Any], Any], scheme: str = "", accuracy: float = 0.0,
        step: float = 0.0, v: Any = None, torque: float | None = None,
    ) -> Outcome:  # fmt: skip
        """Advance from output time to output time; q and v in the order of `joints`."""
        self.plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -self.gravity])
        self.plant.Finalize()
        simulator = Simulator(self.builder.Build())
        context = self.plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        order = [joint.position_start() for joint in self.joints]
        places = np.argsort(order)
        self.plant.SetPositions(context, np.asarray(q, dtype=float)[places])
        if v is not None:
            self.plant.SetVelocities(context, np.asarray(v, dtype=float)[places])
        if torque is not None:
            self.plant.get_actuation_input_port().FixValue(context, [torque])
        if scheme:
            _integrate_by(simulator, scheme, accuracy, step)
        simulator.Initialize()
        rows, spent = _advance(simulator, scene, lambda: self.plant.GetPositions(context).copy())
        taken = (
            simulator.get_integrator().get_num_steps_taken() if scheme else round(scene.until / self.plant.time_step())
        )
        return Outcome(read(rows[:, order]), spent, taken)


def _integrate_by(simulator: Any, scheme: str, accuracy: float, step: float) -> None:
    ResetIntegratorFromFlags(simulator, scheme, step or 0.1)
    integrator = simulator.get_mutable_integrator()
    if accuracy:
        integrator.set_target_accuracy(accuracy)
        integrator.set_maximum_step_size(0.1)
    else:
        integrator.set_fixed_step_mode(True)


def _advance(simulator: Any, scene: Scene, state: Callable[[], Any]) -> tuple[Any, float]:
    """States at the scene's times, and the time spent."""
    rows, spent = [state()], 0.0
    for t in scene.times[1:]:
        spent += seconds(partial(simulator.AdvanceTo, t))
        rows.append(state())
        if spent > GIVE_UP:
            raise RuntimeError(f"given up at t = {t:.3g} s after {GIVE_UP:g} s")
    return np.array(rows), spent


def _summed(rows: Any) -> Any:
    return np.cumsum(rows, axis=1)


def _chain(scene: Scene, h: float = 0.0, **words: Any) -> Outcome:
    p, plant, above = CHAINS[scene.name], Plant(h), None
    for k in range(p.n):
        at = -1j * p.length if k else 0.0
        above = plant.body(above, at, p.mass, p.mass * p.length**2 / 12.0, -0.5j * p.length, damping=p.damping)
    return plant.run(scene, np.diff(p.angles, prepend=0.0), _summed, **words)


def _four_bars(scene: Scene, h: float) -> Outcome:
    p, plant = FOUR_BARS[scene.name], Plant(h)
    inertia, length, rate = p.mass * p.length**2 / 12.0, p.length, p.speed / p.length
    posts = [plant.body(None, k * length, p.mass, inertia, 0.5j * length, -1.0) for k in range(p.n + 1)]
    bars = [plant.body(post, 1j * length, p.mass, inertia, 0.5 * length, -1.0) for post in posts[:-1]]
    for bar, post in zip(bars, posts[1:], strict=True):
        plant.plant.AddBallConstraint(bar, [length, 0.0, 0.0], post, [0.0, 0.0, length])
    v = [rate] * len(posts) + [-rate] * len(bars)
    return plant.run(scene, np.zeros(len(v)), lambda rows: rows[:, :1], v=v)


def _andrews(scene: Scene, h: float) -> Outcome:
    """Bodies in the order K1 K2 K3 K5 K4 K7 K6."""
    p, plant = ANDREWS, Plant(h, gravity=0.0)

    def add(k: int, parent: Any, at: complex, center: complex) -> Any:
        return plant.body(parent, at, p.masses[k - 1], p.inertias[k - 1], center)

    k1 = add(1, None, 0.0, p.ra)
    k2 = add(2, k1, p.rr, -p.da)
    k3 = add(3, None, p.B, p.sb - 1j * p.sa)
    k5 = add(5, None, p.A, p.ta + 1j * p.tb)
    k4 = add(4, k5, p.zt, -1j * (p.e - p.ea))
    k7 = add(7, None, p.A, p.ub - 1j * p.ua)
    k6 = add(6, k7, -1j * p.u, p.zf - p.fa)
    plant.plant.AddJointActuator("drive", plant.joints[0])
    for body, end in ((k3, [0.0, 0.0, -p.ss]), (k4, [0.0, 0.0, -p.e]), (k6, [p.zf, 0.0, 0.0])):
        plant.plant.AddBallConstraint(k2, [-p.d, 0.0, 0.0], body, end)
    fixed = [p.C.real, 0.0, p.C.imag]
    spring = LinearSpringDamper(k3, [p.sd, 0.0, -p.sc], plant.plant.world_body(), fixed, p.rest, p.stiffness, 0.0)
    plant.plant.AddForceElement(spring)
    order = [0, 1, 2, 4, 3, 6, 5]
    return plant.run(scene, np.array(p.start)[order], lambda rows: rows[:, order], torque=p.torque)


def _elastic(scene: Scene, h: float = 0.0, **words: Any) -> Outcome:
    p, plant = ELASTIC, Plant(h)
    arm = plant.plant.AddRigidBody("arm", SpatialInertia.Zero())
    bob = plant.plant.AddRigidBody("bob", _solid(p.mass, p.inertia, -1j * p.length))
    hinge = plant.plant.AddJoint(RevoluteJoint("hinge", plant.plant.world_frame(), arm.body_frame(), AXIS))
    down = [0.0, 0.0, -1.0]
    slide = plant.plant.AddJoint(PrismaticJoint("slide", arm.body_frame(), bob.body_frame(), down, damping=p.damping))
    plant.plant.AddForceElement(PrismaticSpring(slide, 0.0, p.stiffness))
    plant.joints += [hinge, slide]
    return plant.run(scene, [p.angle, 0.0], lambda rows: rows, **words)


def _leg(scene: Scene, h: float) -> Outcome:
    p, plant = LEG, Plant(h)
    thigh = plant.body(None, 0.0, p.thigh_mass, p.thigh_mass * p.thigh**2 / 12.0, -0.5j * p.thigh)
    inertia = p.shank_mass * p.shank**2 / 12.0
    plant.body(thigh, -1j * p.thigh, p.shank_mass, inertia, -0.5j * p.shank, limits=(-10.0, 0.0))
    return plant.run(scene, [p.angles[0], p.angles[1] - p.angles[0]], _summed)


def _built_in(scene: Scene, system: Any, numbers: dict[str, float], start: Any, accuracy: float) -> Outcome:
    """One of Drake's example systems, by the numbers of its parameters."""
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    parameters, state = context.get_mutable_numeric_parameter(0), context.get_mutable_continuous_state_vector()
    for name, value in numbers.items():
        getattr(parameters, f"set_{name}")(value)
    for place, value in enumerate(start):
        state.SetAtIndex(place, value)
    context.SetAccuracy(accuracy)
    simulator.get_mutable_integrator().set_target_accuracy(accuracy)
    for port in range(system.num_input_ports()):
        system.get_input_port(port).FixValue(context, [0.0])
    simulator.Initialize()
    rows, spent = _advance(simulator, scene, lambda: [state.GetAtIndex(k) for k in range(len(start))])
    return Outcome(rows, spent, simulator.get_num_steps_taken())


def _wheel(scene: Scene, accuracy: float) -> Outcome:
    p = WHEEL[scene.name]
    numbers = {"mass": p.mass, "length": p.length, "gravity": G, "number_of_spokes": p.spokes, "slope": p.slope}
    return _built_in(scene, RimlessWheel(), numbers, (p.slope - np.pi / p.spokes, p.speed), accuracy)


def _gait(scene: Scene, accuracy: float) -> Outcome:
    p = COMPASS
    numbers = {
        "mass_hip": p.hip, "mass_leg": p.leg, "length_leg": p.length, "center_of_mass_leg": p.center, "gravity": G,
        "slope": p.slope,
    }  # fmt: skip
    return _built_in(scene, CompassGait(), numbers, p.start, accuracy)


def attempts(scene: Scene) -> list[Sweep]:
    if scene.family == "S7":
        return space_drake.attempts(scene)

    def controlled(make: Any, scheme: str, *accuracies: float) -> Sweep:
        return [
            Attempt(f"{scheme} accuracy={a:g}", partial(make, scene, scheme=scheme, accuracy=a)) for a in accuracies
        ]

    def discrete(make: Any, *steps: float) -> Sweep:
        return [Attempt(f"discrete h={h:g}", partial(make, scene, h)) for h in steps]

    def example(name: str, make: Any) -> Sweep:
        accuracies = (1e-3, 1e-6, 1e-9, 1e-11)
        return [Attempt(f"its own {name}, accuracy={a:g}", partial(make, scene, a)) for a in accuracies]

    if scene.family in ("S1", "S1d"):
        fixed = [
            Attempt(f"runge_kutta5 h={h:g}", partial(_chain, scene, scheme="runge_kutta5", step=h))
            for h in (0.01, 0.001)
        ]
        rk3, rk5 = ("runge_kutta3", 1e-3, 1e-5, 1e-7, 1e-9), ("runge_kutta5", 1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
        return [controlled(_chain, *rk3), controlled(_chain, *rk5), fixed, discrete(_chain, 0.01, 0.001, 1e-4)]
    if scene.family == "S2":
        return [controlled(_chain, "runge_kutta5", 1e-2, 1e-4, 1e-6, 1e-9)]
    if scene.family == "S3a":
        return [discrete(_four_bars, 0.005, 0.001, 2e-4)]
    if scene.name == "S5":
        return [
            controlled(_elastic, "radau3", 1e-3, 1e-4), controlled(_elastic, "runge_kutta5", 1e-3, 1e-6, 1e-9),
            controlled(_elastic, "implicit_euler", 1e-2, 1e-4),
        ]  # fmt: skip
    sweeps = {
        "S3b": discrete(_andrews, 1e-4, 1e-5, 1e-6), "S4b_point": example("RimlessWheel", _wheel),
        "S4c": discrete(_leg, 1e-3, 1e-4, 1e-5), "S4d": example("CompassGait", _gait),
    }  # fmt: skip
    return [sweeps[scene.name]] if scene.name in sweeps else []


def first_step(scene: Scene) -> None:
    """A plant, and one step."""
    _chain(scene, scheme="runge_kutta5", step=scene.every)
