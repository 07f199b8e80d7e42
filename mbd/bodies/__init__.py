"""Bodies: ground, point mass, link, rigid body; and helpers for their inertia."""

from mbd.bodies.base import Body, Frame
from mbd.bodies.domains import Domain, Parameterized
from mbd.bodies.ground import Ground
from mbd.bodies.inertia import Solid, box, cylinder, disk, rod, segment, sphere
from mbd.bodies.link import Link
from mbd.bodies.marker import Marker
from mbd.bodies.mass import MassProperties
from mbd.bodies.point_mass import PointMass
from mbd.bodies.rigid_body import RigidBody

__all__ = [
    "Body", "Domain", "Frame", "Ground", "Link", "Marker", "MassProperties", "Parameterized", "PointMass", "RigidBody",
    "Solid", "box", "cylinder", "disk", "rod", "segment", "sphere",
]  # fmt: skip
