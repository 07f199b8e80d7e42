"""Results of one's own: functions of the motion that runs are asked for by name."""

from collections.abc import Callable
from typing import Any

from mbd.bodies.base import Frame
from mbd.bodies.scope import Scope
from mbd.bodies.values import name_of
from mbd.constraints.expressions import is_expression, plain, quantities_in
from mbd.constraints.measure import Measure
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.quantities import ArgumentSpec, Mention, arguments_of, mentioned, resolved
from mbd.joints.base import Joint
from mbd.tape.node import Node, Scalar
from mbd.tape.tracing import traced


@dataclass(frozen=True, init=False)
class Observation:
    """A named scalar or vector that results have, and nothing else asks for; see `Description.observe`."""

    name: str
    function: Any
    arguments: ArgumentSpec
    unit: str

    def __init__(self, name: str, function: Any, arguments: tuple[Any, ...] = (), unit: str = "") -> None:
        what = f"observe('{name_of(name, 'observe')}')"
        given = arguments_of(arguments, what)
        numbers = [label for label, value in given if isinstance(value, float)]
        if numbers:
            raise ModelError(f"{what}: the number {numbers[0]!r} belongs into the function; it has no parameters")
        if not isinstance(unit, str):
            raise ModelError(f"{what}: unit is a text such as 'm/s', got {unit!r}")
        if not (isinstance(function, Measure | str) or callable(function) or is_expression(function)):
            raise ModelError(
                f"{what} takes a function, a sympy expression, a measure such as mbd.height(shank.end), or the name of "
                f"a result; got {function!r}"
            )
        if given and isinstance(function, Measure | str):
            raise ModelError(f"{what}: a measure and a name take no arguments; leave {given[0][0]!r} out")
        if is_expression(function) and not given:
            function = plain(function)
            given = arguments_of(quantities_in([function]), what)
        put = object.__setattr__
        put(self, "name", name)
        put(self, "function", function)
        put(self, "arguments", given)
        put(self, "unit", unit or (function.unit if isinstance(function, Measure) else ""))

    def mentions(self) -> list[Mention]:
        """The frames, joints and names that it refers to, of those that it tells."""
        if isinstance(self.function, str):
            return [self.function]
        return self.function.mentions() if isinstance(self.function, Measure) else mentioned(self.arguments)

    def frames(self) -> list[Frame]:
        """The frames among them."""
        return [mention for mention in self.mentions() if isinstance(mention, Frame)]

    def faults(self, bodies: Any, joints: Any) -> list[str]:
        """Frames and joints that the model has not, one sentence each."""
        found = []
        for mention in self.mentions():
            if isinstance(mention, Frame) and mention.body.name not in bodies:
                found.append(
                    f"observation '{self.name}' refers to '{mention.full_name}' of a body that no joint connects"
                )
            if isinstance(mention, Joint) and mention.name not in joints:
                found.append(f"observation '{self.name}' refers to the joint '{mention.name}', which is not connected")
        return found

    def value(self, scope: Scope, real: Callable[[Scalar], Node]) -> Node | tuple[Node, ...]:
        """One scalar, or three components (of two, the third is 0).

        Raises
        ------
        TraceError, ModelError
            for a function that gives anything else, or asks for what there is not.
        """
        what = f"observation '{self.name}'"
        if isinstance(self.function, Measure):
            return real(self.function.gap(scope))
        if isinstance(self.function, str):
            return real(scope.named(self.function))
        given = self.function if self.arguments or is_expression(self.function) else _OfScope(self.function, scope)
        found = traced(given, resolved(self.arguments, scope, self.name), what, scope.tape)
        if isinstance(found, Node):
            return real(found)
        if len(found) not in (2, 3):
            raise ModelError(f"{what}: one number or three components (or two, x and y) are expected, got {len(found)}")
        return tuple(real(part) for part in found) if len(found) == 3 else (*map(real, found), scope.tape.zero)


class _OfScope:
    """A user's function of the scope as one without arguments, under its own name and place for errors."""

    def __init__(self, function: Any, scope: Scope) -> None:
        self._function, self._scope = function, scope
        self.__name__ = getattr(function, "__name__", type(function).__name__)
        self.__code__ = getattr(function, "__code__", None)

    def __call__(self) -> Any:
        return self._function(self._scope)
