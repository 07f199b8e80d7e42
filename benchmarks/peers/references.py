"""Exact motions: equations derived by hand, integrated by scipy's DOP853 with impacts at located instants.

``python -m benchmarks.peers.references`` writes `references.npz` again and prints how far two tolerances lie apart.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.peers.equations import Problem, problem
from benchmarks.peers.scenes import BALL, COMPASS, LEG, REFERENCES, SCENES, STOP, WHEEL, G, Scene, Wheel, chosen
from benchmarks.peers.space import COIN, coin_motion, tree, tree_motion
from mbd.arrays import Matrix, Vector

FINEST = 2.3e-14
"""Least relative tolerance that DOP853 takes."""


def rhs_of(posed: Problem, f: Callable[[Any, Any, Any], None] | None = None) -> Callable[[float, Vector], Vector]:
    """The right-hand side as scipy calls it; `f` may be the compiled one."""
    function = posed.f if f is None else f

    def rhs(t: float, y: Vector) -> Vector:
        out = np.empty_like(y)
        function(y, out, posed.P)
        return out

    return rhs


def smooth(posed: Problem, times: Vector, tol: float) -> Matrix:
    """What is compared (times, coordinates) of a scene without impacts, at any increasing times from 0 on."""
    found = solve_ivp(rhs_of(posed), (0.0, times[-1]), posed.start, "DOP853", times, rtol=max(tol, FINEST), atol=tol)
    return np.asarray(posed.compared(found.y.T))


@dataclass(frozen=True)
class Phase:
    """A smooth part of a motion: its equations, and the guard whose fall through zero ends it."""

    rhs: Callable[[float, Vector], Any]
    guard: Callable[[float, Vector], float]


def through_phases(
    first: Phase, start: Vector, times: Vector, until: float, tol: float, change: Callable[[Vector], Any], step: float
) -> tuple[Matrix, list[tuple[float, Vector]]]:
    """States (times, n) of a motion in phases, and (time, state) after each change.

    `change` gives the next phase and its first state, or None at the end.
    """
    rows, switches = np.zeros((len(times), len(start))), list[tuple[float, Vector]]()
    t, y, phase = 0.0, np.asarray(start, dtype=float), first
    while True:
        guard: Any = lambda t, y, fall=phase.guard: fall(t, y)  # noqa: E731
        guard.terminal, guard.direction = True, -1
        part = solve_ivp(
            phase.rhs, (t, until), y, "DOP853", rtol=max(tol, FINEST), atol=tol, events=guard, dense_output=True,
            max_step=step,
        )  # fmt: skip
        held = (times >= t - 1e-14) & (times <= part.t[-1])
        if held.any():
            rows[held] = part.sol(times[held]).T
        t, following = float(part.t[-1]), change(part.y[:, -1].copy()) if part.status == 1 else None
        if following is None:
            return rows, switches
        phase, y = following
        switches.append((t, y))


def bounces(times: Vector) -> Matrix:
    """S4a in closed form: heights (times, 1)."""
    height, begin, speed = np.zeros(len(times)), np.sqrt(2.0 * BALL.height / G), 0.0
    falling = times <= begin
    height[falling] = BALL.height - 0.5 * G * times[falling] ** 2
    speed = BALL.restitution * np.sqrt(2.0 * G * BALL.height)
    while speed > 1e-15:
        since, lasts = times - begin, 2.0 * speed / G
        flying = (since > 0.0) & (since <= lasts)
        height[flying] = speed * since[flying] - 0.5 * G * since[flying] ** 2
        begin, speed = begin + lasts, speed * BALL.restitution
    return height[:, None]


def ball_by_events(times: Vector, tol: float) -> Matrix:
    """S4a as one writes it with scipy: heights (times, 1)."""
    phase = Phase(lambda t, y: [y[1], -G], lambda t, y: y[0])

    def bounce(y: Vector) -> Any:
        rebound = -BALL.restitution * y[1]
        return (phase, np.array([0.0, rebound])) if rebound > 1e-6 else None

    return through_phases(phase, np.array([BALL.height, 0.0]), times, times[-1], tol, bounce, np.inf)[0][:, :1]


def wheel(p: Wheel, times: Vector, until: float, tol: float) -> tuple[Matrix, Vector]:
    """θ of the stance spoke from up and its rate (times, 2), and the times of the strikes, at most `p.steps`."""
    half, about_foot = np.pi / p.spokes, p.inertia + p.mass * p.length**2
    kept = (p.inertia + p.mass * p.length**2 * np.cos(2.0 * half)) / about_foot  # momentum about the new foot
    rate = p.mass * G * p.length / about_foot
    phase = Phase(lambda t, y: [y[1], rate * np.sin(y[0])], lambda t, y: p.slope + half - y[0])
    count = 0

    def strike(y: Vector) -> Any:
        nonlocal count
        count += 1
        return phase, np.array([p.slope - half, kept * y[1]])

    start = np.array([p.slope - half, p.speed])
    rows, switches = through_phases(phase, start, times, until, tol, strike, np.inf)
    return rows, np.array([t for t, _ in switches[: p.steps]])


def _cross(r: Vector, v: Vector) -> float:
    return float(r[0] * v[1] - r[1] * v[0])


def _masses(y: Vector) -> list[tuple[float, Vector, Vector]]:
    """(mass, position, velocity) of hip, stance and swing leg, seen from the stance foot."""
    p = COMPASS
    toward, across = (np.array([[np.sin(a), np.cos(a)], [np.cos(a), -np.sin(a)]]) for a in y[:2])
    hip, speed = p.length * toward[0], p.length * y[2] * toward[1]
    near = p.length - p.center
    stance = (p.leg, near * toward[0], near * y[2] * toward[1])
    return [(p.hip, hip, speed), stance, (p.leg, hip - p.center * across[0], speed - p.center * y[3] * across[1])]


def _momenta(y: Vector, foot: Vector, own: int) -> Vector:
    """Angular momentum of all about a foot, and of one leg's mass about the hip."""
    parts, hip = _masses(y), _masses(y)[0][1]
    mass, position, velocity = parts[own]
    return np.array([sum(m * _cross(r - foot, v) for m, r, v in parts), mass * _cross(position - hip, velocity)])


def _gait_rhs(t: float, y: Vector) -> Vector:
    p = COMPASS
    coupling, difference = p.leg * p.length * p.center, y[0] - y[1]
    off = -coupling * np.cos(difference)
    M = np.array(
        [[p.hip * p.length**2 + p.leg * ((p.length - p.center) ** 2 + p.length**2), off], [off, p.leg * p.center**2]]
    )
    lever = p.hip * p.length + p.leg * (2.0 * p.length - p.center)
    force = [
        coupling * np.sin(difference) * y[3] ** 2 + G * lever * np.sin(y[0]),
        -coupling * np.sin(difference) * y[2] ** 2 - G * p.leg * p.center * np.sin(y[1]),
    ]
    return np.r_[y[2:], np.linalg.solve(M, force)]


def gait(times: Vector, tol: float) -> tuple[Matrix, Vector]:
    """S4d: θ of stance and swing leg and their rates (times, 4), and the times of the strikes.

    A strike keeps the momentum of all about the new foot and that of the trailing leg about the hip.
    """
    p = COMPASS
    phase = Phase(_gait_rhs, lambda t, y: max(2.0 * p.slope - y[0] - y[1], y[1] - y[0]))

    def strike(y: Vector) -> Any:
        after, foot = (
            np.array([y[1], y[0], 0.0, 0.0]),
            _masses(y)[0][1] - p.length * np.array([np.sin(y[1]), np.cos(y[1])]),
        )
        known = _momenta(y, foot, own=1)
        columns = [_momenta(np.r_[after[:2], unit], np.zeros(2), own=2) for unit in np.eye(2)]
        return phase, np.r_[after[:2], np.linalg.solve(np.array(columns).T, known)]

    rows, switches = through_phases(phase, np.array(p.start), times, times[-1], tol, strike, 0.02)
    return rows, np.array([t for t, _ in switches])


def _leg_terms(y: Vector) -> tuple[Matrix, Vector]:
    """Mass matrix and force of the leg in absolute angles, y = [θ, θ̇]."""
    p, half = LEG, 0.5 * LEG.shank
    coupling = p.shank_mass * p.thigh * half
    difference = y[0] - y[1]
    off, spin = coupling * np.cos(difference), coupling * np.sin(difference)
    M = np.array([[(p.thigh_mass / 3.0 + p.shank_mass) * p.thigh**2, off], [off, p.shank_mass * p.shank**2 / 3.0]])
    hanging = (0.5 * p.thigh_mass + p.shank_mass) * p.thigh
    force = [-spin * y[3] ** 2 - hanging * G * np.sin(y[0]), spin * y[2] ** 2 - p.shank_mass * half * G * np.sin(y[1])]
    return M, np.array(force)


def leg(times: Vector, tol: float) -> Matrix:
    """S4c: θ of thigh and shank (times, 2)."""
    knee = np.array([-1.0, 1.0])

    def push(y: Vector) -> float:
        """Torque of the stop against straightening beyond 0, while the knee is straight."""
        M, force = _leg_terms(y)
        answer = np.linalg.solve(M, knee)
        return float(answer @ force / (answer @ knee))

    def rhs(locked: bool) -> Callable[[float, Vector], Vector]:
        def found(t: float, y: Vector) -> Vector:
            M, force = _leg_terms(y)
            return np.r_[y[2:], np.linalg.solve(M, force - knee * push(y) if locked else force)]

        return found

    free = Phase(rhs(False), lambda t, y: y[0] - y[1])
    held = Phase(rhs(True), lambda t, y: push(y))
    state = {"locked": False}

    def change(y: Vector) -> Any:
        if not state["locked"]:
            answer = np.linalg.solve(_leg_terms(y)[0], knee)
            y[2:] -= answer * (knee @ y[2:]) / (answer @ knee)
            y[1] = y[0]
        state["locked"] = not state["locked"] and push(y) > 0.0
        return (held if state["locked"] else free), y

    start = np.r_[LEG.angles, 0.0, 0.0]
    return through_phases(free, start, times, times[-1], tol, change, 0.01)[0][:, :2]


def stopped(times: Vector, tol: float) -> Matrix:
    """S5b: θ (times, 1), with the instants at which the stop begins and ceases to act located."""
    p = STOP
    inertia = p.mass * p.length**2 / 3.0

    def inside(t: float, y: Vector) -> Any:
        push = p.stiffness * p.length * (p.at - y[0]) - p.damping * p.length * y[1]
        return [y[1], (p.length * push - 0.5 * p.mass * G * p.length * np.sin(y[0])) / inertia]

    outside = Phase(
        lambda t, y: [y[1], -0.5 * p.mass * G * p.length * np.sin(y[0]) / inertia], lambda t, y: y[0] - p.at
    )
    pressed = Phase(inside, lambda t, y: p.at - y[0])
    state = {"inside": False}

    def change(y: Vector) -> Any:
        state["inside"] = not state["inside"]
        return (pressed if state["inside"] else outside), y

    return through_phases(outside, np.array([p.angle, 0.0]), times, times[-1], tol, change, 1e-3)[0][:, :1]


def in_space(scene: Scene, times: Vector, tol: float) -> Matrix:
    """S7 at any increasing times from 0 on."""
    return coin_motion(COIN, times, tol) if scene.name == "S7_coin" else tree_motion(tree(scene.name), times, tol)


def exact(scene: Scene, times: Vector) -> Matrix:
    """What is compared (times, coordinates) at any increasing times from 0 on: of smooth scenes and of the ball."""
    if scene.name == "S4a":
        return bounces(times)
    if scene.family == "S7":
        return in_space(scene, times, 1e-12)
    posed = problem(scene.name)
    assert posed is not None, "scenes with impacts are compared at their own times"
    return smooth(posed, times, 1e-12)


def _of(scene: Scene, tol: float) -> dict[str, Matrix]:
    """What is stored for a scene."""
    name, times = scene.name, scene.times
    if name == "S4a":
        return {name: bounces(times)}
    if name == "S4b":
        return {name: wheel(WHEEL[name], times, scene.until, tol)[1][:, None]}
    if name == "S4b_point":
        return {name: wheel(WHEEL[name], times, scene.until, tol)[0]}
    if name == "S4d":
        rows, strikes = gait(times, tol)
        return {name: rows, f"{name}_strikes": strikes}
    if name in IMPACTS:
        return {name: IMPACTS[name](times, tol)}
    if scene.family == "S7":
        return {name: in_space(scene, times, tol)}
    posed = problem(name)
    assert posed is not None
    return {name: smooth(posed, times, tol)}


IMPACTS: dict[str, Callable[[Vector, float], Matrix]] = {
    "S4a": ball_by_events,
    "S4b": lambda times, tol: wheel(WHEEL["S4b"], times, SCENES["S4b"].until, tol)[1][:, None],
    "S4b_point": lambda times, tol: wheel(WHEEL["S4b_point"], times, times[-1], tol)[0],
    "S4c": leg,
    "S4d": lambda times, tol: gait(times, tol)[0],
    "S5b": stopped,
}
"""Motions with impacts or switches at some tolerance, as one writes them by hand with scipy's events."""


def main(*names: str) -> None:
    """Write references, of all scenes or of some; print the largest difference from those of a tenfold tolerance."""
    stored: dict[str, Matrix] = dict(np.load(REFERENCES)) if names else {}
    for scene in chosen(names):
        fine, rough = _of(scene, 1e-13), _of(scene, 1e-12)
        stored |= fine
        print(scene.name, {key: float(np.max(np.abs(fine[key] - rough[key]))) for key in fine}, flush=True)
    np.savez_compressed(REFERENCES, **stored)


if __name__ == "__main__":
    main(*sys.argv[1:])
