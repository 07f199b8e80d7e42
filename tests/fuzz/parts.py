"""Parts of fuzzed mechanisms: bodies, frames, joints, losses, forces, contacts, events, drawn at random."""

import math
import random
from collections.abc import Callable
from typing import Any

import numpy as np

import mbd
from mbd.bodies.base import Body, Frame
from mbd.joints.base import Joint


def any_axis(rng: random.Random) -> tuple[float, float, float]:
    """A direction in space."""
    return tuple(rng.uniform(-1, 1) for _ in range(3))  # type: ignore[return-value]


def any_body(rng: random.Random, name: str, spatial: bool) -> Any:
    """A link or a rigid body, whose inertia real bodies can have."""
    a, b, c = (rng.uniform(0.05, 0.4) for _ in range(3))
    mass = rng.uniform(0.4, 2.0)
    if spatial:
        products = tuple(0.02 * rng.uniform(-1, 1) for _ in range(3))
        center = tuple(rng.uniform(-0.4, 0.4) for _ in range(3))
        return mbd.RigidBody(name, mass, (b + c, a + c, a + b, *products), center=center)
    draw = rng.random()
    if draw < 0.4:
        length = rng.uniform(0.5, 1.4)
        return mbd.Link(name, mass, length, length * rng.uniform(0.2, 0.9), a)
    return mbd.RigidBody(name, mass, a, center=(rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4), 0.0))


def any_frame(rng: random.Random, body: Any, spatial: bool) -> Frame:
    """A point of a body, or one of its own frames; some turned by anything up to a full turn."""
    if isinstance(body, mbd.Link) and rng.random() < 0.6:
        frame = rng.choice([body.start, body.end])
    else:
        frame = body.point(*(rng.uniform(-0.7, 0.7) for _ in range(2)), rng.uniform(-0.7, 0.7) if spatial else 0.0)
    if rng.random() < 0.4:
        frame = frame.turned(rng.uniform(-math.pi, math.pi), any_axis(rng) if spatial else (0.0, 0.0, 1.0))
    return frame


def smooth_loss(rng: random.Random) -> Any:
    """A loss without jumps, or none."""
    table = mbd.Tabulated([-3.0, -1.0, 0.0, 1.0, 3.0], [-0.9, -0.4, 0.0, 0.5, 0.8])
    return rng.choice(
        [None, None, mbd.Viscous(rng.uniform(0.05, 0.5)), mbd.Quadratic(rng.uniform(0.05, 0.5)), table,
         mbd.Coulomb(rng.uniform(0.1, 0.6), smoothing=rng.uniform(0.1, 0.5)), mbd.Dissipation(lambda v: 0.1 * v**4),
         mbd.Viscous(rng.uniform(0.05, 0.5)) + mbd.Quadratic(rng.uniform(0.05, 0.5))]
    )  # fmt: skip


def any_joint(rng: random.Random, name: str, a: Frame, b: Frame, spatial: bool) -> Joint:
    """A joint of any kind, some with a loss or a spring."""
    loss = smooth_loss(rng)
    elastic: dict[str, Any] = (
        {"stiffness": rng.uniform(2.0, 30.0), "rest": rng.uniform(-0.4, 0.4)} if rng.random() < 0.25 else {}
    )
    axis = any_axis(rng)
    if not spatial:
        flat = (rng.uniform(-1, 1), rng.uniform(0.2, 1), 0.0)
        makers: list[Callable[[], Joint]] = [
            lambda: mbd.Revolute(name, a, b, loss=loss, **elastic),
            lambda: mbd.Revolute(name, a, b, axis=(0.0, 0.0, -1.0), loss=loss),
            lambda: mbd.Prismatic(name, a, b, axis=flat, loss=loss, stiffness=rng.uniform(10, 60), rest=0.1),
            lambda: mbd.Translation(name, a, b, loss=None if loss is None else {"x": loss}),
            lambda: mbd.Planar(name, a, b, loss=None if loss is None else {"angle": loss}),
        ]
        return makers[rng.choices(range(5), [6, 2, 3, 1, 1])[0]]()
    second = np.cross(axis, any_axis(rng))
    makers = [
        lambda: mbd.Revolute(name, a, b, axis=axis, loss=loss, **elastic),
        lambda: mbd.Prismatic(name, a, b, axis=axis, loss=loss, stiffness=rng.uniform(10, 60), rest=0.1),
        lambda: mbd.Cylindrical(name, a, b, axis=axis, loss=None if loss is None else {"angle": loss}),
        lambda: mbd.Universal(name, a, b, axis=axis, second_axis=tuple(second), loss=loss),
        lambda: mbd.Screw(name, a, b, pitch=rng.choice([-1, 1]) * rng.uniform(0.2, 1.0), axis=axis, loss=loss),
        lambda: mbd.Translation(name, a, b, axes=rng.choice(["xyz", "xz", "y"]), loss=loss),
        lambda: mbd.Weld(name, a, b),
    ]
    return makers[rng.choices(range(7), [6, 3, 2, 3, 2, 1, 1])[0]]()


def add_loads(rng: random.Random, model: mbd.Model, spatial: bool) -> None:
    """Springs, dampers, pushes, potentials, motors: some of each."""
    moving = [body for body in model.bodies.values() if body is not model.ground]
    last = moving[-1]

    def point(body: Body) -> Frame:
        return body.point(rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5) if spatial else 0.0)

    anchor = model.ground.point(3.0, 2.5, 1.1 if spatial else 0.0)
    w, size = rng.uniform(1.0, 6.0), rng.uniform(0.5, 3.0)
    turning = last.origin if size > 1.5 and not isinstance(last, mbd.PointMass) else None
    single = [joint for joint in model.joints if len(joint.labels) == 1]
    samples = mbd.Samples([0.0, 0.11, 0.2, 0.45], [0.5, -1.0, 2.0, 0.3], kind=rng.choice(["monotone", "linear"]))
    makers: list[Callable[[], Any]] = [
        lambda: mbd.Spring("spring", anchor, point(last), rng.uniform(3.0, 40.0), length=rng.uniform(0.3, 2.0)),
        lambda: mbd.Damper("damper", anchor, point(last), mbd.Viscous(rng.uniform(0.2, 1.5)) + mbd.Quadratic(0.2)),
        lambda: mbd.Applied("push", point(last), force=lambda t, p: (size * np.sin(w * t) * p[0], size, 0.3 * t),
                            torque=(0.0, 0.0, 0.5) if not spatial else (0.3, -0.2, 0.5),
                            arguments=("t", point(moving[0])), axes=turning),
        lambda: mbd.Potential("well", lambda p: 0.5 * size * p[0] * p[0] + 0.1 * p[0] * p[1], arguments=(point(last),)),
    ]  # fmt: skip
    if single:
        joint = rng.choice(single)
        makers += [
            lambda: mbd.Motor("motor", joint, torque=lambda t: size * np.sin(w * t)),
            lambda: mbd.Motor("steady motor", joint, torque=size),
            lambda: mbd.Motor("signal motor", joint, torque=samples),
            lambda: mbd.Motor("servo", joint, torque=lambda q, v, k: -k * np.sin(q) - 0.1 * v,
                              arguments=(joint.coordinate_names[0], f"{joint.name}.rate", ("k", size))),
            lambda: mbd.TorsionSpring("torsion", joint, stiffness=rng.uniform(1.0, 15.0), rest=rng.uniform(-0.5, 7.0)),
            lambda: mbd.Potential("wave", lambda q: size * np.cos(q) + 0.05 * q * q, joint.coordinate_names[0]),
        ]  # fmt: skip
    for k in rng.sample(range(len(makers)), rng.randint(1, min(4, len(makers)))):
        model.apply(makers[k]())


def add_event(rng: random.Random, model: mbd.Model, position: dict[str, float], resets: bool) -> None:
    """An event on a coordinate near its start, some with a reset of a rate."""
    single = [joint for joint in model.joints if len(joint.labels) == 1]
    if not single:
        return
    joint = rng.choice(single)
    name = joint.coordinate_names[0]
    level = position.get(name, 0.0) + rng.uniform(-0.2, 0.2)
    guard = mbd.measure(lambda q: q - level, name, unit=joint.labels[0].unit)
    rate = f"{joint.name}.rate"
    reset: Any = None
    if resets:
        reset = rng.choice([{rate: 0.4}, lambda values: {rate: -0.7 * values[rate]}])
    model.constrain(mbd.Event("passing", guard, reset=reset, direction=rng.choice([-1, 0, 1])))


def any_contact(rng: random.Random, name: str, measure: Any, rubs: bool) -> Any:
    """A law of any kind for a foot or a stop."""
    draw = rng.random()
    if draw < 0.3:
        law, release = rng.choice([(1.0, "gap"), (1.0, "pull"), (1.5, "pull")])
        return mbd.Penalty(
            name, measure, 10.0 ** rng.uniform(2.5, 4.5), damping=rng.uniform(0.5, 20.0), exponent=law, release=release
        )
    if draw < 0.4:
        return mbd.Penalty(name, measure, 10.0 ** rng.uniform(3, 5), exponent=1.5, restitution=rng.uniform(0.2, 0.9))
    restitution = rng.choice([0.0, 0.0, 0.3, 0.7])
    if not rubs:
        return mbd.Unilateral(name, measure, restitution=restitution)
    friction = rng.choice([None, 0.0, rng.uniform(0.1, 1.2)])
    return mbd.Unilateral(name, measure, restitution=0.0 if friction is None else restitution, friction=friction)
