"""What hips, knees and ankles of a person resist by themselves."""

from collections.abc import Iterable

from mbd.forces.potential import Potential
from mbd.joints.base import AWAITED_ATTRIBUTE, Joint
from mbd.joints.revolute import Revolute
from mbd.joints.spherical import Spherical
from mbd.joints.universal import Universal
from mbd.parts.body.moments import PASSIVE_MOMENTS, PassiveEnergy

FLEXION: dict[type[Joint], str] = {Spherical: "euler.zxy.1", Revolute: "angle", Universal: "first"}
"""The angle about z, flexion of the sequence zxy where a joint has three (Wu et al. 2002)."""


def passive_moments(joints: Iterable[Joint]) -> list[Potential]:
    """Potentials of Anderson & Pandy on the flexion of hips, knees and ankles, each with the parameter 'scale'."""
    found = []
    for joint in filter(_resists, joints):
        energy = PassiveEnergy(PASSIVE_MOMENTS[joint.name.rpartition(" ")[2]], 0.0)
        angle = f"{joint.name}.{FLEXION[type(joint)]}"
        found.append(Potential(_name(joint), energy, (angle, ("scale", 1.0))))
    return found


def await_passive_moments(joints: Iterable[Joint]) -> None:
    """Let joints remember that passive moments belong to them, so that a model without any of these is in doubt.

    It is no part of their description: equality, replacement and the equations of motion do not ask for it.
    """
    resisting = list(filter(_resists, joints))
    for joint in resisting:
        object.__setattr__(joint, AWAITED_ATTRIBUTE, tuple(map(_name, resisting)))


def _resists(joint: Joint) -> bool:
    return joint.name.rpartition(" ")[2] in PASSIVE_MOMENTS and type(joint) in FLEXION


def _name(joint: Joint) -> str:
    return f"{joint.name} passive moment"
