"""Shifts without turning."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, field

from mbd.bodies.algebra import IDENTITY, ZERO
from mbd.bodies.base import Frame
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.base import Joint, JointLoss, Label
from mbd.joints.parts import place_rows, turn_rows
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Translation(Joint):
    """Shifts along some of the parent's axes: ``R = 1``, ``p = Σ q_k e_k``.

    Parameters
    ----------
    name, parent, child : its name and its two frames
    axes : which of x, y, z are free: 'xy' (default), 'xyz', 'y', …
    loss : friction force of each rate [N], or by label: {'x': Viscous(1.0)}
    stiffness, rest : of a spring, where one axis is free [N/m, m]

    Coordinates: `x`, `y`, `z` [m], those that are free.
    """

    name: str
    parent: Frame
    child: Frame
    axes: str = "xy"
    _: KW_ONLY
    loss: JointLoss = field(default=None, hash=False)
    stiffness: float = 0.0
    rest: float = 0.0

    def __post_init__(self) -> None:
        axes = self.axes
        if not isinstance(axes, str) or not axes or len(set(axes)) < len(axes) or not set(axes) <= set("xyz"):
            raise ModelError(f"axes of '{self.name}' must be some of 'xyz', each once, such as 'xy'; got {axes!r}")
        object.__setattr__(self, "axes", "".join(sorted(axes)))
        self.validate()

    @property
    def labels(self) -> tuple[Label, ...]:
        """`x`, `y`, `z` as far as they are free."""
        return tuple(Label(axis, "m") for axis in self.axes)

    @property
    def is_planar(self) -> bool:
        """No z."""
        return "z" not in self.axes

    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """A shift."""
        p = dict(zip(self.axes, q, strict=True))
        return IDENTITY, (p.get("x", 0.0), p.get("y", 0.0), p.get("z", 0.0))

    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """v = e_k."""
        return [(ZERO, IDENTITY["xyz".index(axis)]) for axis in self.axes]

    def rows(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """No shift along the other axes, no turn."""
        return [row for row in place_rows(p) if row[0] not in self.axes] + turn_rows(R)

    def recover(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[Scalar]:
        """The free components of the place."""
        return [p["xyz".index(axis)] for axis in self.axes]
