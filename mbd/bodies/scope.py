"""What words may ask while their equations are being derived.

A joint, force or constraint describes its mechanics as plain Python on scalars; the
derivation hands it a `Scope`, through which it sees parameters, motions and named quantities.
All vectors are triples of scalars in ground axes, rotations are rows of a 3×3 matrix.
"""

from collections.abc import Sequence
from typing import Protocol

from mbd.bodies.algebra import Rotation, Triple
from mbd.bodies.base import Frame, ParameterSource
from mbd.dataclass import dataclass
from mbd.tape.node import Node, Scalar, Table, Tape

__all__ = ["FrameMotion", "JointMotion", "Rotation", "Scope", "Triple"]


@dataclass(frozen=True)
class FrameMotion:
    """Where a frame is and how it moves, in ground axes.

    position [m], rotation (columns are the frame's axes), velocity [m/s], angular_velocity [rad/s].
    """

    position: Triple
    rotation: Rotation
    velocity: Triple
    angular_velocity: Triple


@dataclass(frozen=True)
class JointMotion:
    """Coordinates of a joint and their rates, in the order of `Joint.labels`; for a cut joint they are recovered."""

    coordinates: tuple[Scalar, ...]
    rates: tuple[Scalar, ...]


class Scope(ParameterSource, Protocol):
    """The derivation as words see it."""

    tape: Tape

    @property
    def time(self) -> Node:
        """t [s]."""

    def table(
        self,
        owner: str,
        breaks: Sequence[float],
        coefficients: Sequence[Sequence[float]],
        jumps: Sequence[int] | None = None,
    ) -> Table:
        """A piecewise cubic stored beside the parameters; evaluate it with ``scope.tape.lookup(table, x)``.

        jumps : the lowest derivative that jumps at each break but the first; by default it is measured
        """
        return self.tape.table(owner, breaks, coefficients, jumps)

    def increment(self, owner: str, field: str) -> Scalar:
        """What is added to the law ``owner.field`` where an analysis asks for it as an input; 0 otherwise."""
        return 0.0

    def frame(self, frame: Frame) -> FrameMotion:
        """Motion of a frame of any body, or of the ground."""

    def joint(self, name: str) -> JointMotion:
        """Coordinates and rates of a joint."""

    def rate(self, value: Scalar) -> Node:
        """d/dt of a function of the posture and the time: ġ of a gap g."""

    def named(self, name: str) -> Node:
        """Any named quantity: 't', 'left hip.angle', 'left hip.rate', 'left shank.end.x', 'left shank.end.vx', …"""

    def state_names(self, mode: str) -> Sequence[str]:
        """The states of a mode, whose number is the named quantity `mode`."""

    def inertia(self, coordinates: Sequence[str]) -> tuple[Sequence[Sequence[Node]], Sequence[Node]]:
        """M and h of some coordinates, ``M q̈ + h = τ``."""

    def state(self, owner: str, field: str, initial: float) -> Node:
        """A first-order state z of the owner (registered on first use); its rate is given in `Action.rates`."""
