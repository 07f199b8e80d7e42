"""How coordinates change their signs where left and right are exchanged in space: by reflection in a plane.

A reflection σ across x, y or z takes a placement (R, p) to (σ R σ, σ p), a linear velocity v to σ v and an angular
velocity ω, an axial vector, to −σ ω. A joint whose partner on the other side moves by the mirrored twist for each of
its velocities, or by the opposite of it, exchanges coordinates with it up to signs: hinges across the plane keep
theirs, those along it turn the other way, quaternions (w, x, y, z) follow their angular velocities.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism
from mbd.joints.reflected import ACROSS, mirrored_signs
from mbd.topology.plan import plan

__all__ = ["Reflection", "in_space", "reflections"]

ALONG = 1e-9
"""Difference of places of touchdown and those of their mirror images, relative, up to which they are the same [-]."""
POSES = 3
"""Postures at which places of touchdown are compared with their mirror images [-]."""


@dataclass(frozen=True, eq=False)
class Reflection:
    """Signs of the mirror image's numbers, in their own places.

    axis : 'z' where z is turned about; q, v, anchors : ±1 each
    """

    axis: str
    q: Vector
    v: Vector
    anchors: Vector


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
    for name, sigma in ACROSS.items():
        signs = [mirrored_signs(joint, joints.get(partners.name(joint.name)), sigma) for joint in joints.values()]
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
