"""An impulse that acts as a contact closes: push-off, a kick, an actuator that fires at a strike."""

import math
from typing import Any, Literal

from mbd.bodies.algebra import dot, rotate
from mbd.bodies.base import Frame
from mbd.bodies.given import Numbers
from mbd.bodies.point_mass import PointMass
from mbd.bodies.scope import Scope
from mbd.bodies.values import among, name_of, triple
from mbd.constraints.base import Constraint
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import joint_of
from mbd.forces.quantities import Mention, OfQuantities, Quantity, arguments_of, mentioned, quantity_of, scalar
from mbd.joints.base import Joint
from mbd.tape.node import Scalar

ORDERS = ("before", "with", "after")
"""When an impulse acts beside the impact of the contact that it waits for."""


@dataclass(frozen=True)
class Impulse(OfQuantities, Constraint):
    """An impulse P on the mechanism each time a contact closes, as part of the impact problem.

    ``M (v⁺ − v⁻) + Bᵀ Λ = w P``, with w the direction: all rows hold, and contacts push or open.

    before : among the contacts that are closed until then; the contact strikes afterwards, if it still approaches. The
        trailing foot opens where it would have to pull
    with : in one problem with the impact, ``v⁻ + M⁻¹ w P`` in the place of v⁻; with a restitution e it is the speed of
        approach that this leaves
    after : among the contacts that are closed after the impact

    A. D. Kuo, Energetics of actively powered locomotion using the simplest walking model, J. Biomech. Eng. 124 (2002)
    113, pushes off just before the strike.

    Parameters
    ----------
    name : its name
    at : where: a frame (then with a direction), a joint of one coordinate, or the name of a coordinate
    size : P [N s, or N m s about a joint]: a number (the parameter 'name.size'), a function, a sympy expression
    on : name of the contact whose closing it waits for
    direction : of the impulse at a frame, of any length; two components are x and y
    order : 'before', 'with' or 'after'; a restitution acts on the velocity with the impulse, but for 'after'
    axes : the frame along whose axes the direction is, such as that of the trailing leg; None: those of the ground
    arguments : what a function is called with, as for `Applied`; values are those just before the impulse

    The run has an event of kind 'pushed' for each, whose `energy_loss` is less than zero where it drives; the ledger
    books its work ``P w·(v⁻ + v⁺)/2``, less what friction of closed contacts takes of it, under its name and the kind
    'force'; of order 'with' v⁺ is that without the impact, which takes the rest.
    """

    name: str
    at: Joint | Frame | str
    size: Quantity
    on: str
    direction: Numbers | None = None
    order: Literal["before", "with", "after"] = "before"
    axes: Frame | None = None
    arguments: Any = ("t",)

    kind = "impulse"
    quantities = ("size",)

    def __post_init__(self) -> None:
        put, title = object.__setattr__, f"Impulse '{self.name}'"
        name_of(self.name, "Impulse")
        if isinstance(self.at, Frame):
            if self.direction is None:
                raise ModelError(f"{title} at a point needs a direction, such as direction=(0, 1)")
            put(self, "direction", triple(self.direction, f"direction of '{self.name}'"))
            if not any(self.direction):
                raise ModelError(f"direction of '{self.name}' is (0, 0, 0); give the direction in which it pushes")
        elif self.direction is not None or self.axes is not None:
            raise ModelError(f"{title} on a coordinate has no direction and no axes; leave them out")
        elif not isinstance(self.at, str):
            joint_of(self.at, f"at of {title}")
        put(self, "size", quantity_of(self.size, f"size of '{self.name}'"))
        put(self, "arguments", arguments_of(self.arguments, title))
        if not isinstance(self.on, str) or not self.on:
            raise ModelError(f"on of {title} is the name of a contact, such as 'left foot', got {self.on!r}")
        if not among(self.order, ORDERS):
            raise ModelError(f"order of {title} is 'before', 'with' or 'after' the impact, got {self.order!r}")
        if self.axes is not None and (not isinstance(self.axes, Frame) or isinstance(self.axes.body, PointMass)):
            raise ModelError(f"axes of {title} is a frame of a RigidBody or a Link, got {self.axes!r}")

    def mentions(self) -> list[Mention]:
        """Where it acts, and what its size is called with."""
        own: list[Mention] = [self.at] if self.axes is None else [self.at, self.axes]
        return [*own, *mentioned(self.arguments)]

    @property
    def others(self) -> tuple[str, ...]:
        """The contact that it waits for."""
        return (self.on,)

    def pair(self, scope: Scope) -> tuple[Scalar, Scalar]:
        """(velocity along it, P)."""
        size = scalar(self.size, self.arguments, scope, self.name, "size")
        if isinstance(self.at, Joint):
            return scope.joint(self.at.name).rates[0], size
        if isinstance(self.at, str):
            return scope.rate(scope.named(self.at)), size
        direction = triple(self.direction, f"direction of '{self.name}'")
        length = math.sqrt(sum(part * part for part in direction))
        x, y, z = (part / length for part in direction)
        along = (x, y, z) if self.axes is None else rotate(scope.frame(self.axes).rotation, (x, y, z))
        return dot(along, scope.frame(self.at).velocity), size

    @property
    def details(self) -> str:
        """When."""
        return f", {self.order} the impact of '{self.on}'"
