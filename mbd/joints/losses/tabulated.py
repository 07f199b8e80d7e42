"""A measured damper."""

from typing import Any

from mbd.bodies.scope import Scope
from mbd.bodies.values import numbers
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.joints.losses.base import Loss
from mbd.tape.interpolation import Pieces, monotone
from mbd.tape.node import Scalar


@dataclass(frozen=True, init=False)
class Tabulated(Loss):
    """F(v) through measured points, by a cubic that keeps their shape (Fritsch & Carlson 1980, scipy's PCHIP).

    ``F(0) = 0`` is added where the table has no rate 0. Beyond its ends F goes on as a straight line with the slope of
    the end, or stays constant where that slope is negative.

    Parameters
    ----------
    rate : (n,) increasing, from ≤ 0 to ≥ 0 [rad/s or m/s]
    torque : (n,) with ``torque · rate ≥ 0`` [N m or N]
    """

    rate: tuple[float, ...]
    torque: tuple[float, ...]

    def __init__(self, rate: Any, torque: Any) -> None:
        object.__setattr__(self, "rate", numbers(rate, "rate of Tabulated"))
        object.__setattr__(self, "torque", numbers(torque, "torque of Tabulated"))
        if len(self.rate) != len(self.torque) or len(self.rate) < 2:
            raise ModelError(
                f"Tabulated needs as many torques as rates, two at least; got {len(self.rate)} rates and "
                f"{len(self.torque)} torques"
            )
        if any(b <= a for a, b in zip(self.rate, self.rate[1:], strict=False)):
            raise ModelError("rates of Tabulated must increase; sort the table and drop repeated rates")

    def fields(self) -> dict[str, float]:
        """None: the table is stored beside the parameters."""
        return {}

    def faults(self, owner: str) -> list[str]:
        """Points at which it would feed energy in, or a table of one sign only."""
        bad = [(v, F) for v, F in zip(self.rate, self.torque, strict=True) if v * F < 0.0 or (v == 0.0 and F != 0.0)]
        faults = [
            f"'{owner}': torque {F:g} at the rate {v:g} is not that of a loss; torque and rate have the same sign, "
            "and the torque at rest is 0"
            for v, F in bad
        ]
        if self.rate[0] > 0.0 or self.rate[-1] < 0.0:
            faults.append(f"'{owner}': its rates have one sign only; give the torque at rates of both signs")
        return faults

    @property
    def is_directed(self) -> bool:
        """Unless each point stands with both signs."""
        points = {(v, F) for v, F in zip(self.rate, self.torque, strict=True)}
        return points != {(-v, -F) for v, F in points}

    def pieces(self) -> Pieces:
        """Breaks and rows of coefficients as the tape stores them."""
        points = dict(zip(self.rate, self.torque, strict=True)) | ({} if 0.0 in self.rate else {0.0: 0.0})
        rates = sorted(points)
        breaks, rows = monotone(rates, [points[v] for v in rates], "linear", "Tabulated")
        first, last = ((row[0], row[1], 0.0, 0.0) if row[1] >= 0.0 else None for row in (rows[0], rows[-1]))
        before, after = (points[rates[0]], 0.0, 0.0, 0.0), (points[rates[-1]], 0.0, 0.0, 0.0)
        return Pieces(breaks, (first or before, *rows[1:-1], last or after))

    def force(self, rate: Scalar, scope: Scope, owner: str) -> Scalar:
        """F(v) looked up."""
        return scope.tape.lookup(scope.table(owner, *self.pieces()), rate)
