"""Forces: what drives the motion besides gravity and the joints' own springs and losses."""

from mbd.forces.applied import Applied
from mbd.forces.base import Action, Force
from mbd.forces.bushing import Bushing
from mbd.forces.damper import Damper
from mbd.forces.dc_motor import DCMotor
from mbd.forces.inertia import bias_forces, mass_matrix
from mbd.forces.motor import Motor
from mbd.forces.muscles import Muscle, PolynomialPath, ViaPoint, WrappingCylinder, WrappingEllipsoid, WrappingSphere
from mbd.forces.potential import Potential
from mbd.forces.rotor import Rotor
from mbd.forces.samples import Samples
from mbd.forces.spring import Spring
from mbd.forces.tabulated_spring import TabulatedSpring
from mbd.forces.torsion_spring import TorsionSpring

__all__ = [
    "Action", "Applied", "Bushing", "DCMotor", "Damper", "Force", "Motor", "Muscle", "PolynomialPath", "Potential",
    "Rotor", "Samples", "Spring", "TabulatedSpring", "TorsionSpring", "ViaPoint", "WrappingCylinder",
    "WrappingEllipsoid",
    "WrappingSphere", "bias_forces", "mass_matrix",
]  # fmt: skip
