"""Random mechanisms, each made from a seed: trees with any joints, planar loops, scenes with contacts and losses."""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mbd
from mbd.bodies.base import Frame
from mbd.bodies.ground import Ground
from mbd.joints.base import Joint


def random_body(rng: random.Random, name: str, spatial: bool) -> mbd.RigidBody:
    """A body with a center off its origin and an inertia that a real body can have."""
    a, b, c = (rng.uniform(0.1, 1.0) for _ in range(3))
    inertia = (b + c, a + c, a + b, 0.05 * rng.uniform(-1, 1), 0.05 * rng.uniform(-1, 1), 0.05 * rng.uniform(-1, 1))
    center = (rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5) if spatial else 0.0)
    return mbd.RigidBody(name, mass=rng.uniform(0.5, 2.0), inertia=inertia if spatial else a, center=center)


def random_frame(rng: random.Random, body: mbd.RigidBody | Ground, spatial: bool, turned: float) -> Frame:
    """A point of a body, sometimes with turned axes."""
    frame = body.point(rng.uniform(-0.6, 0.6), rng.uniform(-0.6, 0.6), rng.uniform(-0.6, 0.6) if spatial else 0.0)
    if rng.random() < turned:
        axis = [rng.uniform(-1, 1) for _ in range(3)] if spatial else (0.0, 0.0, 1.0)
        frame = frame.turned(rng.uniform(-1, 1), axis)
    return frame


def random_joint(rng: random.Random, name: str, a: Frame, b: Frame, spatial: bool) -> Joint:
    """A joint of any kind."""
    if not spatial:
        kinds: list[Callable[[], Joint]] = [
            lambda: mbd.Revolute(name, a, b),
            lambda: mbd.Prismatic(name, a, b, axis=(0.6, 0.8, 0.0)),
            lambda: mbd.Translation(name, a, b),
            lambda: mbd.Planar(name, a, b),
        ]
    else:
        axis = (rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1))
        kinds = [
            lambda: mbd.Revolute(name, a, b, axis=axis),
            lambda: mbd.Prismatic(name, a, b, axis=axis),
            lambda: mbd.Cylindrical(name, a, b),
            lambda: mbd.Universal(name, a, b),
            lambda: mbd.Screw(name, a, b, pitch=0.3, axis=axis),
            lambda: mbd.Translation(name, a, b, axes="xyz"),
        ]
    return rng.choice(kinds)()


def random_tree(seed: int, bodies: int, spatial: bool, most: int = 6, turned: float = 0.5) -> mbd.Model:
    """A tree of bodies with random joints, some described from the far side; at most `most` coordinates.

    turned : share of frames with axes of their own
    """
    rng = random.Random(seed)
    gravity = [rng.uniform(-10, 10) for _ in range(3)] if spatial else (rng.uniform(-3, 3), -9.81, 0.0)
    model = mbd.Model("random tree", gravity=gravity)
    known: list[Any] = [model.ground]
    coordinates = 0
    for k in range(bodies):
        body, onto = random_body(rng, f"body {k}", spatial), rng.choice(known)
        a, b = random_frame(rng, onto, spatial, turned), random_frame(rng, body, spatial, turned)
        if rng.random() < 0.4:
            a, b = b, a
        joint = random_joint(rng, f"joint {k}", a, b, spatial)
        if coordinates + len(joint.labels) > most:
            joint = mbd.Revolute(f"joint {k}", a, b)
        if coordinates + 1 > most:
            break
        coordinates += len(joint.labels)
        model.connect(joint)
        known.append(body)
    return model


def random_loop(seed: int, bars: int = 3) -> tuple[mbd.Model, dict[str, float]]:
    """A planar loop of bars hinged to each other and to the ground, and the angles of its hinges where it is closed.

    The hinges are corners of a random polygon, so the loop closes there to round-off. Some hinges have losses.
    """
    rng = random.Random(seed)
    turn = rng.uniform(-math.pi, math.pi)
    gaps = [rng.uniform(0.5, 1.5) for _ in range(bars + 1)]
    corners: list[tuple[float, float]] = []
    for gap in gaps:
        turn += 2.0 * math.pi * gap / sum(gaps)
        size = rng.uniform(0.5, 1.5)
        corners.append((size * math.cos(turn), size * math.sin(turn)))
    model = mbd.Model(f"random loop {seed}", gravity=(rng.uniform(-3, 3), -9.81, 0.0))
    angles, before = {}, 0.0
    end: Frame = model.ground.point(*corners[0])
    for k in range(bars):
        (x0, y0), (x1, y1) = corners[k], corners[k + 1]
        length = math.hypot(x1 - x0, y1 - y0)
        bar = mbd.Link(
            f"bar {k}", rng.uniform(0.5, 2.0), length, length * rng.uniform(0.2, 0.8), rng.uniform(0.05, 0.3)
        )
        loss = rng.choice([None, mbd.Viscous(rng.uniform(0.05, 0.5)), mbd.Quadratic(rng.uniform(0.05, 0.5))])
        model.connect(mbd.Revolute(f"hinge {k}", end, bar.start, loss=loss))
        heading = math.atan2(x1 - x0, y0 - y1)  # a bar lies along −y of its own frame
        angles[f"hinge {k}.angle"] = math.remainder(heading - before, 2.0 * math.pi)
        end, before = bar.end, heading
    model.connect(mbd.Revolute(f"hinge {bars}", end, model.ground.point(*corners[-1])))
    angles[f"hinge {bars}.angle"] = math.remainder(-before, 2.0 * math.pi)
    return model, angles


def random_scene(seed: int, bodies: int = 3) -> mbd.Model:
    """A planar tree over the ground with feet, bumpers, stops, losses and springs, all contacts open at the start.

    Feet stick, slide, rub or bounce; bumpers are penalties; stops limit joints of one coordinate.
    """
    rng = random.Random(seed)
    model = random_tree(seed, bodies, spatial=False, turned=0.2)
    for place, joint in enumerate(model.joints):
        if isinstance(joint, mbd.Revolute | mbd.Prismatic):
            loss = rng.choice(
                [None, mbd.Viscous(0.3), mbd.Quadratic(0.2), mbd.Coulomb(0.5, smoothing=0.1), mbd.Coulomb(0.5)]
            )
            stiffness = rng.choice([0.0, rng.uniform(1.0, 30.0)])
            model.joints[place] = replace(joint, loss=loss, stiffness=stiffness)
    stopped = [joint for joint in model.joints if len(joint.labels) == 1]
    for joint in rng.sample(stopped, rng.randint(0, len(stopped))):
        limit = rng.uniform(0.3, 1.0)
        if rng.random() < 0.5:
            stop: mbd.Unilateral | mbd.Penalty = mbd.Unilateral(
                f"{joint.name} stop", mbd.extension(joint, -limit), restitution=rng.choice([0.0, 0.5, 1.0])
            )
        else:
            stop = mbd.Penalty(f"{joint.name} stop", mbd.flexion(joint, -limit), 10.0 ** rng.uniform(2, 5), damping=1.0)
        model.constrain(stop)
    for body in [body for body in model.bodies.values() if body is not model.ground]:
        ground = mbd.Plane((0.0, 1.0, 0.0), -rng.uniform(2.5, 4.0))
        foot = mbd.touchdown(body.point(rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5)), ground)
        kinds: list[Any] = [
            lambda name, foot=foot: mbd.Unilateral(name, foot),
            lambda name, foot=foot: mbd.Unilateral(name, foot, restitution=0.6, friction=0.0),
            lambda name, foot=foot: mbd.Unilateral(name, foot, restitution=0.3, friction=0.4),
            lambda name, foot=foot: mbd.Penalty(name, foot, stiffness=1e4, damping=20.0, release="pull"),
        ]
        model.constrain(rng.choice(kinds)(f"{body.name} foot"))
    return model
