"""How coordinates change their signs where left and right are exchanged in space: by reflection in a plane.

A reflection σ across x, y or z takes a placement (R, p) to (σ R σ, σ p), a linear velocity v to σ v and an angular
velocity ω, an axial vector, to −σ ω. A joint whose partner on the other side moves by the mirrored twist for each of
its velocities, or by the opposite of it, exchanges coordinates with it up to signs: hinges across the plane keep
theirs, those along it turn the other way, quaternions (w, x, y, z) follow their angular velocities.
"""

from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import Mechanism
from mbd.compile.trivial_rows import SAMPLED_POSES
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL
from mbd.joints.reflected import ACROSS, mirrored_signs
from mbd.topology.plan import is_planar, plan


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
    return bool(getattr(model, "joints", ())) and not is_planar(model)


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
        anchors = _of_anchors(mechanism, partners, (q, v), parameters)
        if anchors is not None:
            found.append(Reflection(name, q[partners.q], v[partners.v], anchors))
    return found


def _of_anchors(mechanism: Mechanism, partners: Any, signs: tuple[Vector, Vector], parameters: Vector) -> Vector | None:
    """Signs of what is stored, from mirrored states; None where one is not mirrored.

    What is stored of motion tells its sign at once; what is stored of other held values, once theirs are known.
    """
    if not mechanism.layout.n_anchors:
        return np.ones(0)
    found = np.zeros(mechanism.layout.n_anchors)  # 0: not known yet
    while True:
        mine, its = _stored(mechanism, partners, signs, found, parameters)
        size = max(1.0, float(np.max(np.abs(mine))))
        same, opposite = (np.all(np.abs(its - sign * mine) <= EQUAL_RTOL * size, axis=0) for sign in (1.0, -1.0))
        if not np.all(same | opposite):
            return None
        now = np.where(same & opposite, 0.0, np.where(same, 1.0, -1.0))
        if np.all((now == 0.0) | (found != 0.0)):
            return np.where(found == 0.0, 1.0, found)
        found = np.where(found == 0.0, now, found)


def _stored(
    mechanism: Mechanism, partners: Any, signs: tuple[Vector, Vector], of_anchors: Vector, parameters: Vector
) -> tuple[Matrix, Matrix]:
    """What would be stored (SAMPLED_POSES, n_anchors) at some states, exchanged, and at their mirror images.

    Values are held where their signs are known.
    """
    layout, random = mechanism.layout, np.random.default_rng(11)
    configuration = mechanism.equations.configuration
    here, there = list[Vector](), list[Vector]()
    for _ in range(SAMPLED_POSES):
        q = configuration.compose(np.array(configuration.defaults), random.uniform(-0.4, 0.4, layout.n_v))
        v, z = random.uniform(-1.0, 1.0, layout.n_v), random.uniform(-1.0, 1.0, layout.n - layout.n_v)
        own = random.uniform(0.1, 0.5, layout.n_anchors) * (of_anchors != 0.0)
        held = np.zeros(layout.n_anchors)
        held[partners.anchors] = own
        image = (signs[0] * q)[partners.q], np.concatenate([(signs[1] * v)[partners.v], z[partners.z]])
        for (place, y), anchors, found in (
            ((q, np.concatenate([v, z])), held, here), (image, of_anchors * own, there),
        ):  # fmt: skip
            found.append(mechanism.acceleration_terms(0.0, place, y, parameters, anchors).captured)
    return np.array(here)[:, partners.anchors], np.array(there)
