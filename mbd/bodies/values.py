"""What users give, checked at the border: finite numbers, triples, axes, names, switches."""

import math
import unicodedata
from collections.abc import Collection, Iterable, Mapping
from typing import Any, TypeAlias

import numpy as np

from mbd.arrays import Vector
from mbd.errors import ModelError

Vector3: TypeAlias = tuple[float, float, float]
"""Three plain numbers, known when the model is described."""


DIRECTION_MARKS = "\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"
"""Signs after which text runs the other way."""


def name_of(name: Any, what: str) -> str:
    """A name: a non-empty string without a dot, because dots part names ('left knee.angle')."""
    if not isinstance(name, str) or not name.strip():
        raise ModelError(f"{what} needs a name as its first argument, such as {what}('left knee', …); got {name!r}")
    if "." in name:
        raise ModelError(f"{what} {name!r}: a name holds no dot, since dots part names as in 'left knee.angle'")
    return printable(name, what)


def printable(name: str, what: str) -> str:
    """A name that can be shown anywhere: what would move a terminal's cursor or turn its text around is no part of one.

    >>> printable("left knee", "Revolute")
    'left knee'
    """
    if not isinstance(name, str) or not name.strip():
        raise ModelError(f"{what} needs a name, such as 'toe'; got {shown(name)[:80]}")
    if name.isascii() and name.isprintable():
        return name
    wrong = [sign for sign in name if unicodedata.category(sign) in ("Cc", "Cs", "Zl", "Zp") or sign in DIRECTION_MARKS]
    if wrong:
        raise ModelError(f"{what} {name!r}: a name holds no control characters such as {wrong[0]!r}; leave them out")
    return name


def is_several(value: Any) -> bool:
    """Whether a value has entries to go through, which a text, a type and an array of no dimension have not."""
    return isinstance(value, Iterable) and not isinstance(value, str | bytes | type) and getattr(value, "ndim", 1) > 0


def names_of(values: Any, what: str) -> tuple[str, ...]:
    """Names given as one or several.

    >>> names_of("left foot", "on of Controller 'knee'")
    ('left foot',)
    """
    several = (values,) if isinstance(values, str) else values
    if is_several(several):
        result = tuple(several)
        if all(isinstance(name, str) and name for name in result):
            return tuple(map(str, result))  # texts of numpy among them
    raise ModelError(f"{what} must be a name or several, such as ('left foot', 'right foot'); got {values!r}")


def flag(value: Any, what: str) -> bool:
    """True or False."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise ModelError(f"{what} must be True or False, got {value!r}")


def among(value: Any, known: Collection[Any]) -> bool:
    """Whether a value is one of some words or numbers; an array is none, and asking it would raise."""
    return isinstance(value, str | int | float | None) and value in known


def is_number(value: Any) -> bool:
    """Whether a value is one real number that a float can hold, finite or not."""
    if not _is_numeric(value):
        return False
    try:
        float(value)
    except (TypeError, ValueError, OverflowError):  # an integer beyond 1.8e308 among them
        return False
    return True


def _is_numeric(value: Any) -> bool:
    """Whether a value may be turned into a float."""
    if type(value) is float:
        return True
    if isinstance(value, bool | np.bool_ | str | type) or not hasattr(value, "__float__"):
        return False
    if np.iscomplexobj(value):  # float() drops imaginary parts
        return False
    return not getattr(value, "ndim", 0) and not getattr(value, "free_symbols", ())


def number(value: Any, what: str) -> float:
    """A finite float.

    >>> number(2, "mass of 'rod'")
    2.0
    """
    if not _is_numeric(value):
        raise ModelError(f"{what} must be a number, got {shown(value)}{_meant(value)}")
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise ModelError(f"{what} must be a number, got {shown(value)}") from None
    except OverflowError:
        raise ModelError(f"{what} must be below 1.8e308, got {shown(value)}") from None
    if not math.isfinite(result):
        raise ModelError(f"{what} must be finite, got {shown(value)}")
    return result


def _meant(value: Any) -> str:
    """The number that a text or a list of one was to be."""
    listed = isinstance(value, list | tuple) and len(value) == 1
    alone = listed or (isinstance(value, np.ndarray) and value.shape == (1,))
    one = value[0] if alone else value
    if isinstance(one, str) or (one is not value and is_number(one)):
        try:
            return f"; give the number itself, {float(one):g}"
        except ValueError:
            pass
    return ""


def size(value: Any, what: str) -> float:
    """A finite float that is not negative: a mass, a length.

    >>> size(2, "radius of a sphere")
    2.0
    """
    result = number(value, what)
    if result < 0.0:
        raise ModelError(f"{what} must not be negative, got {shown(value)}")
    return result


def shown(value: Any) -> str:
    """A value for a message; an integer of thousands of digits is not written out."""
    if isinstance(value, int) and value.bit_length() > 1024:
        return f"an integer of {value.bit_length()} bits"
    try:
        return repr(value)
    except ValueError:  # one of those inside
        return f"a {type(value).__name__} with integers of thousands of digits"


def named_number_faults(values: Any, what: str) -> list[str]:
    """What is wrong with numbers by name, such as ``parameters={'left thigh.mass': 1.0}``."""
    if not isinstance(values, Mapping | None):
        example = "left thigh.mass" if what == "parameters" else "left hip.angle"
        return [f"{what} must map names to numbers, such as {{{example!r}: 0.2}}, not {values!r}"]
    found = []
    for name, value in (values or {}).items():
        if not isinstance(name, str):
            found.append(f"{what}: {name!r} is no name; give names such as 'left hip.angle'")
        elif not is_finite_number(value):
            found.append(f"{what}: the value of {name!r} must be a finite number, not {shown(value)}")
    return found


def names_given(
    value: Any, what: str, of: str = "contacts, such as ['left foot']"
) -> tuple[tuple[str, ...], list[str]]:
    """Names given as one or several."""
    several = (value,) if isinstance(value, str) else tuple(value) if is_several(value) else (value,)
    if all(isinstance(name, str) for name in several):
        return several, []
    return (), [f"{what} lists names of {of}, not {shown(value)}"]


def is_finite_number(value: Any) -> bool:
    """Whether a value is one finite real number."""
    try:
        number(value, "")
    except ModelError:
        return False
    return True


def numbers(values: Any, what: str) -> tuple[float, ...]:
    """A tuple of finite floats."""
    if not is_several(values):
        raise ModelError(f"{what} must be a sequence of numbers, got {values!r}")
    return tuple(number(value, what) for value in values)


def floats(values: Any, what: str) -> Vector:
    """An array of real numbers of any shape, NaN for what is not known.

    >>> floats([1, None], "force")
    array([ 1., nan])
    """
    try:
        if np.iscomplexobj(values):
            raise TypeError
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ModelError(f"{what} must be real numbers, got {shown(values)[:80]}") from None


def triple(values: Any, what: str) -> Vector3:
    """Three finite floats; two are taken as x and y.

    >>> triple((1, 2), "offset")
    (1.0, 2.0, 0.0)
    """
    result = numbers(values, what)
    if len(result) not in (2, 3):
        raise ModelError(f"{what} must have three components (or two, x and y), got {values!r}")
    return (result[0], result[1], result[2] if len(result) == 3 else 0.0)


LETTERS: dict[str, Vector3] = {
    "x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0),
    "-x": (-1.0, 0.0, 0.0), "-y": (0.0, -1.0, 0.0), "-z": (0.0, 0.0, -1.0),
}  # fmt: skip
"""Directions by their letters: 'x', 'y', 'z', '-x', '-y', '-z'."""


def unit_vector(values: Any, what: str) -> Vector3:
    """The direction of a triple, or of an axis by its letter; exact for axes along x, y, z.

    >>> unit_vector((0, 0, -2), "axis"), unit_vector("x", "axis")
    ((0.0, 0.0, -1.0), (1.0, 0.0, 0.0))
    """
    if isinstance(values, str):
        if values not in LETTERS:
            raise ModelError(f"{what} must be a direction such as (0, 0, 1), or 'x', 'y', 'z', '-x' …, got {values!r}")
        return LETTERS[values]
    x, y, z = triple(values, what)
    size = math.hypot(x, y, z)
    if size == 0.0:
        raise ModelError(f"{what} must not be zero; give a direction such as (0, 0, 1)")
    return (x / size + 0.0, y / size + 0.0, z / size + 0.0)
