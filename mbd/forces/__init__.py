"""Forces: what drives the motion besides gravity and the joints' own springs and losses."""

from mbd.forces.applied import Applied
from mbd.forces.base import Action, Force
from mbd.forces.damper import Damper
from mbd.forces.motor import Motor
from mbd.forces.potential import Potential
from mbd.forces.quantities import Samples
from mbd.forces.spring import Spring
from mbd.forces.torsion_spring import TorsionSpring

__all__ = ["Action", "Applied", "Damper", "Force", "Motor", "Potential", "Samples", "Spring", "TorsionSpring"]
