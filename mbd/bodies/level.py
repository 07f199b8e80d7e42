"""The height at which joints hold a body of a planar mechanism."""

from mbd.bodies.algebra import IDENTITY, Rotation, Triple
from mbd.bodies.base import Frame, ParameterSource
from mbd.dataclass import dataclass
from mbd.tape.node import Scalar


@dataclass(frozen=True, repr=False)
class Level(Frame):
    """The origin of the ground raised to the height of a body: z is summed up along the joints that lead there.

    Its height follows the run-time parameters of the frames of these joints and has none of its own.

    Parameters
    ----------
    steps : of each joint on the way, its frame nearer to the ground and the other one
    """

    steps: tuple[tuple[Frame, Frame], ...] = ()

    def placement(self, scope: ParameterSource) -> tuple[Rotation, Triple]:
        """No turn, and the height."""
        z: Scalar = 0.0
        for near, far in self.steps:
            z = z + near.placement(scope)[1][2] - far.placement(scope)[1][2]
        return IDENTITY, (0.0, 0.0, z)

    def parameters(self) -> dict[str, float]:
        """None of its own."""
        return {}
