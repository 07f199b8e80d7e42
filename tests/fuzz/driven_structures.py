"""Mechanisms of fuzzed scenes that are driven, held, at rest, balanced or aligned, and feet on curved ground."""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

import mbd
from tests.fuzz.motions import any_jump, any_motion
from tests.fuzz.parts import add_loads, any_body, any_frame, any_joint
from tests.fuzz.spatial_structures import free_tree
from tests.fuzz.tree_poses import pose

Made = tuple[mbd.Model, dict[str, Any]]


def _chain(rng: random.Random, bodies: int, spatial: bool) -> Made:
    """A tree of joints with one coordinate, mostly, and a pose of it."""
    gravity: Any = rng.choice([(0.0, 0.0, 0.0), (0.0, -9.81, 0.0), (rng.uniform(-3, 3), -9.81, 0.0)])
    model = mbd.Model("driven chain", gravity=gravity)
    known: list[Any] = [model.ground]
    position: dict[str, Any] = {}
    for k in range(bodies):
        body, onto = any_body(rng, f"body {k}", spatial), rng.choice(known)
        a, b = any_frame(rng, onto, spatial), any_frame(rng, body, spatial)
        joint = any_joint(rng, f"joint {k}", a, b, spatial)
        if len(joint.labels) != 1:
            joint = mbd.Revolute(f"joint {k}", a, b)
        model.connect(joint)
        known.append(body)
        position[joint.coordinate_names[0]] = rng.uniform(-1.5, 1.5) if joint.labels[0].unit == "rad" else 0.3
    return model, position


def _drive(rng: random.Random, model: mbd.Model, joints: list[Any], position: dict[str, Any]) -> None:
    """Prescribe motions of joints."""
    for joint in joints:
        name = joint.coordinate_names[0]
        size = rng.uniform(0.05, 0.6) if joint.labels[0].unit == "rad" else rng.uniform(0.02, 0.2)
        value, _ = any_motion(rng, position[name], size)
        model.constrain(mbd.Bilateral(f"{joint.name} drive", joint, value=value))


def _driven_tree(rng: random.Random) -> Made:
    """All joints of a tree are driven, or some."""
    model, position = _chain(rng, rng.randint(1, 3), rng.random() < 0.4)
    joints = [joint for joint in model.joints if len(joint.labels) == 1]
    _drive(rng, model, rng.sample(joints, rng.choice([len(joints), rng.randint(1, len(joints))])), position)
    if rng.random() < 0.4:
        add_loads(rng, model, any(not joint.is_planar for joint in model.joints))
    return model, position


def _linkage(rng: random.Random) -> Made:
    """A slider-crank, or a four-bar that turns around, whose crank is driven."""
    model = mbd.Model("driven linkage", gravity=rng.choice([(0.0, 0.0, 0.0), (0.0, -9.81, 0.0)]))
    a, b = rng.uniform(0.1, 0.3), rng.uniform(0.5, 0.9)
    angle = rng.choice([0.0, 0.5 * math.pi, rng.uniform(-3, 3), math.pi])
    crank = mbd.Link("crank", rng.uniform(0.3, 2.0), a, rng.choice([0.0, 0.5]) * a, rng.uniform(0.001, 0.05))
    rod = mbd.Link("rod", rng.uniform(0.3, 2.0), b, 0.5 * b, rng.uniform(0.005, 0.05))
    main = mbd.Revolute("main", model.ground.origin, crank.start)
    pin = mbd.Revolute("pin", crank.end, rod.start)
    model.connect(main, pin)
    tip = a * np.array([math.sin(angle), -math.cos(angle)])
    if rng.random() < 0.5:  # the slider runs along x through the crank's center
        heading = math.atan2(math.sqrt(b * b - tip[1] ** 2), tip[1])
        slider = mbd.PointMass("slider", rng.uniform(0.2, 2.0))
        model.connect(mbd.Revolute("wrist", rod.end, slider.origin))
        model.connect(mbd.Prismatic("rail", model.ground.origin, slider.origin, axis=(1.0, 0.0, 0.0)))
        place = {"wrist.angle": -heading, "rail.displacement": float(tip[0]) + b * math.sin(heading)}
    else:
        c, far = rng.uniform(0.5, 0.8), np.array([rng.uniform(0.6, 0.8), 0.0])
        across = far - tip
        length = float(np.linalg.norm(across))
        bend = math.acos(max(-1.0, min(1.0, (b * b + length**2 - c * c) / (2.0 * b * length))))
        way = math.atan2(across[1], across[0]) + bend
        knee = tip + b * np.array([math.cos(way), math.sin(way)])
        heading = way + 0.5 * math.pi
        rocker = mbd.Link("rocker", rng.uniform(0.3, 2.0), c, 0.5 * c, 0.02)
        swung = math.atan2(knee[0] - far[0], -(knee[1] - far[1]))
        model.connect(mbd.Revolute("base", model.ground.point(float(far[0]), float(far[1])), rocker.start))
        model.connect(mbd.Revolute("knee", rod.end, rocker.end))
        place = {"base.angle": swung, "knee.angle": swung - heading}
    position = {"main.angle": angle, "pin.angle": math.remainder(heading - angle, 2.0 * math.pi), **place}
    _drive(rng, model, [main], position)
    return model, position


def _in_time(rng: random.Random) -> Made:
    """A tree under motors and pushes that jump in time, or follow tables."""
    model, position = _chain(rng, rng.randint(1, 3), rng.random() < 0.4)
    for k, joint in enumerate(rng.sample(model.joints, rng.randint(1, len(model.joints)))):
        if rng.random() < 0.5:
            torque: Any = any_jump(rng, rng.uniform(0.5, 4.0))
        else:
            torque = any_motion(rng, 0.0, rng.uniform(0.5, 4.0))[0]
        model.apply(mbd.Motor(f"motor {k}", joint, torque=torque))
    return model, position


def _hilly(rng: random.Random) -> Made:
    """Feet over curved ground, which stick, rub or slide: masses, or a body with two feet."""
    model = mbd.Model("hills")
    wave, size = rng.uniform(1.0, 4.0), rng.uniform(0.05, 0.3)
    spatial = rng.random() < 0.5
    hill: Any = lambda x: size * np.sin(wave * x)  # noqa: E731
    if spatial:
        hill = lambda x, z: size * np.sin(wave * x) * np.cos(0.7 * wave * z)  # noqa: E731
    position: dict[str, Any] = {}
    feet: list[Any] = []
    for k in range(rng.randint(1, 2)):
        x, y = 1.5 * k + rng.uniform(-0.3, 0.3), size + rng.uniform(0.02, 0.3)
        if spatial:
            ball = mbd.PointMass(f"mass {k}", rng.uniform(0.5, 2.0))
            model.connect(mbd.Translation(f"flight {k}", model.ground.origin, ball.origin, axes="xyz"))
            position |= {f"flight {k}.x": x, f"flight {k}.y": y, f"flight {k}.z": rng.uniform(-0.5, 0.5)}
            feet.append(ball.origin)
        else:
            body = mbd.RigidBody(f"body {k}", rng.uniform(0.5, 2.0), rng.uniform(0.02, 0.2))
            model.connect(mbd.Planar(f"flight {k}", model.ground.origin, body.origin))
            position |= {f"flight {k}.x": x, f"flight {k}.y": y + 0.3, f"flight {k}.angle": rng.uniform(-0.2, 0.2)}
            feet += [body.point(-0.2, -0.1), body.point(0.25, -0.1)][: rng.randint(1, 2)]
    for k, foot in enumerate(feet):
        friction: Any = rng.choice([None, None, 0.0, rng.uniform(0.2, 1.0)])
        bounce = rng.choice([0.0, 0.0, 0.4]) if friction == 0.0 else 0.0
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(foot, hill), friction=friction, restitution=bounce))
    return model, position


def _zeros(rng: random.Random) -> Made:
    """Exact zeros: balanced wheels and cranks, aligned chains, no gravity, straight slides, boxes that rest."""
    model = mbd.Model("zeros", gravity=rng.choice([(0.0, 0.0, 0.0), (0.0, -9.81, 0.0)]))
    draw = rng.randrange(5)
    position: dict[str, Any] = {}
    if draw == 0:  # a shaft of balanced wheels over universal joints, aligned
        end = model.ground.origin
        for k in range(rng.randint(1, 3)):
            wheel = mbd.RigidBody(f"wheel {k}", 1.0, (0.02, 0.02, 0.04))
            bend = rng.choice([0.0, 0.0, 0.3])
            if k == 0:
                joint: Any = mbd.Revolute("joint 0", end, wheel.origin)
            else:
                joint = mbd.Universal(f"joint {k}", end, wheel.origin, axis=(1, 0, 0), second_axis=(0, 1, 0))
            model.connect(joint)
            for place, label in enumerate(joint.labels):
                position[f"{joint.name}.{label.name}"] = bend if place == 0 and k else 0.0
            end = wheel.origin
        _drive(rng, model, model.joints[:1], position)
    elif draw == 1:  # a chain that hangs straight, or lies along x
        end = model.ground.origin
        for k in range(rng.randint(1, 4)):
            link = mbd.Link(f"link {k}", 1.0, 0.5, rng.choice([0.0, 0.25, 0.5]), 0.02)
            model.connect(mbd.Revolute(f"joint {k}", end, link.start, loss=rng.choice([None, mbd.Coulomb(0.1)])))
            position[f"joint {k}.angle"] = rng.choice([0.0, 0.0, 0.5 * math.pi])
            end = link.end
        if rng.random() < 0.6:
            _drive(rng, model, rng.sample(model.joints, rng.randint(1, len(model.joints))), position)
    elif draw == 2:  # a block that slides straight on the ground, or rests
        block = mbd.PointMass("block", rng.uniform(0.5, 2.0))
        model.connect(mbd.Translation("slide", model.ground.origin, block.origin, axes="xyz"))
        position = {"slide.x": 0.0, "slide.y": rng.choice([0.0, 0.05]), "slide.z": 0.0}
        belt = rng.choice([(0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 0.0, -0.7)])
        plane = mbd.Plane((0.0, 1.0, 0.0), 0.0, velocity=belt)
        mu = rng.choice([0.3, 0.0, 0.8])
        model.constrain(mbd.Unilateral("floor", mbd.touchdown(block.origin, plane), friction=mu))
    elif draw == 3:  # a ball that rolls, slides or rests
        r = rng.uniform(0.1, 0.3)
        ball = mbd.RigidBody("ball", 1.0, (0.4 * r * r, 0.4 * r * r, 0.4 * r * r))
        model.connect(mbd.Free("float", model.ground.origin, ball.origin))
        position = {"float.x": 0.0, "float.y": r + rng.choice([0.0, 0.02]), "float.z": 0.0}
        position["float.orientation"] = (1.0, 0.0, 0.0, 0.0)
        touch = mbd.sphere_touchdown(ball.origin, r, mbd.Plane((0.0, 1.0, 0.0), 0.0))
        model.constrain(mbd.Unilateral("floor", touch, friction=rng.choice([None, 0.0, 0.4])))
    else:  # a balanced cross on a hinge, which a drive turns
        cross = mbd.RigidBody("cross", 2.0, 0.3)
        arm = mbd.Link("arm", 0.0 if rng.random() < 0.2 else 0.5, 0.4, 0.0, 0.01)
        model.connect(mbd.Revolute("hinge", model.ground.origin, cross.origin))
        model.connect(mbd.Revolute("elbow", cross.point(0.5, 0.0), arm.start))
        position = {"hinge.angle": 0.0, "elbow.angle": 0.0}
        _drive(rng, model, rng.sample(model.joints, rng.randint(1, 2)), position)
    return model, position


def _stribeck(rng: random.Random) -> Made:
    """Dry friction that falls as sliding sets in: in joints, on belts, on a driven table."""
    static = rng.uniform(0.2, 1.0)
    law = mbd.Stribeck(static, static * rng.uniform(0.3, 1.0), rng.uniform(0.02, 0.5))
    if rng.random() < 0.4:
        model, position = _chain(rng, rng.randint(1, 2), False)
        for place, joint in enumerate(model.joints):
            loss: Any = rng.choice([law, law + mbd.Viscous(0.1)])
            model.joints[place] = replace(joint, loss=loss)  # type: ignore[type-var]
        if rng.random() < 0.5:
            model.apply(mbd.Motor("motor", model.joints[0], torque=any_motion(rng, 0.0, rng.uniform(0.5, 3.0))[0]))
        return model, position
    model = mbd.Model("table")
    table, block = mbd.PointMass("table", 3.0), mbd.PointMass("block", rng.uniform(0.5, 2.0))
    rail = mbd.Prismatic("rail", model.ground.origin, table.origin, axis=(1.0, 0.0, 0.0))
    model.connect(rail)
    axes = rng.choice(["xy", "xyz"])
    model.connect(mbd.Translation("flight", model.ground.origin, block.origin, axes=axes))
    position = {"rail.displacement": 0.0, "flight.x": 0.0, "flight.y": 0.0}
    if axes == "xyz":
        position["flight.z"] = 0.0
    _drive(rng, model, [rail], position)
    plane = mbd.Plane((0.0, 1.0, 0.0), 0.0, frame=table.origin)
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(block.origin, plane), friction=law))
    return model, position


def _watched(rng: random.Random) -> Made:
    """Masses that strike a floor or a stop whose gap an event watches, too."""
    model = mbd.Model("watched", gravity=(rng.uniform(-2, 2), -9.81, 0.0))
    position: dict[str, Any] = {}
    for k in range(rng.randint(1, 2)):
        body = mbd.PointMass(f"mass {k}", rng.uniform(0.5, 2.0))
        model.connect(mbd.Translation(f"flight {k}", model.ground.origin, body.origin))
        position |= {f"flight {k}.x": 1.5 * k, f"flight {k}.y": rng.uniform(0.02, 0.4)}
        measure = mbd.touchdown(body.origin)
        law: Any = mbd.Unilateral(f"foot {k}", measure, restitution=rng.choice([0.0, 0.5, 0.8]), friction=0.0)
        if rng.random() < 0.3:
            law = mbd.Penalty(f"foot {k}", measure, 10.0 ** rng.uniform(3, 5), damping=rng.uniform(0.0, 20.0))
        model.constrain(law)
        model.constrain(mbd.Event(f"seen {k}", measure, direction=rng.choice([-1, 0])))
    return model, position


def _free_driven(rng: random.Random) -> Made:
    """A tree with joints that turn freely, some of whose simple joints are driven."""
    model, position = free_tree(rng, rng.randint(2, 3))
    single = [joint for joint in model.joints if len(joint.labels) == 1]
    _drive(rng, model, single, position)
    bodies = [body for body in model.bodies.values() if body is not model.ground]
    pose(model, position)
    if rng.random() < 0.5:
        push = any_jump(rng, rng.uniform(0.5, 3.0))
        model.apply(mbd.Applied("push", bodies[-1].origin, force=(push, 0.0, 0.0), arguments=("t",)))
    return model, position


DRIVEN_KINDS: dict[str, tuple[Callable[[random.Random], Made], bool]] = {
    "driven tree": (_driven_tree, True),
    "driven linkage": (_linkage, True),
    "forces in time": (_in_time, False),
    "hills": (_hilly, False),
    "zeros": (_zeros, True),
    "stribeck": (_stribeck, True),
    "watched contacts": (_watched, False),
    "driven in space": (_free_driven, True),
}
"""By name: what makes it, and whether rows tie its coordinates together."""
