"""Results of users' own: traced last, on all that the equations know, so that nothing of the motion depends on them."""

from collections.abc import Iterable, Sequence

from mbd.bodies.base import Frame
from mbd.bodies.scope import FrameMotion, JointMotion, Scope
from mbd.constraints.observation import Observation
from mbd.equations.coordinate_scope import CoordinateScope
from mbd.equations.derivation_context import DerivationContext
from mbd.equations.derivation_scope import DerivationScope
from mbd.equations.outputs import AXES, Outputs
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.tape.derivatives import live
from mbd.tape.node import Node, Scalar, Table

UNSTEADY = {"a": "accelerations", "s": "rates of first-order states", "lam": "forces of constraints"}
"""Inputs whose rates the equations do not give."""


def offer_observations(
    outputs: Outputs, scope: DerivationContext | CoordinateScope, observations: Iterable[Observation]
) -> None:
    """The observations of a model, each of which may ask for the results before it.

    Raises
    ------
    ModelError
        for a name that the results have already, for what a function asks for and the model does not have, and for a
        function that gives no numbers.
    """
    for observation in observations:
        own = [observation.name, *(f"{observation.name}.{axis}" for axis in AXES)]
        taken = [name for name in own if name in outputs]
        if taken:
            raise ModelError(
                f"observation '{observation.name}': the results have {taken[0]!r} already; give another name"
            )
        found = observation.value(_ObservingScope(outputs, scope, observation.name), scope.real)
        if isinstance(found, Node):
            outputs.value(observation.name, found)
            continue
        for axis, part in zip(AXES, found, strict=True):
            outputs.value(f"{observation.name}.{axis}", part)


class _ObservingScope(Scope):
    """A `Scope` in which every result has its name, and which adds no parameters, tables or states."""

    def __init__(self, outputs: Outputs, scope: DerivationScope, name: str) -> None:
        self._outputs, self._scope, self._what = outputs, scope, f"observation '{name}'"
        self.tape = scope.tape

    @property
    def time(self) -> Node:
        return self._scope.time

    def inertia(self, coordinates: Sequence[str]) -> tuple[Sequence[Sequence[Node]], Sequence[Node]]:
        return self._scope.inertia(coordinates)

    def state_names(self, mode: str) -> Sequence[str]:
        return self._scope.state_names(mode)

    def frame(self, frame: Frame) -> FrameMotion:
        unknown = [name for name in frame.parameters() if name not in self._scope.parameters]
        if unknown:
            raise ModelError(
                f"{self._what} asks for '{frame.full_name}', which the model does not know; name the point, as in "
                f"{frame.body.name}.point(x, y, name='…'), or pass the frame as an argument of observe"
            )
        return self._scope.frame(frame)

    def joint(self, name: str) -> JointMotion:
        return self._scope.joint(name)

    def named(self, name: str) -> Node:
        if name in self._outputs:
            return self._outputs(name)
        if name in self._scope.parameters:
            return self._scope.parameters[name]
        if not isinstance(self._scope, CoordinateScope) or not self._scope.knows(name):
            raise UnknownNameError(f"{self._what}: " + nearest(name, self._outputs.names(), "result"))
        return self._scope.named(name)

    def rate(self, value: Scalar) -> Node:
        """d/dt of a function of the posture, the velocities and the time."""
        whole = self._scope.real(value)
        kinds = {node.data[0] for node in live([whole]) if node.op == "input"}
        unsteady = [words for kind, words in UNSTEADY.items() if kind in kinds]
        if unsteady:
            raise ModelError(f"{self._what} asks for the rate of a function of {unsteady[0]}, which nothing tells")
        return self._scope.change(value)

    def parameter(self, owner: str, field: str, value: float) -> Node:
        name = f"{owner}.{field}"
        if name not in self._scope.parameters:
            raise ModelError(f"{self._what} asks for the parameter {name!r}, which the model has not; write the number")
        return self._scope.parameters[name]

    def table(
        self,
        owner: str,
        breaks: Sequence[float],
        coefficients: Sequence[Sequence[float]],
        jumps: Sequence[int] | None = None,
    ) -> Table:
        raise ModelError(f"{self._what} takes no samples; look them up in the results instead")

    def state(self, owner: str, field: str, initial: float) -> Node:
        raise ModelError(f"{self._what} has no states; a force, a loss or a law of one's own has")
