"""No motion at all."""

from collections.abc import Sequence

from mbd.bodies.algebra import IDENTITY, ZERO
from mbd.bodies.base import Frame
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.dataclass import dataclass
from mbd.joints.base import Joint
from mbd.joints.parts import place_rows, turn_rows
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Weld(Joint):
    """Two frames that are one: ``R = 1``, ``p = 0``; without coordinates, hence without a loss.

    Parameters
    ----------
    name, parent, child : its name and its two frames
    """

    name: str
    parent: Frame
    child: Frame

    loss = None

    labels = ()
    is_planar = True

    def __post_init__(self) -> None:
        self.validate()

    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """Nothing."""
        return IDENTITY, ZERO

    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """Nothing."""
        return []

    def rows(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """The points coincide, no turn."""
        return [*place_rows(p), *turn_rows(R)]

    def recover(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[Scalar]:
        """Nothing."""
        return []
