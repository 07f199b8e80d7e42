"""Random mechanisms in space for laws that compare two forms of one run: each joint, in trees, in loops and on feet."""

import random
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

import mbd
from mbd.bodies.base import Frame
from mbd.joints.base import Joint
from tests.fuzz.parts import any_axis, any_body, any_frame
from tests.fuzz.spatial_structures import any_foot, any_place, any_plane
from tests.fuzz.tree_poses import close_loop, pose

Maker = Callable[[random.Random, str, Frame, Frame], Joint]

JOINTS: dict[str, Maker] = {
    "revolute": lambda rng, name, a, b: mbd.Revolute(name, a, b, axis=any_axis(rng), loss=mbd.Viscous(0.1)),
    "universal": lambda rng, name, a, b: mbd.Universal(name, a, b, axis=(0.0, 1.0, 0.0), second_axis=(1.0, 0.0, 0.0)),
    "spherical": lambda rng, name, a, b: mbd.Spherical(name, a, b, loss=rng.choice([None, mbd.Viscous(0.1)])),
    "free": lambda rng, name, a, b: mbd.Free(name, a, b, loss={"angular_velocity.z": mbd.Viscous(0.2)}),
    "cylindrical": lambda rng, name, a, b: mbd.Cylindrical(name, a, b, axis=any_axis(rng)),
    "screw": lambda rng, name, a, b: mbd.Screw(name, a, b, pitch=rng.uniform(0.2, 0.8), axis=any_axis(rng)),
    "planar": lambda rng, name, a, b: mbd.Planar(name, a, b, loss={"angle": mbd.Viscous(0.1)}),
    "translation": lambda rng, name, a, b: mbd.Translation(name, a, b, axes=rng.choice(["xyz", "xz"])),
    "prismatic": lambda rng, name, a, b: mbd.Prismatic(name, a, b, axis=any_axis(rng), stiffness=30.0),
    "weld": lambda rng, name, a, b: mbd.Weld(name, a, b),
}  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """A mechanism and how it starts."""

    model: mbd.Model
    start: mbd.State


def _chain(rng: random.Random, model: mbd.Model, kinds: list[str]) -> tuple[list[Any], dict[str, Any]]:
    """Bodies one behind the other on joints of these kinds, some described from the far side, in any pose."""
    bodies: list[Any] = [model.ground]
    position: dict[str, Any] = {}
    for k, kind in enumerate(kinds):
        body = any_body(rng, f"body {k}", True)
        a, b = any_frame(rng, bodies[-1], True), any_frame(rng, body, True)
        joint = JOINTS[kind](rng, f"joint {k}", *((b, a) if rng.random() < 0.3 else (a, b)))
        model.connect(joint)
        position |= any_place(rng, joint)
        bodies.append(body)
    return bodies, position


def tree(rng: random.Random, kind: str) -> tuple[mbd.Model, dict[str, Any]]:
    """The joint between a body that turns freely and one behind it, and at either end of a third; with a spring."""
    model = mbd.Model(f"tree with {kind}", gravity=any_axis(rng))
    others = rng.choice([["spherical", kind, "revolute"], [kind, "universal", kind]])
    bodies, position = _chain(rng, model, others)
    ends = model.ground.point(1.0, 2.0, 0.5), bodies[-1].point(0.1, -0.2, 0.3)
    model.apply(mbd.Spring("spring", *ends, stiffness=rng.uniform(5.0, 20.0), length=1.0))
    return model, position


def loop(rng: random.Random, kind: str) -> tuple[mbd.Model, dict[str, Any]]:
    """A chain that the joint closes; of the chain's eight freedoms at least two are left."""
    model = mbd.Model(f"loop with {kind}", gravity=any_axis(rng))
    _, position = _chain(rng, model, ["spherical", "universal", "spherical"])
    made = random.Random(rng.random())
    kept = made.getstate()

    def maker(a: Frame, b: Frame) -> Joint:
        made.setstate(kept)
        return JOINTS[kind](made, "closer", a, b)

    close_loop(rng, model, position, "closer", maker, True)
    return model, position


def feet(rng: random.Random, kind: str) -> tuple[mbd.Model, dict[str, Any]]:
    """A floating body with a second one on the joint, over a plane on which it comes down with four feet."""
    model = mbd.Model(f"feet with {kind}", gravity=(0.0, -9.81, 0.0))
    bodies, position = _chain(rng, model, ["free", kind])
    places = [(0.3, -0.4, 0.3), (-0.3, -0.4, 0.25), (-0.28, -0.4, -0.3)]
    points = [bodies[1].point(*place) for place in places] + [bodies[2].point(0.2, -0.3, 0.1)]
    posed = pose(model, position)
    posed.told.parameters.update({k: v for point in points for k, v in point.parameters().items()})  # type: ignore[attr-defined]
    plane = any_plane(rng, 0.0)
    heights = [float(np.dot(plane.normal, posed.place(point)[0])) for point in points]
    plane = mbd.Plane(plane.normal, min(heights) - rng.uniform(0.01, 0.05), velocity=plane.velocity)
    for k, point in enumerate(points):
        model.constrain(any_foot(rng, f"foot {k}", mbd.touchdown(point, plane)))
    return model, position


KINDS: dict[str, Callable[[random.Random, str], tuple[mbd.Model, dict[str, Any]]]] = {
    "tree": tree, "loop": loop, "feet": feet,
}  # fmt: skip


@lru_cache(maxsize=64)
def scene(kind: str, joint: str, seed: int) -> Scene:
    """The mechanism of a kind around a joint, moving."""
    rng = random.Random(f"{kind} {joint} {seed}")
    model, position = KINDS[kind](rng, joint)
    names = [name for each in model.joints if each.name != "closer" for name in each.velocity_names]
    velocity = {name: rng.uniform(-1.0, 1.0) for name in names}
    return Scene(model, mbd.assemble(model, position, velocity, project=kind == "loop"))


def cases(seeds: range) -> list[tuple[str, str, int]]:
    """Every joint in every kind of mechanism; a free one closes no loop."""
    return [
        (kind, joint, seed) for seed in seeds for kind in KINDS for joint in JOINTS if (kind, joint) != ("loop", "free")
    ]
