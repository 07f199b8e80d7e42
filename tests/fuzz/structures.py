"""Mechanisms of fuzzed scenes: each is made from a number, and many scenes share one with other values."""

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

import mbd
from mbd.joints.base import Joint
from tests.fuzz.driven_structures import DRIVEN_KINDS
from tests.fuzz.parts import (
    add_event,
    add_loads,
    any_axis,
    any_body,
    any_contact,
    any_frame,
    any_joint,
    smooth_loss,
)
from tests.fuzz.spatial_structures import SPATIAL_KINDS
from tests.fuzz.tree_poses import close_loop, pose


@dataclass
class Structure:
    """A mechanism and a pose in which its loops are closed and its contacts are open.

    model : as it is; position : coordinates of the pose [m, rad], orientations as quaternions
    cuts : other choices of joints that become rows
    loops : whether rows tie the coordinates of the pose together
    held : coordinates that are driven
    """

    number: int
    kind: str
    model: mbd.Model
    position: dict[str, Any]
    cuts: list[Any] = field(default_factory=list)
    loops: bool = False
    held: tuple[str, ...] = ()
    _others: dict[Any, mbd.Model] = field(default_factory=dict)

    def with_cut(self, cut: Any) -> mbd.Model:
        """The same mechanism with other joints cut; made once, so that its equations are."""
        if cut == self.model.cut:
            return self.model
        if cut not in self._others:
            other = mbd.Model(
                self.model.name, gravity=self.model.gravity, cut=cut if isinstance(cut, str) else list(cut)
            )
            other.ground = self.model.ground
            for kind in ("joints", "forces", "constraints", "controllers"):
                setattr(other, kind, list(getattr(self.model, kind)))
            self._others[cut] = other
        return self._others[cut]


def _tree(
    rng: random.Random, bodies: int, spatial: bool, most: int, chain: bool = False
) -> tuple[mbd.Model, dict[str, float]]:
    """A tree of bodies, some joints described from the far side, and a pose with angles of several turns."""
    gravity = [rng.uniform(-6, 6) for _ in range(3)] if spatial else (rng.uniform(-3, 3), -9.81, 0.0)
    model = mbd.Model(f"{'spatial' if spatial else 'planar'} tree", gravity=gravity)
    known: list[Any] = [model.ground]
    position: dict[str, float] = {}
    for k in range(bodies):
        body, onto = any_body(rng, f"body {k}", spatial), known[-1] if chain else rng.choice(known)
        a, b = any_frame(rng, onto, spatial), any_frame(rng, body, spatial)
        if rng.random() < 0.3:
            a, b = b, a
        joint = any_joint(rng, f"joint {k}", a, b, spatial)
        if len(position) + len(joint.labels) > most:
            joint = mbd.Revolute(f"joint {k}", a, b)
        if len(position) + 1 > most:
            break
        model.connect(joint)
        known.append(body)
        for label in joint.labels:
            turns = rng.choice([0, 0, 0, 1, -2, 3]) if label.unit == "rad" else 0
            spread = 2.5 if label.unit == "rad" else 0.6
            position[f"{joint.name}.{label.name}"] = rng.uniform(-spread, spread) + 2.0 * math.pi * turns
    return model, position


def _flat_tree(rng: random.Random) -> tuple[mbd.Model, dict[str, float]]:
    model, position = _tree(rng, rng.randint(1, 3), False, 4)
    add_loads(rng, model, False)
    add_event(rng, model, position, resets=rng.random() < 0.5)
    return model, position


def _spatial_tree(rng: random.Random) -> tuple[mbd.Model, dict[str, float]]:
    model, position = _tree(rng, rng.randint(1, 3), True, 5)
    add_loads(rng, model, True)
    add_event(rng, model, position, resets=False)
    return model, position


def _flat_loop(rng: random.Random) -> tuple[mbd.Model, dict[str, float]]:
    """A planar chain whose end is held by a hinge or a slider."""
    model, position = _tree(rng, 3, False, 4, chain=True)
    axis = (rng.uniform(-1, 1), rng.uniform(0.2, 1), 0.0)
    loss = smooth_loss(rng)
    if rng.random() < 0.65 or len(position) < 3:
        maker: Any = lambda a, b: mbd.Revolute("closer", a, b, loss=loss)  # noqa: E731
    else:
        maker = lambda a, b: mbd.Prismatic("closer", a, b, axis=axis, loss=loss)  # noqa: E731
    close_loop(rng, model, position, "closer", maker, False)
    add_loads(rng, model, False)
    add_event(rng, model, position, resets=False)
    return model, position


def _spatial_loop(rng: random.Random) -> tuple[mbd.Model, dict[str, float]]:
    """A chain in space whose end is held by a joint that leaves some freedom."""
    model, position = _tree(rng, 4, True, 7, chain=True)
    axis, loss = any_axis(rng), smooth_loss(rng)
    second = tuple(np.cross(axis, any_axis(rng)))
    makers: list[Any] = [
        lambda a, b: mbd.Cylindrical("closer", a, b, axis=axis),
        lambda a, b: mbd.Universal("closer", a, b, axis=axis, second_axis=second, loss=loss),
    ]
    if len(position) >= 6:
        makers += [
            lambda a, b: mbd.Revolute("closer", a, b, axis=axis, loss=loss),
            lambda a, b: mbd.Screw("closer", a, b, pitch=0.7, axis=axis),
            lambda a, b: mbd.Prismatic("closer", a, b, axis=axis),
        ]
    close_loop(rng, model, position, "closer", rng.choice(makers), True)
    add_loads(rng, model, True)
    return model, position


def _contacts(rng: random.Random) -> tuple[mbd.Model, dict[str, float]]:
    """A planar tree with feet over a ground and stops at joints, all open."""
    model, position = _tree(rng, rng.randint(1, 3), False, 4)
    bodies = pose(model, position)
    feet = [
        body.point(rng.uniform(-0.6, 0.6), rng.uniform(-0.6, 0.6))
        for body in model.bodies.values()
        if body is not model.ground
    ]
    bodies.told.parameters.update({k: v for foot in feet for k, v in foot.parameters().items()})  # type: ignore[attr-defined]
    low = min(float(bodies.place(foot)[0, 1]) for foot in feet) - rng.uniform(0.02, 0.3)
    tilt = rng.uniform(-0.3, 0.3)
    ground: Any = mbd.Plane((0.0, 1.0, 0.0), low, velocity=(rng.choice([0.0, 0.0, 0.8]), 0.0, 0.0))
    if rng.random() < 0.3:
        ground = lambda x: low - 0.4 + 0.1 * np.sin(2.0 * x + tilt)  # noqa: E731
    for k, foot in enumerate(rng.sample(feet, min(len(feet), 2))):
        model.constrain(any_contact(rng, f"foot {k}", mbd.touchdown(foot, ground), True))
    single = [joint for joint in model.joints if len(joint.labels) == 1]
    for k, joint in enumerate(rng.sample(single, min(len(single), rng.randint(0, 2)))):
        q = position[joint.coordinate_names[0]]
        away = rng.uniform(0.02, 0.3)
        stop = mbd.extension(joint, q - away) if rng.random() < 0.5 else mbd.flexion(joint, -q - away)
        model.constrain(any_contact(rng, f"stop {k}", stop, False))
    return model, position


def _dry(rng: random.Random) -> tuple[mbd.Model, dict[str, float]]:
    """A planar chain or loop with dry friction in its joints."""
    if rng.random() < 0.6:
        model, position = _tree(rng, rng.randint(1, 2), False, 3)
    else:
        model, position = _tree(rng, 3, False, 3, chain=True)
        close_loop(rng, model, position, "closer", lambda a, b: mbd.Revolute("closer", a, b), False)
    for place, joint in enumerate(model.joints):
        if len(joint.labels) == 1 and rng.random() < 0.8:
            losses: list[Any] = [
                mbd.Coulomb(rng.uniform(0.05, 1.0)),
                mbd.Coulomb(rng.uniform(0.05, 1.0)) + mbd.Viscous(0.1),
            ]
            if isinstance(joint, mbd.Revolute):
                losses.append(mbd.PinFriction(rng.uniform(0.1, 0.4), rng.uniform(0.01, 0.05)))
            model.joints[place] = replace(joint, loss=rng.choice(losses))  # type: ignore[type-var]
    return model, position


def _rolling(rng: random.Random) -> tuple[mbd.Model, dict[str, float]]:
    """A body in the plane on a blade, a wheel or a row of one's own, with a pendulum."""
    model = mbd.Model("rolling", gravity=(rng.uniform(-2, 2), rng.choice([-9.81, -1.0]), 0.0))
    wheel = mbd.RigidBody(
        "wheel", rng.uniform(0.5, 2), rng.uniform(0.05, 0.3), center=(rng.uniform(-0.1, 0.1), 0.05, 0.0)
    )
    bob = mbd.Link("bob", rng.uniform(0.3, 1), rng.uniform(0.5, 1.0), 0.4, 0.05)
    model.connect(mbd.Planar("ride", model.ground.origin, wheel.origin))
    model.connect(mbd.Revolute("pin", wheel.point(0.2, 0.1), bob.start, loss=smooth_loss(rng)))
    position = {
        "ride.x": rng.uniform(-1, 1),
        "ride.y": 0.3,
        "ride.angle": rng.uniform(-9, 9),
        "pin.angle": rng.uniform(-3, 9),
    }
    draw = rng.randrange(3)
    if draw == 0:
        plane = mbd.Plane((rng.uniform(-0.3, 0.3), 1.0, 0.0), 0.0, velocity=(rng.choice([0.0, 0.7]), 0.0, 0.0))
        place = np.array([position["ride.x"], position["ride.y"], 0.0])
        radius = float(np.asarray(plane.normal) @ place)
        if radius < 0.05:
            position["ride.y"] += 0.5
            radius = float(np.asarray(plane.normal) @ (place + np.array([0.0, 0.5, 0.0])))
        still = mbd.Plane(plane.normal, 0.0)
        model.constrain(mbd.Rolling("tyre", wheel.origin, radius, plane))
        model.constrain(mbd.Bilateral("road", mbd.touchdown(wheel.origin, still), value=radius))
    elif draw == 1:
        model.constrain(mbd.KnifeEdge("blade", wheel.point(0.4, 0.1)))
    else:
        names = ("ride.x.rate", "ride.y.rate", "ride.angle")
        model.constrain(mbd.Nonholonomic("row", lambda a, b, c: a * np.sin(c) - b * np.cos(c), arguments=names))
    return model, position


def _driven(rng: random.Random) -> tuple[mbd.Model, dict[str, float]]:
    """A planar chain with a prescribed joint, a rod, or a height given in time."""
    model, position = _tree(rng, rng.randint(2, 3), False, 4)
    w, size = rng.uniform(1.0, 5.0), rng.uniform(0.1, 0.5)
    single = [joint for joint in model.joints if len(joint.labels) == 1]
    if single and rng.random() < 0.7:
        joint = rng.choice(single)
        q0 = position[joint.coordinate_names[0]]
        model.constrain(mbd.Bilateral("drive", joint, value=lambda t: q0 + size * np.sin(w * t) + 0.5 * w * t))
    else:
        last = list(model.bodies.values())[-1]
        tip, anchor = last.point(0.3, -0.4), model.ground.point(3.0, 2.0)
        bodies = pose(model, position)
        bodies.told.parameters.update(tip.parameters())  # type: ignore[attr-defined]
        length = float(np.linalg.norm(bodies.place(tip)[0] - [3.0, 2.0, 0.0]))
        model.constrain(
            mbd.Bilateral("rod", mbd.distance(anchor, tip), value=lambda t: length + 0.1 * size * np.sin(w * t))
        )
    add_loads(rng, model, False)
    return model, position


def _corner(rng: random.Random) -> tuple[mbd.Model, dict[str, float]]:
    """Masses above a floor that slides on a cart or runs, and against a wall."""
    model = mbd.Model("corner")
    cart = mbd.PointMass("cart", rng.uniform(0.5, 3.0))
    ground: Any = mbd.Plane((rng.uniform(-0.2, 0.2), 1.0, 0.0), 0.0)
    position: dict[str, float] = {}
    if rng.random() < 0.6:
        model.connect(
            mbd.Prismatic("rail", model.ground.origin, cart.origin, loss=rng.choice([None, mbd.Viscous(0.3)]))
        )
        ground, position["rail.displacement"] = (
            mbd.Plane((rng.uniform(-0.2, 0.2), 1.0, 0.0), 0.0, frame=cart.origin),
            0.0,
        )
    for k in range(rng.randint(1, 2)):
        if rng.random() < 0.5:
            ball: Any = mbd.PointMass(f"ball {k}", rng.uniform(0.3, 2.0))
            model.connect(mbd.Translation(f"flight {k}", model.ground.origin, ball.origin))
            corner = ball.origin
        else:
            ball = mbd.RigidBody(f"box {k}", rng.uniform(0.3, 2.0), rng.uniform(0.02, 0.2))
            model.connect(mbd.Planar(f"flight {k}", model.ground.origin, ball.origin))
            corner = ball.point(-0.3, -0.1)
            position[f"flight {k}.angle"] = rng.uniform(-0.4, 0.4)
        position |= {f"flight {k}.x": 1.5 * k, f"flight {k}.y": 0.75 + 0.3 * rng.random()}
        model.constrain(any_contact(rng, f"floor {k}", mbd.touchdown(corner, ground), True))
        if rng.random() < 0.5:
            model.constrain(
                any_contact(
                    rng, f"wall {k}", mbd.touchdown(ball.origin, mbd.Plane((-1.0, 0.2, 0.0), -1.5 - 1.5 * k)), True
                )
            )
    return model, position


def _ruled(rng: random.Random) -> tuple[mbd.Model, dict[str, float]]:
    """Feet that release each other, a controller that samples."""
    model, hip = (
        mbd.Model("rules", gravity=mbd.on_slope(rng.uniform(0.0, 0.2))),
        mbd.PointMass("hip", rng.uniform(0.5, 3.0)),
    )
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    friction = rng.choice([None, None, 0.6])
    for side, other in ("left", "right"), ("right", "left"):
        leg = mbd.Link(f"{side} leg", rng.uniform(0.2, 0.5), 1.0 + 0.01 * rng.random(), 0.5, 0.02)
        loss = rng.choice([None, mbd.Coulomb(0.05), mbd.Viscous(0.02)])
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, leg.start, loss=loss))
        release = rng.choice([None, mbd.When(f"{other} foot"), mbd.When(f"{other} foot", after_impact=True)])
        model.constrain(mbd.Unilateral(f"{side} foot", mbd.touchdown(leg.end), release=release, friction=friction))
    model.apply(mbd.Motor("drive", model.joints[1], torque=0.37))
    size, period = rng.uniform(0.1, 0.5), rng.choice([0.01, 0.037])

    def update(time: float, values: Any, state: Any) -> Any:
        return {"drive.torque": size * math.sin(10.0 * time) - 0.1 * values["left hip.rate"]}

    if rng.random() < 0.7:
        control = mbd.Controller("control", update, period=period, reads=("left hip.rate",), writes=("drive.torque",))
        model.apply(control)
    return model, {
        "trunk.x": 0.0,
        "trunk.y": 1.05,
        "left hip.angle": rng.uniform(-0.4, 0.4),
        "right hip.angle": rng.uniform(-0.4, 0.4),
    }


KINDS: dict[str, tuple[Callable[[random.Random], tuple[mbd.Model, dict[str, float]]], bool, bool]] = {
    "planar tree": (_flat_tree, False, False),
    "planar loop": (_flat_loop, False, True),
    "spatial tree": (_spatial_tree, True, False),
    "spatial loop": (_spatial_loop, True, True),
    "contacts": (_contacts, False, False),
    "dry friction": (_dry, False, True),
    "rolling": (_rolling, False, True),
    "driven": (_driven, False, True),
    "corner": (_corner, False, False),
    "rules": (_ruled, False, False),
}
"""By name: what makes it, whether it is spatial, whether rows tie its coordinates together."""


Kinds = dict[str, tuple[Callable[[random.Random], tuple[mbd.Model, dict[str, Any]]], bool]]

SPACE = 1_000_000
"""From this number on mechanisms are of `SPATIAL_KINDS`, with joints that turn freely."""


DRIVEN = 10_000_000
"""From this number on they are of `DRIVEN_KINDS`: prescribed motions, rest, exact zeros, curved ground."""


def _of_kinds(number: int, kinds: Kinds) -> Structure:
    """The same of a number from `SPACE` or `DRIVEN` on."""
    kind = list(kinds)[number % len(kinds)]
    make, loops = kinds[kind]
    rng = random.Random(f"structure {number}")
    model, position = make(rng)
    names = [joint.name for joint in model.joints]
    cuts: list[Any] = ["all", (rng.choice(names),)]
    if kind == "driven linkage":
        cuts = [("main",), ("pin",)]
    return Structure(number, kind, model, position, cuts, loops, _held(model))


def _held(model: mbd.Model) -> tuple[str, ...]:
    """Coordinates that are driven."""
    words = [word for word in model.bilaterals if isinstance(word, mbd.Bilateral)]
    drives = [word.subject for word in words if isinstance(word.subject, Joint)]
    return tuple(name for joint in drives for name in joint.coordinate_names)


@lru_cache(maxsize=16)
def structure(number: int) -> Structure:
    """The mechanism of a number.

    Raises
    ------
    ModelError
        where the library refuses its words.
    """
    if number >= DRIVEN:
        return _of_kinds(number, DRIVEN_KINDS)
    if number >= SPACE:
        return _of_kinds(number, SPATIAL_KINDS)
    kind = list(KINDS)[number % len(KINDS)]
    make, spatial, loops = KINDS[kind]
    rng = random.Random(f"structure {number}")
    model, position = make(rng)
    pins = any(loss.needs_reaction for joint in model.joints for _, _, loss in joint.losses())
    names = [joint.name for joint in model.joints]
    some = tuple(rng.sample(names, rng.randint(1, len(names))))
    cuts: list[Any] = [] if spatial else ["all", some]
    if spatial and loops:
        cuts = [(rng.choice([name for name in names if name.startswith(("joint", "closer"))]),)]
    return Structure(number, kind, model, position, cuts, loops or pins, _held(model))
