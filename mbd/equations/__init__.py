"""From words to equations of motion: kinematics, dynamics, constraints, and the programs that integrators call."""

from mbd.equations.derivation import derive
from mbd.equations.equations import Equations

__all__ = ["Equations", "derive"]
