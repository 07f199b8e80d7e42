"""Whether double precision can carry the inertia of a large tree, told before its equations are derived.

Kinetic energy is ½ |J v|², with J the velocities of all bodies, weighted by the roots of their masses and inertias, per
unit rate. The singular values of J, its columns of length 1, have no cancellation; their squares are those of the
scaled mass matrix.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.inertia import lost_sentence
from mbd.compile.mechanisms import is_known
from mbd.equations.sizes import (
    MIN_CHECKED_OPERATIONS,
    MIN_JOINTS,
    OF_PAIR,
    is_surely_small,
    pairs_on_paths,
    require_room,
)
from mbd.errors import AssemblyError
from mbd.joints.base import Joint
from mbd.tape.node import Node, Tape
from mbd.topology.check import faults
from mbd.topology.description import Description
from mbd.topology.plan import Plan, plan

MIN_EIGENVALUE_RATIO = 1e-16
"""Smallest over largest eigenvalue of the scaled mass matrix below which no correction finds its inverse [-]."""


class _Numbers:
    """A scope in which every parameter is its number."""

    def __init__(self, changed: Mapping[str, float]) -> None:
        self.tape, self.changed = Tape(), changed

    def parameter(self, owner: str, field: str, value: float) -> Node:
        """Its value as a constant."""
        return self.tape.lift(float(self.changed.get(f"{owner}.{field}", value)))


def require_inertia(model: Any, position: Mapping[str, float], changed: Mapping[str, float]) -> None:
    """Refuse a large tree with a motion whose inertia is lost in round-off at the start.

    Raises
    ------
    ModelError
        for one whose equations do not fit into the free memory (`require_room`), before its inertia is looked at.
    AssemblyError
        with the coordinate that moves most, the share of inertia, and what to try.
    """
    if not isinstance(model, Description) or len(model.joints) < MIN_JOINTS:
        return
    if not is_known(model) and faults(model):
        return
    if is_surely_small(len({id(frame.body) for frame in model.points()})):
        return
    chosen = plan(model)
    free = not (chosen.cut or model.bilaterals or model.nonholonomic)
    large = OF_PAIR[chosen.planar] * pairs_on_paths(chosen) >= MIN_CHECKED_OPERATIONS
    if not free or not large or not all(joint.is_vector for joint in chosen.edges):
        return
    require_room(chosen)
    names, velocities = weighted_velocities(chosen, position, changed)
    size = np.linalg.norm(velocities, axis=0)
    if not np.isfinite(size).all() or not size.all():
        return  # what no inertia resists at all is found, and named, with the equations
    scaled = velocities / size
    if _is_regular(scaled):
        return
    _, values, right = np.linalg.svd(scaled, full_matrices=False)
    share = float((values[-1] / values[0]) ** 2)
    if share < MIN_EIGENVALUE_RATIO:
        worst = names[int(np.argmax(np.abs(right[-1] / size)))]
        raise AssemblyError([lost_sentence(worst, share)])


def _is_regular(scaled: Matrix) -> bool:
    """Whether R of Q R, whose inverse bounds the singular values, tells that none is too small; cheaper than these."""
    if len(scaled) < scaled.shape[1]:
        return False
    triangle = np.linalg.qr(scaled, mode="r")
    try:
        bound = np.linalg.norm(triangle) * np.linalg.norm(np.linalg.inv(triangle))
    except np.linalg.LinAlgError:
        return False
    return bool(2.0 * bound * bound * MIN_EIGENVALUE_RATIO < 1.0)


def weighted_velocities(
    chosen: Plan, position: Mapping[str, float], changed: Mapping[str, float]
) -> tuple[list[str], Matrix]:
    """Names of coordinates, and J at a posture: √m times velocities of centers, √I times turns, per unit rate."""
    scope = _Numbers(changed)
    names = list(chosen.coordinate_names)
    n = len(names)
    poses: dict[str, tuple[Matrix, Vector]] = {}
    moved: dict[str, list[int]] = {}
    turns, shifts, places = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    rows = []
    count = 0
    for joint in chosen.edges:
        above = joint.parent.body.name
        R, p = poses.get(above, (np.eye(3), np.zeros(3)))
        R, p = _after(R, p, *_placed(joint.parent.placement(scope)))
        q = [scope.tape.lift(float(position.get(name, 0.0))) for name in joint.coordinate_names]
        R, p = _after(R, p, *_placed(joint.transform(q, scope)))  # type: ignore[arg-type]
        own = list(range(count, count + len(q)))
        for k, (turn, shift) in zip(own, joint.subspace(q, scope), strict=True):  # type: ignore[arg-type]
            turns[k], shifts[k], places[k] = R @ _floats(turn), R @ _floats(shift), p
        count += len(q)
        inward, offset = _placed(joint.child.placement(scope))
        R = R @ inward.T
        p = p - R @ offset
        body = joint.child.body
        poses[body.name], moved[body.name] = (R, p), [*moved.get(above, ()), *own]
        rows.append(_body_rows(joint, scope, R, p, moved[body.name], (turns, shifts, places)))
    whole = np.vstack(rows)
    return names, whole[np.any(whole != 0.0, axis=1)]


def _body_rows(
    joint: Joint, scope: Any, R: Matrix, p: Vector, path: Sequence[int], motions: tuple[Matrix, Matrix, Matrix]
) -> Matrix:
    """The rows of J of one body."""
    turns, shifts, places = (motion[path] for motion in motions)
    found = joint.child.body.mass_properties(scope)
    inertia = np.array([_floats(row) for row in found.inertia])
    sizes, axes = np.linalg.eigh(0.5 * (inertia + inertia.T))
    center = p + R @ _floats(found.center)
    rows = np.zeros((6, len(motions[0])))
    speeds = shifts + np.cross(turns, center - places)
    rows[:3, path] = np.sqrt(max(_float(found.mass), 0.0)) * speeds.T
    rows[3:, path] = (np.sqrt(np.maximum(sizes, 0.0))[:, None] * axes.T) @ R.T @ turns.T
    return rows


def _after(R: Matrix, p: Vector, turn: Matrix, shift: Vector) -> tuple[Matrix, Vector]:
    return R @ turn, p + R @ shift


def _placed(found: tuple[Any, Any]) -> tuple[Matrix, Vector]:
    return np.array([_floats(row) for row in found[0]]), _floats(found[1])


def _floats(values: Sequence[Any]) -> Vector:
    return np.array([_float(value) for value in values])


def _float(value: Any) -> float:
    """The number of a constant."""
    return float(value.data) if isinstance(value, Node) else float(value)
