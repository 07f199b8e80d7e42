"""The ground: what everything is connected to in the end."""

from mbd.bodies.algebra import ZERO, Triple
from mbd.bodies.base import Body, Parameter, ParameterSource
from mbd.bodies.mass import MassProperties
from mbd.dataclass import dataclass


@dataclass(frozen=True)
class Ground(Body):
    """The frame that does not move: x forward, y up, z to the right of the walker."""

    name: str = "ground"

    def fields(self) -> dict[str, float]:
        """None."""
        return {}

    def landmarks(self, parameter: Parameter) -> dict[str, Triple]:
        """`origin`."""
        return {"origin": ZERO}

    def mass_properties(self, scope: ParameterSource) -> MassProperties:
        """Zero: the ground does not move, so its mass enters nowhere."""
        return MassProperties()
