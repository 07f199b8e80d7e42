"""What hips, knees and ankles of a person resist by themselves."""

from __future__ import annotations

from collections.abc import Iterable

from mbd.forces.potential import Potential
from mbd.joints.base import Joint
from mbd.joints.revolute import Revolute
from mbd.joints.spherical import Spherical
from mbd.joints.universal import Universal
from mbd.parts.body.moments import PASSIVE_MOMENTS, PassiveEnergy

__all__ = ["passive_moments"]

FLEXION: dict[type[Joint], str] = {Spherical: "euler.zxy.1", Revolute: "angle", Universal: "first"}
"""The angle about z, flexion of the sequence zxy where a joint has three (Wu et al. 2002)."""


def passive_moments(joints: Iterable[Joint]) -> list[Potential]:
    """Potentials of Anderson & Pandy on the flexion of hips, knees and ankles, each with the parameter 'scale'."""
    found = []
    for joint in joints:
        kind = joint.name.rpartition(" ")[2]
        if kind in PASSIVE_MOMENTS and type(joint) in FLEXION:
            angle = f"{joint.name}.{FLEXION[type(joint)]}"
            energy = PassiveEnergy(PASSIVE_MOMENTS[kind], 0.0)
            found.append(Potential(f"{joint.name} passive moment", energy, (angle, ("scale", 1.0))))
    return found
