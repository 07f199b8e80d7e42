"""The configuration of a mechanism: coordinates q (n_q) and velocities v (n_v), and how one moves the other.

Coordinates of most joints form a vector: n_q = n_v, ``q ⊕ x = q + x``, ``q̇ = v``. Those of others, such as a unit
quaternion for the orientation of a ball joint, lie on a manifold, with n_q ≥ n_v. Around an accepted q₀ they are
described by a local increment x (n_v), the chart of a step:

    q = q₀ ⊕ x,   x = q ⊖ q₀,   v = D(x) ẋ,   ẋ = D(x)⁻¹ v,   D(0) = 1,   q̇ = N(q) v = ∂(q ⊕ x)/∂x · v at x = 0

On the rotation group with v in body axes and ``R = R₀ exp(x̂)``, D is the right tangent operator
``T(x) = 1 − (1−cos θ)/θ² x̂ + (θ−sin θ)/θ³ x̂²``, θ = |x|. Equations are exact at any x of a chart: B and generalized
forces are derivatives along velocities, at ``q₀ ⊕ x``; Newton's matrices are derivatives by x, larger by D.

What schemes make of it, each with the order that it has where coordinates add:

- The Newmark family takes ``x = dt v₀ + dt² ((½−β) a₀ + β a₁)``, ``v₁ = v₀ + dt ((1−γ) a₀ + γ a₁)`` (Brüls & Cardona
  2010; Arnold, Brüls & Cardona 2015): ẋ = v + O(|x|) leaves an error of third order in a step, as the scheme does, if
  the part of D⁻¹ that is linear in x is skew in x and v, ``½ [x, v]``, as in the exponential and the Cayley chart.
- Runge–Kutta and Radau stages integrate ``ẋ = D(x)⁻¹ v`` in the chart of the step (Munthe-Kaas 1999), an equation in a
  vector space: its order is kept.
- Between the rows of a run x is interpolated in the chart of the row before, with ẋ and ẍ from D.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.dataclass import dataclass
from mbd.joints.base import Joint


@dataclass(frozen=True, eq=False)
class Configuration:
    """Coordinates and velocities of all joints; arrays may have any number of leading axes.

    Attributes
    ----------
    names, units, defaults : (n_q) of the coordinates
    velocity_names, velocity_units : (n_v) of the velocities
    charts : (joint, first of its coordinates, first of its velocities) of joints whose coordinates do not add
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    defaults: tuple[float, ...]
    velocity_names: tuple[str, ...]
    velocity_units: tuple[str, ...]
    charts: tuple[tuple[Joint, int, int], ...] = ()

    @classmethod
    def of_joints(cls, joints: Sequence[Joint], more: Sequence[tuple[str, str]] = ()) -> Configuration:
        """Coordinates and velocities of joints, in order, followed by `more` coordinates (name, unit) that add."""
        names, units, defaults = list[str](), list[str](), list[float]()
        speeds, speed_units, charts = list[str](), list[str](), list[tuple[Joint, int, int]]()
        for joint in joints:
            if not joint.is_vector:
                charts.append((joint, len(names), len(speeds)))
            names += joint.coordinate_names
            units += [label.unit for label in joint.labels]
            defaults += joint.defaults
            speeds += joint.velocity_names
            speed_units += [label.unit for label in joint.velocity_labels]
        for name, unit in more:
            names.append(name)
            units.append(unit)
            defaults.append(0.0)
            speeds.append(f"{name}.rate")
            speed_units.append(f"{unit}/s")
        return cls(tuple(names), tuple(units), tuple(defaults), tuple(speeds), tuple(speed_units), tuple(charts))

    @classmethod
    def of_vectors(cls, names: Sequence[str], units: Sequence[str], defaults: Sequence[float]) -> Configuration:
        """Coordinates that add, with their rates as velocities."""
        rates = tuple(f"{name}.rate" for name in names)
        return cls(tuple(names), tuple(units), tuple(defaults), rates, tuple(f"{unit}/s" for unit in units))

    @property
    def n_q(self) -> int:
        """Coordinates."""
        return len(self.names)

    @property
    def n_v(self) -> int:
        """Velocities."""
        return len(self.velocity_names)

    @property
    def is_vector(self) -> bool:
        """Whether q ⊕ x is q + x everywhere."""
        return not self.charts

    @cached_property
    def freedoms(self) -> tuple[tuple[str, str], ...]:
        """(name, unit) of each increment: its coordinate's, or 'displacement along ball.spin x'."""
        pairs = zip(self.places, self.velocity_names, self.velocity_units, strict=True)
        return tuple(
            (self.names[place] if place >= 0 else f"displacement along {name}", unit.removesuffix("/s"))
            for place, name, unit in pairs
        )

    @cached_property
    def places(self) -> Any:
        """(n_v,) numbers of the coordinates that have a velocity of their own, −1 for those of charts."""
        found: list[int] = []
        charts = {first_v: (joint, first_q) for joint, first_q, first_v in self.charts}
        q = 0
        while len(found) < self.n_v:
            if len(found) in charts:
                joint, q = charts[len(found)]
                found += [*range(q, q + joint.adding), *[-1] * (len(joint.velocity_labels) - joint.adding)]
                q += len(joint.labels)
            else:
                found.append(q)
                q += 1
        return np.array(found, dtype=np.intp)

    @cached_property
    def velocities_of(self) -> tuple[tuple[int, ...], ...]:
        """(n_q) numbers of the velocities that move each coordinate."""
        found: dict[int, tuple[int, ...]] = {int(q): (v,) for v, q in enumerate(self.places) if q >= 0}
        for joint, first_q, first_v in self.charts:
            own = tuple(range(first_v + joint.adding, first_v + len(joint.velocity_labels)))
            found |= {first_q + k: own for k in range(joint.adding, len(joint.labels))}
        return tuple(found[k] for k in range(self.n_q))

    # the operations -----------------------------------------------------------------------------------------------
    def compose(self, q: Any, x: Any) -> Vector:
        """q ⊕ x (…, n_q)."""
        q, x = np.asarray(q, dtype=float), np.asarray(x, dtype=float)
        if self.is_vector:
            return np.asarray(q + x)
        return self._by_joints("q", lambda joint: joint.compose, (q, "q"), (x, "v"), lambda a, b: a + b)

    def difference(self, q: Any, other: Any) -> Vector:
        """other ⊖ q (…, n_v), the increment x with q ⊕ x = other."""
        q, other = np.asarray(q, dtype=float), np.asarray(other, dtype=float)
        if self.is_vector:
            return np.asarray(other - q)
        return self._by_joints("v", lambda joint: joint.difference, (q, "q"), (other, "q"), lambda a, b: b - a)

    def normalise(self, q: Any) -> Vector:
        """The nearest coordinates that the joints can have (…, n_q)."""
        q = np.asarray(q, dtype=float)
        if self.is_vector:
            return np.asarray(q)
        if q.ndim == 1:  # the same numbers as of many placements at once, in a tenth of the time
            found: Vector = q.copy()
            for joint, first, _ in self.charts:
                own = slice(first, first + len(joint.labels))
                found[own] = joint.normalise(list(q[own]))
            return found
        return self._by_joints(
            "q", lambda joint: lambda own, _: joint.normalise(own), (q, "q"), (q, "q"), lambda a, b: a
        )

    def rates(self, q: Any, v: Any) -> Vector:
        """q̇ = N(q) v (…, n_q)."""
        q, v = np.asarray(q, dtype=float), np.asarray(v, dtype=float)
        if self.is_vector:
            return np.asarray(v)
        return self._by_joints("q", lambda joint: joint.coordinate_rates, (q, "q"), (v, "v"), lambda a, b: b)

    def increment_rates(self, x: Any, v: Any) -> Vector:
        """ẋ = D(x)⁻¹ v (…, n_v)."""
        x, v = np.asarray(x, dtype=float), np.asarray(v, dtype=float)
        if self.is_vector:
            return np.asarray(v)
        return self._by_joints("v", lambda joint: joint.increment_rates, (x, "v"), (v, "v"), lambda a, b: b)

    def increment_velocities(self, x: Any, rates: Any) -> Vector:
        """v = D(x) ẋ (…, n_v)."""
        x, rates = np.asarray(x, dtype=float), np.asarray(rates, dtype=float)
        if self.is_vector:
            return np.asarray(rates)
        return self._by_joints("v", lambda joint: joint.increment_velocities, (x, "v"), (rates, "v"), lambda a, b: b)

    def misplaced(self, q: Vector, tolerance: float) -> list[str]:
        """What is wrong with coordinates (n_q,) that no placement has, one phrase for each joint."""
        found: list[str] = []
        values = np.asarray(q, dtype=float).tolist() if self.charts else []
        for joint, first, _ in self.charts:
            own = values[first : first + len(joint.labels)]
            try:
                near = [float(each) for each in joint.normalise(own)]
            except ZeroDivisionError:  # all parts of a quaternion are zero, or so small that their squares are
                given = ", ".join(f"{x:.9g}" for x in own[joint.adding :])
                names = ", ".join(map(repr, joint.coordinate_names[joint.adding :]))
                found.append(
                    f"{names} = {given}, which is no orientation: a quaternion has length 1, such as (1, 0, 0, 0)"
                )
                continue
            if not all(abs(a - b) <= tolerance for a, b in zip(near, own, strict=True)):
                given, shown = (", ".join(f"{x:.9g}" for x in each[joint.adding :]) for each in (own, near))
                names = ", ".join(map(repr, joint.coordinate_names[joint.adding :]))
                found.append(f"{names} = {given}, which no placement of {joint.known_as} has; the nearest are {shown}")
        return found

    def interpolate(self, q: Any, other: Any, s: Any) -> Vector:
        """``q ⊕ s (other ⊖ q)`` (…, n_q): q at s = 0, the other at s = 1."""
        x = np.asarray(s, dtype=float)[..., np.newaxis] * self.difference(q, other)
        return self.compose(q, x)

    def _by_joints(
        self, target: str, method: Callable[[Joint], Callable[..., Sequence[Any]]], one: tuple[Any, str],
        two: tuple[Any, str], adding: Callable[[Any, Any], Any],
    ) -> Vector:  # fmt: skip
        """A function of two arrays, by each joint's method, and by `adding` where coordinates add."""
        lead = np.broadcast_shapes(one[0].shape[:-1], two[0].shape[:-1])
        a, b = (np.broadcast_to(x, (*lead, x.shape[-1])).reshape(-1, x.shape[-1]) for x, _ in (one, two))
        kind_a, kind_b = one[1], two[1]
        size = self.n_q if target == "q" else self.n_v
        out: Vector = np.empty((len(a), size))
        own_v = np.flatnonzero(self.places >= 0)
        own = {"q": self.places[own_v], "v": own_v}
        out[:, own[target]] = adding(a[:, own[kind_a]], b[:, own[kind_b]])
        for joint, first_q, first_v in self.charts:
            part = {
                "q": slice(first_q, first_q + len(joint.labels)),
                "v": slice(first_v, first_v + len(joint.velocity_labels)),
            }
            values = method(joint)(list(a[:, part[kind_a]].T), list(b[:, part[kind_b]].T))
            out[:, part[target]] = np.column_stack([np.broadcast_to(value, len(a)) for value in values])
        return np.asarray(out.reshape(*lead, size))
