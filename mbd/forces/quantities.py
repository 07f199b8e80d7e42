"""Quantities that users give: numbers, functions of named things, expressions, or samples in time."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mbd.bodies.base import Frame
from mbd.bodies.by_mode import ByMode
from mbd.bodies.given import Function
from mbd.bodies.scope import Scope
from mbd.bodies.values import is_number, is_several, number
from mbd.errors import ModelError, UnknownNameError
from mbd.forces.inertia import InertialArgument
from mbd.forces.samples import Samples
from mbd.forces.scipy_curves import is_curve
from mbd.joints.base import Joint
from mbd.tape.node import Scalar
from mbd.tape.tracing import Argument, traced, traced_scalar

INCREMENT_PREFIX = "+"
"""Before the name of a law among the tunable parameters: what is added to it is an input, see `law_names`."""

Quantity: TypeAlias = float | Function | Samples
"""A number, a function of the arguments, an expression, a curve of scipy, or samples in time."""

QuantityTriple: TypeAlias = Sequence[Quantity] | NDArray[Any] | Function | Samples
"""Three components (two are x and y), or one function or table that gives them all."""

Mention: TypeAlias = Frame | Joint | str
"""What a word refers to: a frame, a joint, or the name of a quantity."""

ArgumentSpec: TypeAlias = tuple[tuple[str, Mention | float | InertialArgument], ...]
"""(label, what it stands for): the name of a quantity, a frame, a joint (its coordinates), a number, M or h."""


def is_single(value: Any) -> bool:
    """Whether a quantity has one component for certain; that of a function shows when it is traced."""
    if isinstance(value, Samples):
        return len(value.components) == 1
    return is_number(value) or (hasattr(value, "free_symbols") and not hasattr(value, "shape"))


def quantity_of(value: Any, what: str) -> Any:
    """A quantity as users may give it, checked at the border; numbers become floats."""
    if is_number(value):
        return number(value, what)
    if is_curve(value):
        curve = Samples.of(value, what)
        if isinstance(curve, tuple):
            raise ModelError(f"{what}: a curve of one component is expected, got {len(curve)}")
        return curve
    if isinstance(value, Samples):
        if len(value.components) != 1:
            raise ModelError(f"{what}: samples of one component are expected, got {len(value.components)}")
        return value
    if callable(value) or hasattr(value, "free_symbols"):
        return value
    raise ModelError(f"{what} must be a number, a function, a sympy expression or mbd.Samples, got {value!r}")


def triple_of(value: Any, what: str) -> Any:
    """Three components (two are x and y), each a quantity; or one function or table that gives them all."""
    if isinstance(value, Samples):
        parts = value.components
    elif is_curve(value):
        curve = Samples.of(value, what)
        parts = curve if isinstance(curve, tuple) else (curve,)
    elif isinstance(value, Sequence | np.ndarray) and not isinstance(value, str):
        parts = tuple(value)
    elif callable(value):
        return value
    elif hasattr(value, "free_symbols") and hasattr(value, "shape"):
        parts = tuple(value)
    else:
        raise ModelError(f"{what} must be three components, a function or mbd.Samples; got {value!r}")
    if len(parts) not in (2, 3):
        raise ModelError(f"{what} must have three components (or two, x and y), got {len(parts)}")
    whole = parts if len(parts) == 3 else (*parts, 0.0)
    return tuple(quantity_of(part, f"{what}, component {axis}") for part, axis in zip(whole, "xyz", strict=True))


def arguments_of(values: Any, what: str) -> ArgumentSpec:
    """Arguments as users may give them: names, frames, joints, ``(label, one of these or a number)``, or a mapping."""
    entries = list(values.items()) if isinstance(values, Mapping) else [values] if isinstance(values, str) else values
    if not is_several(entries) or isinstance(entries, Samples):
        raise ModelError(f"{what}: arguments must be a list such as ('t', 'left hip.angle'), got {values!r}")
    result: list[tuple[str, Mention | float | InertialArgument]] = []
    for entry in entries:
        label, value = entry if isinstance(entry, tuple) and len(entry) == 2 else (None, entry)
        if isinstance(value, InertialArgument):
            result.append((str(label or value.label), value))
        elif isinstance(value, Frame | Joint | str):
            result.append((str(label or _label(value)), value))
        elif is_number(value) and label is not None:
            result.append((str(label), number(value, f"{what}, argument {label!r}")))
        else:
            raise ModelError(
                f"{what}: an argument is a name such as 't' or 'left hip.angle', a frame, a joint, or a pair (label, "
                f"number) that becomes a parameter; got {entry!r}"
            )
    return tuple(result)


def _label(value: Mention) -> str:
    if isinstance(value, str):
        return value
    return value.full_name if isinstance(value, Frame) else value.name


def mentioned(arguments: ArgumentSpec) -> list[Mention]:
    """The frames, joints and names among the arguments."""
    return [value for _, value in arguments if isinstance(value, Frame | Joint | str)]


def _named(scope: Scope, name: str) -> Scalar | tuple[Scalar, ...]:
    """A named quantity; the components of a vector, such as a place or an angular velocity."""
    try:
        return scope.named(name)
    except UnknownNameError:
        for axes in ("wxyz", "xyz"):
            try:
                return tuple(scope.named(f"{name}.{axis}") for axis in axes)
            except UnknownNameError:
                continue
        raise


def resolved(arguments: ArgumentSpec, scope: Scope, owner: str) -> list[Argument]:
    """The scalars and triples that the arguments stand for."""
    result: list[Argument] = []
    for label, value in arguments:
        if isinstance(value, InertialArgument):
            result.append((label, value.at(scope)))
        elif isinstance(value, Frame):
            result.append((label, scope.frame(value).position))
        elif isinstance(value, Joint):
            coordinates = scope.joint(value.name).coordinates
            result.append((label, coordinates[0] if len(coordinates) == 1 else coordinates))
        elif isinstance(value, str):
            result.append((label, scope.time if value == "t" else _named(scope, value)))
        else:
            result.append((label, scope.parameter(owner, label, value)))
    return result


def scalar(
    value: Any, arguments: ArgumentSpec, scope: Scope, owner: str, field: str, otherwise: str = "monotone"
) -> Scalar:
    """A quantity on the tape; a number is the run-time parameter 'owner.field', of a state 'owner.field.state'.

    otherwise : the kind of samples that were given none
    """
    if isinstance(value, ByMode):
        return value.select(
            scope, f"{field} of '{owner}'",
            lambda state, part: scalar(part, arguments, scope, owner, f"{field}.{state}", otherwise), 0.0,
        )  # fmt: skip
    if is_number(value):
        return scope.parameter(owner, field, float(value))
    if isinstance(value, Samples):
        return value.signal(scope, f"{owner}.{field}", otherwise) + scope.increment(owner, field)
    given = resolved(arguments, scope, owner)
    return traced_scalar(value, given, f"{field} of '{owner}'", scope.tape) + scope.increment(owner, field)


def triple_at(value: Any, arguments: ArgumentSpec, scope: Scope, owner: str, field: str) -> tuple[Scalar, ...]:
    """Three components on the tape; numbers are the parameters 'owner.field.x', …, a single torque acts about z."""
    if isinstance(value, ByMode):
        parts: dict[str, tuple[Scalar, ...]] = {}

        def component(k: int, state: str, part: Any) -> Scalar:
            if state not in parts:
                parts[state] = triple_at(part, arguments, scope, owner, f"{field}.{state}")
            return parts[state][k]

        return tuple(value.select(scope, f"{field} of '{owner}'", partial(component, k), 0.0) for k in range(3))
    if isinstance(value, tuple):
        return tuple(
            scalar(part, arguments, scope, owner, f"{field}.{axis}") for part, axis in zip(value, "xyz", strict=True)
        )
    result: Any = traced(value, resolved(arguments, scope, owner), f"{field} of '{owner}'", scope.tape)
    if field.partition(".")[0] == "torque" and not isinstance(result, tuple):
        result = (0.0, 0.0, result)
    if not isinstance(result, tuple) or len(result) not in (2, 3):
        came = f"{len(result)} numbers" if isinstance(result, tuple) else "one number"
        raise ModelError(f"{field} of '{owner}': three components (or two, x and y) are expected, {came} came")
    whole: tuple[Scalar, ...] = result if len(result) == 3 else (*result, 0.0)
    return tuple(part + scope.increment(owner, f"{field}.{axis}") for part, axis in zip(whole, "xyz", strict=True))


def value_parameters(value: Any, arguments: ArgumentSpec, owner: str, field: str) -> dict[str, float]:
    """Run-time parameters of a quantity, of three components, and of its arguments, by full name."""
    result = {f"{owner}.{label}": given for label, given in arguments if isinstance(given, float)}
    if isinstance(value, ByMode):
        for state, part in value.values:
            result |= value_parameters(part, (), owner, f"{field}.{state}")
    if isinstance(value, tuple):
        for part, axis in zip(value, "xyz", strict=True):
            if is_number(part):
                result[f"{owner}.{field}.{axis}"] = float(part)
    elif is_number(value):
        result[f"{owner}.{field}"] = float(value)
    return result


def law_names(value: Any, owner: str, field: str, components: bool = False) -> tuple[str, ...]:
    """Names of quantities that are no numbers, and to which a linearization may add an input.

    components : whether three are wanted, of which one function may give all
    """
    if value is None or is_number(value):
        return ()
    if isinstance(value, ByMode):
        named = (law_names(part, owner, f"{field}.{state}", components) for state, part in value.values)
        return tuple(name for names in named for name in names)
    if not components:
        return (f"{owner}.{field}",)
    parts = value if isinstance(value, tuple) else (None,) * 3
    return tuple(f"{owner}.{field}.{axis}" for part, axis in zip(parts, "xyz", strict=True) if not is_number(part))


class OfQuantities:
    """What words share whose fields are quantities, functions of which are called with `arguments`."""

    name: str
    arguments: Any
    in_components = False
    """Whether a quantity has three components."""

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of the fields that are quantities."""
        raise NotImplementedError

    def parameters(self) -> dict[str, float]:
        """Quantities, components and arguments that are given as numbers."""
        found = value_parameters(None, self.arguments, self.name, "")
        for field in self.quantities:
            found |= value_parameters(getattr(self, field), (), self.name, field)
        return found

    def laws(self) -> tuple[str, ...]:
        """Quantities, or their components, that are no numbers."""
        named = (law_names(getattr(self, each), self.name, each, self.in_components) for each in self.quantities)
        return tuple(name for names in named for name in names)
