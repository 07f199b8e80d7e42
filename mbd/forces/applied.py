"""A force or torque applied to a frame."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from mbd.bodies.algebra import rotate
from mbd.bodies.base import Frame
from mbd.bodies.by_mode import by_mode_of, require_use
from mbd.bodies.point_mass import PointMass
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.base import Action, Force, Result, frame_of
from mbd.forces.quantities import (
    Mention,
    OfQuantities,
    Quantity,
    QuantityTriple,
    arguments_of,
    is_single,
    mentioned,
    triple_at,
    triple_of,
)
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Applied(OfQuantities, Force):
    """A force at the origin of a frame and a torque on its body: power ``F·v + T·ω``.

    Its components are those along the axes of the ground, or of another frame, with which it turns then: ``F = R f``.
    A thruster is ``Applied("thrust", rocket.point(0, -1), force=(0, 9e3), axes=rocket.origin)``.

    Parameters
    ----------
    name : its name
    frame : where it acts
    force : three components [N] (two are x and y), each a number, a function, a sympy expression or `Samples`;
        or one function or `Samples` that gives them all
    torque : the same [N m]; a single quantity acts about z
    arguments : what functions are called with, in order: names of quantities ('t', 'left hip.angle'), frames (their
        positions), joints (their coordinates), or (label, number) for a run-time parameter of the function
    by : name of a mode, whose states have forces and torques of their own: ``force={"thrust": (0, 9.0)}, by="phase"``
    axes : the frame along whose axes the components lie, of any body; None: along those of the ground

    Numbers are the run-time parameters 'name.force.x', 'name.torque.z', … Results are 'name.force' [N] and
    'name.torque' [N m], the components as they are given, along those axes.
    """

    name: str
    frame: Frame
    force: QuantityTriple | Mapping[str, QuantityTriple] | None = None
    torque: Quantity | QuantityTriple | Mapping[str, Quantity | QuantityTriple] | None = None
    arguments: Any = ("t",)
    axes: Frame | None = None
    by: str | None = None

    kind = "applied"
    is_external = True
    quantities = ("force", "torque")
    in_components = True

    def __post_init__(self) -> None:
        put = object.__setattr__
        name_of(self.name, "Applied")
        frame_of(self.frame, f"frame of Applied '{self.name}'")
        if self.force is None and self.torque is None:
            raise ModelError(f"Applied '{self.name}' does nothing: give force=(x, y, z), torque=(x, y, z), or both")
        if self.force is not None:
            put(self, "force", by_mode_of(self.force, self.by, f"force of '{self.name}'", triple_of))
        if self.torque is not None:
            put(self, "torque", by_mode_of(self.torque, self.by, f"torque of '{self.name}'", _torque_of))
        require_use(self.by, f"Applied '{self.name}'", self.force, self.torque)
        put(self, "arguments", arguments_of(self.arguments, f"Applied '{self.name}'"))
        if self.axes is not None:
            what = f"axes of Applied '{self.name}'"
            if isinstance(frame_of(self.axes, what).body, PointMass):
                raise ModelError(
                    f"{what}: '{self.axes.body.name}' is a point mass, which has no axes; give a frame of "
                    "a RigidBody or a Link"
                )

    def mentions(self) -> list[Mention]:
        """Its frames, and what its functions are called with."""
        own = [self.frame] if self.axes is None else [self.frame, self.axes]
        return [*own, *mentioned(self.arguments)]

    def act(self, scope: Scope) -> Action:
        """Force on velocity, torque on angular velocity."""
        motion = scope.frame(self.frame)
        pairs: list[tuple[Scalar, Scalar]] = []
        for field, value, velocity in (
            ("force", self.force, motion.velocity),
            ("torque", self.torque, motion.angular_velocity),
        ):
            if value is not None:
                x, y, z = triple_at(value, self.arguments, scope, self.name, field)
                along = (x, y, z) if self.axes is None else rotate(scope.frame(self.axes).rotation, (x, y, z))
                pairs += zip(velocity, along, strict=True)
        return Action(pairs=tuple(pairs))

    def results(self) -> dict[str, Result]:
        """'force' and 'torque', those that it has, along the axes in which they are given."""
        fields = [field for field in ("force", "torque") if getattr(self, field) is not None]
        return {field: Result(partial(self._component, field), is_vector=True) for field in fields}

    def _component(self, field: str, scope: Scope) -> tuple[Scalar, ...]:
        return triple_at(getattr(self, field), self.arguments, scope, self.name, field)


def _torque_of(value: Any, what: str) -> Any:
    """Three components; a single quantity acts about z."""
    return triple_of((0.0, 0.0, value) if is_single(value) else value, what)
