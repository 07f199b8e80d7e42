"""What users may give in place of a number, as type checkers and editors see it; values are checked when they come."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, TypeAlias

from numpy.typing import NDArray


class Expression(Protocol):
    """An expression of sympy."""

    @property
    def free_symbols(self) -> Any: ...


Function: TypeAlias = Callable[..., Any] | Expression
"""A function of named quantities, or an expression of them."""

NumberByMode: TypeAlias = float | Mapping[str, float]
"""A number, or one for each state of a mode."""

Numbers: TypeAlias = Sequence[float] | NDArray[Any]
"""Two or three components of a vector, or all numbers of an array."""

GivenInertia: TypeAlias = float | Numbers | Sequence[Numbers]
"""A number about z, three or six numbers, or a 3 × 3 matrix."""
