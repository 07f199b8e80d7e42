"""DART in space: ball joints and floating bodies, `World.step` (semi-implicit Euler)."""

from __future__ import annotations

from functools import partial
from typing import Any

import dartpy as dart
import numpy as np

from benchmarks.peers.race import Attempt, Outcome, Sweep, seconds
from benchmarks.peers.scenes import Scene
from benchmarks.peers.space import TREES, Part, Tree, centers, rotation, tree

D = dart.dynamics
STEPS = {
    "S7_top": (1e-3, 1e-4, 2e-5), "S7_double": (0.01, 0.001, 2e-4), "S7_chain": (0.002, 2e-4, 5e-5),
    "S7_human": (0.005, 5e-4, 1e-4),
}  # fmt: skip


def _vector(q: Any) -> Any:
    """Angle times axis."""
    q = np.array(q) if q[0] >= 0.0 else -np.array(q)
    size = np.linalg.norm(q[1:])
    return 2.0 * q[1:] if size == 0.0 else q[1:] * (2.0 * np.arctan2(size, q[0]) / size)


def _quaternions(vectors: Any) -> Any:
    angle = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.concatenate([np.cos(angle / 2.0), 0.5 * np.sinc(angle / (2.0 * np.pi)) * vectors], axis=-1)


def _joint(skeleton: Any, parent: Any, part: Part, k: int) -> Any:
    if part.joint == "hinges" and len(part.axes) == 2:
        properties, make = D.UniversalJointProperties(), skeleton.createUniversalJointAndBodyNodePair
        properties.mAxis = [np.array(axis) for axis in part.axes]
    elif part.joint == "hinges":
        properties, make = D.RevoluteJointProperties(), skeleton.createRevoluteJointAndBodyNodePair
        properties.mAxis = np.array(part.axes[0])
    elif part.joint == "ball":
        properties, make = D.BallJointProperties(), skeleton.createBallJointAndBodyNodePair
    else:
        properties, make = D.FreeJointProperties(), skeleton.createFreeJointAndBodyNodePair
    properties.mName = f"j{k}"
    at = dart.math.Isometry3()
    at.set_translation(list(part.at))
    properties.mT_ParentBodyToJoint = at
    _, body = make(parent, properties)
    body.setInertia(D.Inertia(part.mass, np.array(part.center), np.diag(part.inertia)))
    return body


def _run(scene: Scene, tree: Tree, h: float) -> Outcome:
    skeleton, bodies, order = D.Skeleton("tree"), list[Any](), list[int]()
    for k, part in enumerate(tree.parts):
        bodies.append(_joint(skeleton, bodies[part.parent] if part.parent >= 0 else None, part, k))
    skeleton.disableSelfCollisionCheck()
    world = dart.simulation.World()
    world.setGravity(list(tree.gravity))
    world.setTimeStep(h)
    world.addSkeleton(skeleton)
    q, v = np.zeros(skeleton.getNumDofs()), np.zeros(skeleton.getNumDofs())
    for k, part in enumerate(tree.parts):
        joint = skeleton.getJoint(f"j{k}")
        places = [joint.getIndexInSkeleton(j) for j in range(joint.getNumDofs())]
        order += places
        if part.joint == "hinges":
            q[places], v[places] = part.q, part.v
        elif part.joint == "ball":
            q[places], v[places] = _vector(part.q), part.v
        else:
            R = rotation(part.q[3:])
            q[places], v[places] = [*_vector(part.q[3:]), *part.q[:3]], [*part.v[3:], *(R.T @ np.array(part.v[:3]))]
    skeleton.setPositions(q)
    skeleton.setVelocities(v)
    block, rows = round(scene.every / h), [skeleton.getPositions().copy()]

    def run() -> None:
        for _ in scene.times[1:]:
            for _ in range(block):
                world.step()
            rows.append(skeleton.getPositions().copy())

    spent = seconds(run)
    return Outcome(centers(tree, _canonical(tree, np.array(rows)[:, order])), spent, block * (len(scene.times) - 1))


def _canonical(tree: Tree, rows: Any) -> Any:
    found, place = [], 0
    for part in tree.parts:
        size = len(part.v)
        own, place = rows[:, place : place + size], place + size
        if part.joint == "free":
            own = np.hstack([own[:, 3:], _quaternions(own[:, :3])])
        elif part.joint == "ball":
            own = _quaternions(own)
        found.append(own)
    return np.hstack(found)


def attempts(scene: Scene) -> list[Sweep]:
    if scene.name not in TREES:
        return []
    return [[Attempt(f"World.step h={h:g}", partial(_run, scene, tree(scene.name), h)) for h in STEPS[scene.name]]]
