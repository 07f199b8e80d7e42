"""A user's own dissipation function."""

import math

from mbd.bodies.algebra import derivatives_at
from mbd.bodies.given import Function
from mbd.bodies.scope import Scope
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.losses.base import DissipationFunction
from mbd.tape.node import Scalar, Tape
from mbd.tape.tracing import traced_scalar


@dataclass(frozen=True)
class Dissipation(DissipationFunction):
    """``F = ∂D/∂v`` of a user's D(v): a Python function of one scalar, or a sympy expression of one symbol ``rate``.

    Parameters
    ----------
    function : D(v) [W], with ``D'(v) v ≥ 0``; the model's check tries it at rates of both signs
    """

    function: Function

    def __post_init__(self) -> None:
        if not callable(self.function) and not hasattr(self.function, "free_symbols"):
            raise ModelError(
                "Dissipation needs D(v), a function of one rate such as lambda v: 0.5 * c * v**2 or a sympy "
                f"expression of the symbol rate; got {self.function!r}"
            )

    def fields(self) -> dict[str, float]:
        """None: what the function contains is its own."""
        return {}

    def dissipation(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """D(v)."""
        return self._value(rate, owner, scope.tape)

    def _value(self, rate: Scalar, owner: str, tape: Tape) -> Scalar:
        return traced_scalar(self.function, [("rate", rate)], f"dissipation function of '{owner}'", tape)

    def faults(self, owner: str) -> list[str]:
        """Rates at which it would feed energy in, or has no value."""
        for size in (1e-3, 0.1, 1.0, 10.0):
            for rate in (size, -size):
                tape = Tape()
                _, (slope,) = derivatives_at(lambda v, tape=tape: self._value(v, owner, tape), [rate], tape)
                power = slope.data * rate if slope.is_constant else math.nan
                if not power >= 0.0:
                    return [
                        f"'{owner}': its dissipation function gives the power {power:g} W at the rate {rate:g}; "
                        "a loss takes energy out, D'(v) v ≥ 0"
                    ]
        return []
