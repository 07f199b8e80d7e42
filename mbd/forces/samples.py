"""Signals sampled in time, and the curves that go through them."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.bodies.scope import Scope
from mbd.bodies.values import among, flag, number, numbers, shown
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.scipy_curves import curves_of
from mbd.forces.smoothing import smoothed
from mbd.notes import doubt
from mbd.tape.interpolation import Pieces, hold, linear, monotone, spline
from mbd.tape.node import Node, Scalar
from mbd.tape.table import Table

KINDS = ("spline", "smooth", "monotone", "linear", "hold")
"""Curves through samples."""
ENDS = ("not-a-knot", "natural", "clamped")
"""What determines the first and the last cubic of a spline."""
MOTION = ("spline", "smooth")
"""Curves with an acceleration, which may drive a motion."""
JUMPS = {"spline": 3, "smooth": 3, "monotone": 2, "linear": 1, "hold": 0}
"""The lowest derivative that jumps at the samples."""
END_RTOL = 64.0 * sys.float_info.epsilon
"""How far behind its last sample a curve still continues: a run that ends there ends on it, relative [-]."""


@dataclass(frozen=True, init=False)
class Samples:
    """A signal sampled in time, constant before its first sample and after its last, or repeated for ever.

    Parameters
    ----------
    time : (n,) increasing [s]
    values : (n,) samples, or (n, k) of k components
    kind : the curve through the samples

        - 'spline': cubics with a continuous second derivative, so that a motion they drive has an acceleration;
        - 'smooth': a spline that passes near noisy samples (`mbd.forces.smoothing`), whose second derivative is
          unreliable near the ends, for 0.5/cutoff or three samples;
        - 'monotone': cubics with a continuous slope that rise where the samples rise and overshoot nowhere;
        - 'linear': straight lines; 'hold': each sample until the next one comes.

        By default a spline where samples drive a motion or are called in a function, and monotone where they are
        themselves a force, a torque or a voltage.
    periodic : whether the signal repeats itself, with the period from the first time to the last, as data of a gait
        cycle do; the last value is the first
    ends : of a spline that does not repeat: 'not-a-knot'; 'natural', without curvature; 'clamped', at rest
    cutoff : of 'smooth', the frequency [Hz] of a Butterworth filter without lag in place of generalized
        cross-validation; the times must be evenly spaced

    Called with a time, also inside functions that are recorded, it gives its value there:

    >>> angle = Samples([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 8.0, 27.0])
    >>> print(f"{angle(1.5):.6f}")
    3.375000
    """

    time: tuple[float, ...]
    values: tuple[Any, ...]
    kind: str | None = None
    periodic: bool = False
    ends: str = "not-a-knot"
    cutoff: float | None = None
    given: Pieces | None = None

    def __init__(
        self,
        time: Any,
        values: Any,
        kind: str | None = None,
        periodic: bool = False,
        ends: str = "not-a-knot",
        cutoff: float | None = None,
    ) -> None:
        try:
            table = np.asarray(values, dtype=float)
        except (TypeError, ValueError, OverflowError):
            raise ModelError(
                f"values of Samples must be numbers, one for each time or a row (x, y, z) for each; got {shown(values)}"
            ) from None
        put = object.__setattr__
        put(self, "time", numbers(time, "times of Samples"))
        if kind is not None and among(kind, ("cubic",)):
            doubt("kind='cubic' of Samples is called 'monotone' now; 'spline' has a continuous second derivative")
            kind = "monotone"
        if not among(kind, (None, *KINDS)):
            raise ModelError(f"kind of Samples is {', '.join(map(repr, KINDS[:-1]))} or 'hold', got {kind!r}")
        if not among(ends, ENDS):
            raise ModelError(f"ends of Samples is 'not-a-knot', 'natural' or 'clamped', got {ends!r}")
        if table.ndim not in (1, 2) or len(table) != len(self.time):
            raise ModelError(
                f"Samples needs as many values as times; got {len(self.time)} times and values of shape {table.shape}"
            )
        if len(table) == 0:
            raise ModelError("Samples needs one time and value at least, got none")
        rows: Any = table.tolist()
        put(self, "values", tuple(rows if table.ndim == 1 else map(tuple, rows)))
        put(self, "kind", kind)
        put(self, "periodic", flag(periodic, "periodic of Samples"))
        put(self, "ends", ends)
        put(self, "cutoff", None if cutoff is None else number(cutoff, "cutoff of Samples"))
        put(self, "given", None)
        if ends != ENDS[0] and (self.periodic or kind not in (None, *MOTION)):
            raise ModelError(f"ends={ends!r} of Samples is of a spline that does not repeat; leave it out")
        if cutoff is not None and kind != "smooth":
            raise ModelError(f"cutoff of Samples is for kind='smooth', got kind={kind!r}")
        if self.periodic and (len(rows) < 3 or self.values[0] != self.values[-1]):
            raise ModelError(
                "Samples that repeat need three values at least, of which the last is the first; got "
                f"{len(rows)}, from {shown(self.values[0])} to {shown(self.values[-1])}"
            )
        for part in self.components:
            part.pieces(MOTION[0])

    @classmethod
    def of(cls, curve: Any, what: str = "Samples.of") -> Samples | tuple[Samples, ...]:
        """The signal of a curve of `scipy.interpolate` of degree 3 at most, a tuple for one of several components.

        Outside its breaks it continues as scipy's does: along its first and last polynomial, periodically, or, with
        extrapolate=False, at its first and last value.

        Raises
        ------
        ModelError
            for curves that are no piecewise cubics; the message says what to take in their place.
        """
        found = []
        for part in curves_of(curve, what):
            made = object.__new__(cls)
            fields = {
                "time": part.time, "values": part.values, "kind": part.kind, "periodic": part.periodic,
                "ends": ENDS[0], "cutoff": None, "given": part.pieces,
            }  # fmt: skip
            for name, value in fields.items():
                object.__setattr__(made, name, value)
            found.append(made)
        return found[0] if len(found) == 1 else tuple(found)

    @property
    def components(self) -> tuple[Samples, ...]:
        """Each component as a signal of its own."""
        if not isinstance(self.values[0], tuple):
            return (self,)
        more = self.periodic, self.ends, self.cutoff
        return tuple(Samples(self.time, column, self.kind, *more) for column in zip(*self.values, strict=True))

    def pieces(self, otherwise: str) -> Pieces:
        """Breaks and rows of coefficients as the tape stores them; `otherwise` is the kind where none was given."""
        if self.given is not None:
            return self.given
        known: dict[str, Pieces] = self.__dict__.setdefault("_pieces", {})
        kind = self.kind or otherwise
        if kind not in known:
            known[kind] = self._made(kind)
        return known[kind]

    def _made(self, kind: str) -> Pieces:
        time, values = self.time, self.values
        if kind == "smooth":
            values = smoothed(time, values, self.cutoff, self.periodic)
        if kind in MOTION:
            return self._behind(spline(time, values, "periodic" if self.periodic else self.ends, "Samples"))  # type: ignore[arg-type]
        if kind == "hold":
            return hold(time, values, "Samples")
        through = linear if kind == "linear" else monotone
        if not self.periodic:
            return self._behind(through(time, values, "constant", "Samples"))
        period = time[-1] - time[0]  # a sample of the period before and one of that after give equal slopes
        time = (time[-2] - period, *time, time[1] + period)
        return through(time, (values[-2], *values, values[1]), "constant", "Samples")

    def _behind(self, pieces: Pieces) -> Pieces:
        """The last curve goes on for some round-off, so that a run up to the last sample ends on it."""
        if self.periodic:
            return pieces
        return pieces._replace(breaks=(*pieces.breaks[:-1], behind(pieces.breaks[1], pieces.breaks[-1])))

    def table(self, scope: Any, owner: str, otherwise: str) -> Table:
        """Its table on a scope or tape, with the derivatives that jump at its samples."""
        pieces, inside = self.pieces(otherwise), JUMPS[self.kind or otherwise]
        jumps = [inside] * (len(pieces.breaks) - 1)
        if self.given is not None:
            jumps = []
        elif not self.periodic:
            rest = inside > 1 and self.ends == "clamped"
            jumps[0] = jumps[-1] = min(inside, 2 if rest else 1)
        made: Table = scope.table(owner, *pieces, jumps or None)
        return made

    def signal(self, scope: Scope, owner: str, otherwise: str = "monotone") -> Scalar:
        """Its value at the time t; `otherwise` is the kind where none was given."""
        return self._at(scope.tape, self.table(scope, owner, otherwise), scope.time)

    def _at(self, tape: Any, table: Table, time: Scalar) -> Node:
        if self.periodic:
            time = tape.phase(time, self.time[0], self.time[-1] - self.time[0])
        value: Node = tape.lookup(table, time)
        return value

    def __call__(self, time: Any, derivative: int = 0) -> Any:
        """Its value at a time, or a derivative of it: of a traced value, a number or an array [s].

        Several components give a tuple, or an array with one more axis behind.
        """
        if isinstance(time, Node):
            if derivative:
                raise ModelError("Samples in a function gives its value only; derivatives are taken of the function")
            parts = [each._at(time.tape, each.table(time.tape, "Samples", MOTION[0]), time) for each in self.components]
            return tuple(parts) if isinstance(self.values[0], tuple) else parts[0]
        times = np.asarray(time, dtype=float)
        if self.periodic:
            times = self.time[0] + np.mod(times - self.time[0], self.time[-1] - self.time[0])
        columns = []
        for each in self.components:
            table = Table("Samples", *each.pieces(MOTION[0]))
            columns.append(np.vectorize(table.value, otypes=[float])(times, derivative))
        found = columns[0] if not isinstance(self.values[0], tuple) else np.stack(columns, axis=-1)
        return float(found) if found.ndim == 0 else found

    def require_motion(self, what: str, rate: bool = False) -> None:
        """Raise a `ModelError` where it has no acceleration that a constraint could ask for.

        rate : whether it prescribes a rate, which may have kinks: its acceleration jumps there, which is a doubt
        """
        if self.kind in (None, *MOTION):
            return
        cure = "use kind='spline', the default here, or kind='smooth' for noisy data"
        if not rate or self.kind == "hold":
            level = "rate" if rate or self.kind == "hold" else "second derivative"
            raise ModelError(
                f"{what}: Samples of kind {self.kind!r} have no {level} at their samples, where a constraint asks for "
                f"accelerations; {cure}"
            )
        doubt(f"{what}: accelerations jump at every sample of kind {self.kind!r}; {cure}")


def behind(first: float, last: float) -> float:
    """Just behind the last sample."""
    return last + END_RTOL * max(abs(first), abs(last))


def in_degrees(values: Sequence[float] | Vector) -> float:
    """By how much an angle swings to and fro [rad], if by more than a turn, as joints do in degrees only; else 0."""
    if len(values) < 3:
        return 0.0
    swing = float(np.ptp(values))
    there_and_back = swing > math.tau and float(np.sum(np.abs(np.diff(values)))) > 1.5 * swing
    return swing if there_and_back else 0.0
