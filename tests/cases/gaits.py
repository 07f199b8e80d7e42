"""Passive walkers by hand: point masses on straight segments, integrated by DOP853, impacts as projections.

Angles are those of the published cases: from the vertical, positive backwards; a stance foot at the origin, the leg
from foot to hip along (sin q, cos q), swing segments hanging from the hip. Masses lie at Σ_j c_j (sin q_j, cos q_j), so

    M_ij = A_ij cos(q_i − q_j),   A_ij = Σ m c_i c_j,
    Σ_j M_ij q¨_j + Σ_j A_ij sin(q_i − q_j) q˙_j² − g Σ m c_i sin q_i = 0.

A plastic impact projects the velocities of the masses onto those that the next posture allows, in their metric.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
SETTINGS: dict[str, Any] = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
FALLEN = 0.5
"""Height of the hip over the slope, as a share of the leg, below which a walker has fallen."""


@dataclass(frozen=True, eq=False)
class Step:
    """One step: how it ended ('heel', 'fall', 'stumble'), when, the state after it, and when the knee locked."""

    end: str
    time: float
    state: Numbers
    knee: float | None = None


class Walker:
    """A walker with the parameters of a case: shank a1 + b1, thigh a2 + b2, masses ms, mt, mh, gravity g, slope.

    States are (stance leg, swing leg, their rates) just after a heel strike; knees : whether the swing knee bends.
    foot_meets_ground : whether a swing foot that comes down before its knee has locked ends the walk as a stumble
    """

    def __init__(self, sizes: Mapping[str, float], knees: bool, foot_meets_ground: bool = False) -> None:
        a1, b1, a2, b2 = (sizes[name] for name in ("a1", "b1", "a2", "b2"))
        self.shank, self.thigh, self.slope, self.gravity = a1 + b1, a2 + b2, sizes["slope"], sizes["g"]
        self.leg = L = self.shank + self.thigh
        ms, mt, mh = (sizes[name] for name in ("ms", "mt", "mh"))
        self.masses = np.array([ms, mt, mh, mt, ms])
        self.bent = np.array([[a1, 0, 0], [a1 + b1 + a2, 0, 0], [L, 0, 0], [L, -b2, 0], [L, -(a2 + b2), -b1]])
        self.straight = np.column_stack([self.bent[:, 0], self.bent[:, 1] + self.bent[:, 2]])
        self.knees, self.foot_meets_ground = knees, foot_meets_ground

    def motion(self, c: Numbers) -> Any:
        """y' = f(t, y) of a posture in which the masses lie at c · (sin q, cos q)."""
        A, b, n = c.T @ (self.masses[:, None] * c), self.masses @ c, c.shape[1]

        def f(t: float, y: Numbers) -> Numbers:
            q, w = y[:n], y[n:]
            turn = q[:, None] - q[None, :]
            force = (A * np.sin(turn)) @ w**2 - self.gravity * b * np.sin(q)
            return np.concatenate([w, np.linalg.solve(A * np.cos(turn), -force)])

        return f

    def _velocities(self, c: Numbers, q: Numbers) -> Numbers:
        """How the masses' velocities (x, then y) depend on the rates."""
        return np.vstack([c * np.cos(q), -c * np.sin(q)])

    def _projected(self, c: Numbers, q: Numbers, velocities: Numbers) -> Numbers:
        J, m = self._velocities(c, q), np.concatenate([self.masses, self.masses])
        return np.asarray(np.linalg.solve(J.T @ (m[:, None] * J), J.T @ (m * velocities)))

    def foot(self, q: Numbers) -> float:
        """Height of the swing foot over the slope."""
        s = self.slope
        bent = self.thigh * np.cos(q[1] + s) + self.shank * np.cos(q[-1] + s)
        return float(self.leg * np.cos(q[0] + s) - bent)

    def _run(self, c: Numbers, y: Numbers, t: float, *ends: Any) -> tuple[int, float, Numbers]:
        """Integrate until an end falls through zero; its number, the time and the state. The last end is the fall."""
        from scipy.integrate import solve_ivp

        def fallen(t: float, y: Numbers) -> float:
            return float(np.cos(y[0] + self.slope) - FALLEN)

        events: list[Any] = [lambda t, y, end=end: end(y) for end in ends]
        for event in (*events, fallen):
            event.terminal, event.direction = True, -1.0
        f = self.motion(c)
        away = solve_ivp(f, (t, t + 1e-6), y, **SETTINGS)
        solved = solve_ivp(f, (t + 1e-6, t + 20.0), away.y[:, -1], events=[*events, fallen], **SETTINGS)
        which = next(k for k, times in enumerate(solved.t_events) if len(times))
        return which, float(solved.t[-1]), solved.y[:, -1]

    def step(self, state: Numbers, t: float = 0.0) -> Step:
        """From just after a heel strike to just after the next."""
        y, knee = np.asarray(state, dtype=float), None
        if self.knees:
            ends = [lambda y: y[1] - y[2], lambda y: self.foot(y[:3])][: 1 + self.foot_meets_ground]
            which, t, y = self._run(self.bent, y[[0, 1, 1, 2, 3, 3]], t, *ends)
            if which > 0:
                return Step("fall" if which == len(ends) else "stumble", t, y)
            knee = t
            speeds = self._velocities(self.bent, y[:3]) @ y[3:]
            y = np.concatenate([y[:2], self._projected(self.straight, y[:2], speeds)])
        which, t, y = self._straight(y, t)
        return Step("fall", t, y, knee) if which > 0 else Step("heel", t, self._struck(y), knee)

    def _straight(self, y: Numbers, t: float) -> tuple[int, float, Numbers]:
        """The swing with straight legs until the foot comes down (0) or the walker falls (1).

        Without knees it scuffs as it passes the other leg, forwards and perhaps back again, which is ignored.
        """
        while True:
            if not self.knees:
                which, t, y = self._run(self.straight, y, t, lambda y: y[0] - y[1])
                if which > 0:
                    return which, t, y
            which, t, y = self._run(self.straight, y, t, lambda y: self.foot(y[:2]))
            if self.knees or which > 0 or abs(y[0] - y[1]) > 1e-6:
                return which, t, y

    def _struck(self, y: Numbers) -> Numbers:
        """The state after a heel strike: the legs change roles."""
        speeds, q = self._velocities(self.straight, y[:2]) @ y[2:], y[1::-1].copy()
        order = [4, 3, 2, 1, 0, 9, 8, 7, 6, 5]
        return np.concatenate([q, self._projected(self.straight, q, speeds[order])])

    def walk(self, state: Numbers, most: int) -> list[Step]:
        """Up to `most` steps; the last may be a fall."""
        steps: list[Step] = []
        t = 0.0
        while len(steps) < most and (not steps or steps[-1].end == "heel"):
            steps.append(self.step(state, t))
            state, t = steps[-1].state, steps[-1].time
        return steps


def slope_angles(state: Numbers, slope: float, share: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Numbers:
    """A state after a heel strike with its angles from the slope's normal and its two rates multiplied by shares."""
    angles, rates = np.asarray(state[:2]), np.asarray(state[2:])
    return np.concatenate([share[0] * (angles + slope) - slope, rates * share[1:]])
