"""State and mode: what changes during a run, as values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from mbd.arrays import Vector
from mbd.errors import UnknownNameError, nearest

__all__ = ["Mode", "State"]


def _empty() -> Vector:
    return np.zeros(0)


@dataclass(frozen=True)
class Mode:
    """Which contacts are closed, by name; the rest is open.

    Hashable, so that code made for a mode is found again.
    """

    closed: frozenset[str] = frozenset()

    def __contains__(self, name: str) -> bool:
        return name in self.closed


@dataclass(frozen=True, eq=False)
class State:
    """Where a mechanism is and how it moves.

    Attributes
    ----------
    time : t [s]
    q : (n_q,) coordinates [m, rad]
    v : (n_v,) velocities [m/s, rad/s]
    z : (n_z,) first-order states
    mode : closed contacts
    armed : names of the open contacts that may close; None: decided from the gaps at the start
    anchors : values held since contacts closed (points of touchdown) [m]
    names : coordinate names, in the order of q; velocity_names in the order of v
    moved : how far the assembly moved each named quantity from the value asked for [m, rad, m/s, rad/s]
    parameters : parameter values that differ from the model's
    """

    time: float
    q: Vector
    v: Vector
    z: Vector = field(default_factory=_empty)
    mode: Mode = Mode()
    armed: frozenset[str] | None = None
    anchors: Vector = field(default_factory=_empty)
    names: tuple[str, ...] = ()
    velocity_names: tuple[str, ...] = ()
    moved: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)

    def __getitem__(self, name: str) -> float:
        """A coordinate ('left hip.angle') or a rate ('left hip.angle.rate', 'left hip.rate')."""
        if name in self.names:
            return float(self.q[self.names.index(name)])
        if name in self.velocity_names:
            return float(self.v[self.velocity_names.index(name)])
        short = {
            rate.removesuffix(".rate").rpartition(".")[0] + ".rate": k for k, rate in enumerate(self.velocity_names)
        }
        if name in short:
            return float(self.v[short[name]])
        raise UnknownNameError(nearest(name, [*self.names, *self.velocity_names], "coordinate or rate"))

    def __repr__(self) -> str:
        lines = [f"State at t = {self.time:g} s, closed: {', '.join(sorted(self.mode.closed)) or 'none'}"]
        for values, names in ((self.q, self.names), (self.v, self.velocity_names)):
            lines += [f"  {name:<28} {value: .10g}" for name, value in zip(names, values, strict=False)]
        if self.moved:
            far = max(self.moved.items(), key=lambda item: abs(item[1]))
            lines.append(f"  assembly moved {len(self.moved)} of these; farthest {far[0]!r} by {far[1]:.3g}")
        return "\n".join(lines)
