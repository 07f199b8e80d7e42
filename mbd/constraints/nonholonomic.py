"""A user's own constraint on velocities."""

from collections.abc import Sequence
from typing import Any

from mbd.bodies.given import Function
from mbd.bodies.scope import Scope
from mbd.bodies.values import among, is_number, name_of
from mbd.constraints.base import VelocityConstraint
from mbd.constraints.expressions import is_expression, plain, quantities_in
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.quantities import (
    Mention,
    OfQuantities,
    Quantity,
    arguments_of,
    mentioned,
    quantity_of,
    resolved,
    scalar,
)
from mbd.forces.samples import Samples
from mbd.tape.node import Scalar
from mbd.tape.tracing import traced_scalar

TIME = (("t", "t"),)


@dataclass(frozen=True)
class Nonholonomic(OfQuantities, VelocityConstraint):
    """``a(q, t) · v + b(t) = 0`` at all times, a row that need not come from a position.

    ``Nonholonomic("blade", lambda vx, vy, angle: vx * mbd.sin(angle) - vy * mbd.cos(angle),
    arguments=("body.x.rate", "body.y.rate", "body.angle"))``

    Parameters
    ----------
    name : its name
    row : a Python function or sympy expression of the arguments, linear in velocities [unit/s]
    bias : b, a number (the run-time parameter 'name.bias'), a function or sympy expression of t, or `Samples` [unit/s]
    arguments : what the row is called with, in order: names of rates ('body.x.rate', 'blade.start.vx') and of places
        or times, frames (their positions), joints (their coordinates), or (label, any of these or a number); without
        them the symbols of an expression are names themselves, as in `measure`
    unit : 'm' or 'rad', that of the row times seconds

    Results are 'name.force', −λ, by which the constraint gives the power ``force · (a · v)`` [N for 'm', N m for
    'rad'], and 'name.residual', the row's value [unit/s].
    """

    name: str
    row: Function
    bias: Quantity = 0.0
    arguments: Any = ()
    unit: str = "m"

    quantities = ("bias",)

    def __post_init__(self) -> None:
        name_of(self.name, "Nonholonomic")
        put = object.__setattr__
        if is_expression(self.row) and isinstance(self.arguments, tuple | list) and not self.arguments:
            put(self, "row", plain(self.row))
            put(self, "arguments", quantities_in([self.row]))
        put(self, "row", quantity_of(self.row, f"row of '{self.name}'"))
        put(self, "bias", quantity_of(self.bias, f"bias of '{self.name}'"))
        put(self, "arguments", arguments_of(self.arguments, f"Nonholonomic '{self.name}'"))
        if isinstance(self.bias, Samples):
            self.bias.require_motion(f"bias of '{self.name}'", rate=True)
        if is_number(self.row) or isinstance(self.row, Samples):
            raise ModelError(
                f"row of Nonholonomic '{self.name}' must be a function or a sympy expression of rates, got {self.row!r}"
            )
        if not self.arguments:
            raise ModelError(
                f"Nonholonomic '{self.name}': say which rates enter the row, such as "
                "arguments=('body.x.rate', 'body.y.rate', 'body.angle')"
            )
        if not among(self.unit, ("m", "rad")):
            raise ModelError(f"unit of Nonholonomic '{self.name}' is 'm' or 'rad', got {self.unit!r}")

    def rates(self, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """Its one row."""
        given = resolved(self.arguments, scope, self.name)
        row = traced_scalar(self.row, given, f"row of '{self.name}'", scope.tape)
        return [("", row + scalar(self.bias, TIME, scope, self.name, "bias", "spline"))]

    def mentions(self) -> list[Mention]:
        """What its row depends on."""
        return mentioned(self.arguments)
