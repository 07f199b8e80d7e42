"""How coordinates change their signs where left and right are exchanged in space: by reflection in a plane.

A reflection σ across x, y or z takes a placement (R, p) to (σ R σ, σ p), a linear velocity v to σ v and an angular
velocity ω, an axial vector, to −σ ω. A joint whose partner on the other side moves by the mirrored twist for each of
its velocities, or by the opposite of it, exchanges coordinates with it up to signs: hinges across the plane keep
theirs, those along it turn the other way, quaternions (w, x, y, z) follow their angular velocities.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import Mechanism
from mbd.joints.base import Joint
from mbd.topology.plan import plan

__all__ = ["AsWritten", "Reflection", "in_space", "reflections"]

ALONG = 1e-9
"""Difference of a twist and its partner's [-, m] up to which they are the same."""
POSES = 3
"""Postures at which places of touchdown are compared with their mirror images [-]."""
AXES = {2: "z", 1: "y", 0: "x"}
"""Numbers of axes in the order in which reflections across them are tried: to the side first."""


@dataclass(frozen=True, eq=False)
class Reflection:
    """Signs of the mirror image's numbers, in their own places.

    axis : 'z' where z is turned about; q, v, anchors : ±1 each
    """

    axis: str
    q: Vector
    v: Vector
    anchors: Vector


class AsWritten:
    """A scope on which run-time parameters have the values that the words hold."""

    def parameter(self, owner: str, field: str, value: float) -> float:
        """The value."""
        return value


def in_space(model: Any) -> bool:
    """Whether a model has joints that leave the plane."""
    return bool(getattr(model, "joints", ())) and not plan(model).planar


def reflections(model: Any, mechanism: Mechanism, partners: Any, parameters: Vector) -> list[Reflection]:
    """The reflections under which every joint's twists are those of its partner up to signs; none of a plane's model.

    Parameters
    ----------
    model : of joints, else there is none
    partners : `mbd.gait.mirror.Mirror` that exchanges names alone
    """
    if not in_space(model):
        return []
    joints = {joint.name: joint for joint in plan(model).edges}
    found = []
    for axis, name in AXES.items():
        sigma = np.ones(3)
        sigma[axis] = -1.0
        signs = [_signs(joint, joints.get(partners.name(joint.name)), sigma) for joint in joints.values()]
        if any(each is None for each in signs):
            continue
        q = np.concatenate([own[0] for own in signs if own is not None])
        v = np.concatenate([own[1] for own in signs if own is not None])
        layout = mechanism.layout
        q, v = (np.concatenate([part, np.ones(n - len(part))]) for part, n in ((q, layout.n_q), (v, layout.n_v)))
        anchors = _of_anchors(mechanism, partners, q, parameters)
        if anchors is not None:
            found.append(Reflection(name, q[partners.q], v[partners.v], anchors))
    return found


def _signs(joint: Joint, partner: Joint | None, sigma: Vector) -> tuple[Vector, Vector] | None:
    """Signs of a joint's coordinates and velocities in its partner; None where its motion is not mirrored there."""
    if partner is None or len(partner.labels) != len(joint.labels):
        return None
    mine, its = _twists(joint), _twists(partner)
    mirrored = np.hstack([-sigma * mine[:, :3], sigma * mine[:, 3:]])
    v = np.zeros(len(mine))
    for sign in (1.0, -1.0):
        v[np.all(np.abs(sign * its - mirrored) <= ALONG, axis=1)] = sign
    if not np.all(v):
        return None
    if joint.is_vector:
        return v, v
    first = joint.orientation
    if first is None:
        return None
    q = np.ones(len(joint.labels))
    q[: joint.adding], q[first + 1 : first + 4] = v[: joint.adding], v[-3:]
    return q, v


def _twists(joint: Joint) -> Matrix:
    """(angular, linear) velocity of the child for each velocity (n, 6), in axes of the child body, at rest."""
    scope: Any = AsWritten()
    turn = np.eye(3) if joint.child.rotation is None else np.array(joint.child.rotation)
    pairs: Sequence[Any] = joint.subspace(list(joint.defaults), scope)
    found = [np.concatenate([turn @ np.array(part, dtype=float) for part in pair]) for pair in pairs]
    return np.array(found).reshape(len(found), 6)


def _of_anchors(mechanism: Mechanism, partners: Any, signs: Vector, parameters: Vector) -> Vector | None:
    """Signs of places of touchdown, from those of mirrored postures; None where one is not mirrored."""
    layout, random = mechanism.layout, np.random.default_rng(11)
    if not layout.n_anchors:
        return np.ones(0)
    configuration = mechanism.equations.configuration
    here, there = list[Vector](), list[Vector]()
    for _ in range(POSES):
        q = configuration.compose(np.array(configuration.defaults), random.uniform(-0.4, 0.4, layout.n_v))
        for place, found in ((q, here), ((signs * q)[partners.q], there)):
            terms = mechanism.acceleration_terms(0.0, place, np.zeros(layout.n), parameters, np.zeros(layout.n_anchors))
            found.append(terms.captured)
    mine, its = np.array(here)[:, partners.anchors], np.array(there)
    size = max(1.0, float(np.max(np.abs(mine))))
    same, opposite = (np.all(np.abs(its - sign * mine) <= ALONG * size, axis=0) for sign in (1.0, -1.0))
    return np.where(same, 1.0, -1.0) if np.all(same | opposite) else None
