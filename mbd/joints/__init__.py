"""Joints: what two bodies may still do against each other."""

from mbd.joints.base import Joint, Label
from mbd.joints.cylindrical import Cylindrical
from mbd.joints.free import Free
from mbd.joints.planar import Planar
from mbd.joints.prismatic import Prismatic
from mbd.joints.reversed import Reversed
from mbd.joints.revolute import Revolute
from mbd.joints.screw import Screw
from mbd.joints.spherical import Spherical
from mbd.joints.translation import Translation
from mbd.joints.universal import Universal
from mbd.joints.weld import Weld

__all__ = [
    "Cylindrical", "Free", "Joint", "Label", "Planar", "Prismatic", "Reversed", "Revolute", "Screw", "Spherical",
    "Translation", "Universal", "Weld",
]  # fmt: skip
