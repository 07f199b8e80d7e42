"""Springs of joints that turn freely and bushings, by rotation vectors of the description."""

from typing import Any

import numpy as np

import mbd
from tests.fuzz.geometry import Array, hat


def rotation_vector(R: Array) -> Array:
    """Angle times axis (n, 3), the angle between 0 and π."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(R).as_rotvec())


def seen(R: Array, vector: Array) -> Array:
    """R v, row by row."""
    return np.asarray((R @ vector[:, :, None])[:, :, 0])


def ball_spring(found: Any, joint: mbd.Spherical) -> None:
    """The torque −k φ of an isotropic spring, φ the rotation vector, which is the same in both frames."""
    stiffness = found.bodies.told.parameters.get(f"{joint.name} spring.stiffness", 0.0)
    if not np.any(stiffness):
        return
    turn = rotation_vector(found.bodies.between(joint).H[:, :3, :3])
    R = found.bodies.frame(joint.parent).H[:, :3, :3]
    found.pair(joint, np.zeros_like(turn), -stiffness * seen(R, turn))
    found.stored[f"{joint.name} spring"] = 0.5 * stiffness * np.sum(turn**2, axis=1)


def bushing(found: Any, force: mbd.Bushing) -> None:
    """``F = −R (k d + c ḋ)`` at b and back there; ``T = −R (J⁻ᵀ κ φ + γ ω)``, φ̇ = J⁻¹ ω in the axes of a."""
    bodies, told = found.bodies, found.bodies.told
    k, kappa, c, gamma = (
        np.array([np.max(told.parameters[f"{force.name}.{field}.{axis}"]) for axis in "xyz"])
        for field in ("stiffness", "rotational_stiffness", "damping", "rotational_damping")
    )
    A, B = bodies.frame(force.a).H, bodies.frame(force.b).H
    R, back = A[:, :3, :3], np.swapaxes(A[:, :3, :3], 1, 2)
    d, phi = seen(back, B[:, :3, 3] - A[:, :3, 3]), rotation_vector(back @ B[:, :3, :3])
    one, other = force.a.body.name, force.b.body.name
    motion = bodies.velocity(other, B[:, :3, 3]) - bodies.velocity(one, B[:, :3, 3])
    rate, spin = seen(back, motion), seen(back, bodies.twist(other).angular - bodies.twist(one).angular)
    push = -seen(R, k * d + c * rate)
    turn = -seen(R, seen(np.swapaxes(_slope(phi), 1, 2), kappa * phi) + gamma * spin)
    found.force(other, B[:, :3, 3], push, turn)
    found.force(one, B[:, :3, 3], -push, -turn)
    found.stored[force.name] = 0.5 * (d**2 @ k + phi**2 @ kappa)
    found.power[force.name] = -(rate**2 @ c + spin**2 @ gamma)


def _slope(phi: Array) -> Array:
    """``J⁻¹ = 1 − ½ [φ]× + (1 − θ/2 cot θ/2)/θ² [φ]×²`` (n, 3, 3)."""
    half = 0.5 * np.linalg.norm(phi, axis=1)
    large = np.where(half > 1e-4, half, 1.0)
    part = np.where(half > 1e-4, (1.0 - large / np.tan(large)) / (4.0 * large**2), 1.0 / 12.0)
    across = hat(phi)
    return np.asarray(np.eye(3) - 0.5 * across + part[:, None, None] * (across @ across))
