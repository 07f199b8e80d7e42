"""A user's own measure."""

from collections.abc import Sequence
from typing import Any

from mbd.bodies.scope import Scope
from mbd.bodies.values import among
from mbd.constraints.expressions import is_expression, plain, quantities_in
from mbd.constraints.measure import Measure
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.quantities import ArgumentSpec, Mention, arguments_of, mentioned, quantity_of, resolved
from mbd.tape.node import Scalar
from mbd.tape.tracing import traced_scalar


@dataclass(frozen=True)
class UserMeasure(Measure):
    """A function of named quantities; see `measure`."""

    function: Any
    arguments: ArgumentSpec
    length_unit: str = "m"
    tangent_functions: tuple[Any, ...] = ()

    title = "measure"

    def _value(self, function: Any, scope: Scope) -> Scalar:
        return traced_scalar(function, resolved(self.arguments, scope, "measure"), "user's measure", scope.tape)

    def gap(self, scope: Scope) -> Scalar:
        """The function's value."""
        if isinstance(self.function, str):
            return scope.time if self.function == "t" else scope.named(self.function)
        return self._value(self.function, scope)

    @property
    def unit(self) -> str:
        """As given."""
        return self.length_unit

    def mentions(self) -> list[Mention]:
        """What it depends on."""
        return [*([self.function] if isinstance(self.function, str) else []), *mentioned(self.arguments)]

    @property
    def has_tangents(self) -> bool:
        """Whether tangents were given."""
        return bool(self.tangent_functions)

    def captured(self, scope: Scope) -> Sequence[Scalar]:
        """The values of the tangent functions."""
        return [self._value(function, scope) for function in self.tangent_functions]

    def tangents(self, scope: Scope, anchors: Sequence[Scalar]) -> Sequence[tuple[str, Scalar]]:
        """Each tangent function minus its value at closing."""
        slips = [now - then for now, then in zip(self.captured(scope), anchors, strict=True)]
        return [("tangent" if k == 0 else f"tangent {k + 1}", slip) for k, slip in enumerate(slips)]


def measure(function: Any, *arguments: Any, unit: str = "m", tangents: Any = None) -> UserMeasure:
    """A user's own measure: a named quantity, a Python function or a sympy expression.

    ``measure("left hip.angle", unit="rad")``,
    ``measure(lambda p, q: p[1] - q[1], left.end, right.end)``,
    ``measure(lambda a, b: a + b, "left hip.angle", "right hip.angle", unit="rad")``

    Parameters
    ----------
    function : g; it may depend on the posture and the time
    arguments : what it is called with, in order: names of quantities ('t', 'left hip.angle'), frames (their positions),
        joints (their coordinates), or (label, one of these) to match the symbols of an expression. Without them the
        symbols of an expression, or the arguments of a function, are names of quantities themselves: those of a
        `Lagrangian`, ``measure(sympy.cos(theta.q))``
    unit : of g, 'm' or 'rad'
    tangents : functions of the same arguments whose values are held while the contact sticks [m]
    """
    if not among(unit, ("m", "rad")):
        raise ModelError(f"unit of a measure is 'm' or 'rad', got {unit!r}")
    given = arguments_of(arguments, "measure")
    numbers = [label for label, value in given if isinstance(value, float)]
    if numbers:
        raise ModelError(f"measure: the number {numbers[0]!r} belongs into the function; a measure has no parameters")
    if isinstance(function, str):
        if given or tangents is not None:
            raise ModelError(f"measure({function!r}) is a named quantity and takes no arguments and no tangents")
        return UserMeasure(function, (), unit)
    several = () if tangents is None else tangents if isinstance(tangents, tuple | list) else (tangents,)
    if not given:
        function, several = plain(function), tuple(map(plain, several))
        given = arguments_of(quantities_in([function, *several]), "measure")
    if not given:
        raise ModelError("measure: say what the function depends on, such as measure(f, 'left hip.angle')")
    return UserMeasure(
        quantity_of(function, "function of a measure"),
        given,
        unit,
        tuple(quantity_of(tangent, "tangent of a measure") for tangent in several),
    )


def measured(value: Any, what: str, name: str = "a quantity") -> Measure:
    """What a condition watches, checked at the border: a measure, or what `measure` makes one of without arguments.

    Parameters
    ----------
    value : a measure, the name of a quantity, a function or an expression of such names
    what, name : for errors, what it is, "guard of Event 'apex'", and what a name stands for
    """
    if isinstance(value, Measure):
        return value
    if isinstance(value, str) or is_expression(value) or callable(value):
        try:
            return measure(value)
        except ModelError as error:
            raise ModelError(f"{what}: {error}") from error
    raise ModelError(f"{what} is a measure, the name of {name}, or a function of quantities, got {value!r}")
