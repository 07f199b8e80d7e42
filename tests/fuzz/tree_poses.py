"""Where the bodies of a described tree are, and joints that close loops at that pose."""

import random
from typing import Any

import numpy as np

import mbd
from tests.fuzz.bodies import Bodies
from tests.fuzz.geometry import Array
from tests.fuzz.parts import any_frame
from tests.fuzz.readings import Readings


def scalars(position: dict[str, Any]) -> dict[str, float]:
    """Coordinates by name, quaternions part by part."""
    found: dict[str, float] = {}
    for name, value in position.items():
        whole = isinstance(value, tuple)
        found |= (
            {f"{name}.{part}": number for part, number in zip("wxyz", value, strict=True)} if whole else {name: value}
        )
    return found


def pose(model: mbd.Model, position: dict[str, Any], more: str = "") -> Bodies:
    """The bodies at a pose, at rest."""
    position = scalars(position)
    still = {name + suffix: np.zeros(1) for name in position for suffix in (".rate", ".acceleration")}
    spins = [
        f"{owner}.angular_velocity.{axis}"
        for owner in (*(joint.name for joint in model.joints), more)
        for axis in "xyz"
    ]
    still |= {name + suffix: np.zeros(1) for name in spins for suffix in ("", ".acceleration")}
    values = {name: np.array([value]) for name, value in position.items()} | still
    told = Readings(np.zeros(1), values, {}, model.parameters, frozenset(position))
    return Bodies(model, told)


def _rotation_vector(R: Array) -> tuple[float, tuple[float, float, float]]:
    from scipy.spatial.transform import Rotation

    vector = Rotation.from_matrix(R).as_rotvec()
    angle = float(np.linalg.norm(vector))
    x, y, z = vector / angle if angle > 0.0 else (0.0, 0.0, 1.0)
    return angle, (float(x), float(y), float(z))


def close_loop(
    rng: random.Random, model: mbd.Model, position: dict[str, Any], name: str, maker: Any, spatial: bool
) -> None:
    """Add a joint between the last body and another one, with its frames where the pose has them."""
    moving = [body for body in model.bodies.values() if body is not model.ground]
    last, other = moving[-1], rng.choice([model.ground, model.ground, *moving[:-2]])
    a = any_frame(rng, other, spatial)
    probe = maker(a, last.origin)
    value: dict[str, Any] = {label.name: rng.uniform(-1.0, 1.0) for label in probe.labels if label.unit}
    if isinstance(probe, mbd.Spherical):
        value["orientation"] = (0.5, 0.5, -0.5, 0.5)
    told = {**position, **{f"{name}.{label}": number for label, number in value.items()}}
    bodies = pose(model, told, name)
    bodies.told.parameters.update(probe.parameters() | a.parameters())  # type: ignore[attr-defined]
    H = bodies.frame(a).H[0] @ bodies.between(probe).H[0]
    inside = np.linalg.inv(bodies.placed[last.name].H[0]) @ H
    angle, axis = _rotation_vector(inside[:3, :3])
    point = last.point(float(inside[0, 3]), float(inside[1, 3]), float(inside[2, 3]), name=f"{name} end")
    if abs(angle) > 1e-9:
        if not spatial:
            angle, axis = angle * axis[2], (0.0, 0.0, 1.0)
        point = point.turned(angle, axis)
    model.connect(maker(a, point))
    position |= told
