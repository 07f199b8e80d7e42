"""Scenes in space in numbers: trees of bodies on ball joints and hinges, floating bodies, a rolling coin.

Every system builds its model from these numbers, and all motions are compared as places of centers of mass, which
`centers` reads off joint coordinates. Equations of motion are derived here by Jacobians of places, independently of
`mbd`, for the references. Frames of joints lie along the axes of their bodies; quaternions are (w, x, y, z).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector

FREE, BALL, HINGES = "free", "ball", "hinges"
X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class Part:
    """A body on a joint.

    parent : number of the body that carries it, −1 for the ground; at : the joint's place there [m]
    joint : 'free', 'ball', or 'hinges' about `axes`, one after the other, and before them slides along x, y, z if it
        `floats`
    center, inertia : from the joint [m]; about the center, along the body's axes [kg m²]
    q : quaternion; place and quaternion; shifts and angles
    v : ω in the body's axes; velocity of the joint in ground axes and ω; rates
    """

    name: str
    parent: int
    at: tuple[float, ...]
    joint: str
    mass: float
    center: tuple[float, ...]
    inertia: tuple[float, ...]
    q: tuple[float, ...]
    v: tuple[float, ...]
    axes: tuple[tuple[float, ...], ...] = ()
    floats: bool = False


@dataclass(frozen=True)
class Tree:
    """Bodies, parents first; `scale` multiplies what is compared. `turns`: axes of three hinges for each ball."""

    parts: tuple[Part, ...]
    gravity: tuple[float, float, float]
    scale: float = 1.0
    turns: str = "xyz"

    @property
    def q(self) -> Vector:
        return np.concatenate([part.q for part in self.parts])

    @property
    def v(self) -> Vector:
        return np.concatenate([part.v for part in self.parts])

    @property
    def by_hinges(self) -> Tree:
        """The same with three hinges in the place of every ball, and three slides before them if it floats."""
        return replace(self, parts=tuple(_by_hinges(part, self.turns) for part in self.parts))


# rotations ----------------------------------------------------------------------------------------------------------
def rotation(q: Any) -> Any:
    """R (…, 3, 3) of quaternions (…, 4) of any length."""
    w, x, y, z = np.moveaxis(np.asarray(q, dtype=float) / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def times(p: Any, q: Any) -> Any:
    """The product of two quaternions."""
    p, q = np.asarray(p, dtype=float), np.asarray(q, dtype=float)
    w = p[0] * q[0] - p[1:] @ q[1:]
    return np.r_[w, p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])]


def about(axis: Any, angle: Any) -> Any:
    """R (…, 3, 3) about an axis by angles (…)."""
    a, angle = np.asarray(axis, dtype=float), np.asarray(angle, dtype=float)[..., None, None]
    hat = np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])
    return np.eye(3) + np.sin(angle) * hat + (1.0 - np.cos(angle)) * (hat @ hat)


def angles_of(R: Any, axes: Sequence[Any]) -> Any:
    """Angles (…, 3) of R as turns about three different axes among x, y, z, each moved by those before."""
    i, j, k = (int(np.argmax(axis)) for axis in axes)
    sign = 1.0 if (i, j, k) in ((0, 1, 2), (1, 2, 0), (2, 0, 1)) else -1.0
    first = np.arctan2(-sign * R[..., j, k], R[..., k, k])
    second = np.arcsin(np.clip(sign * R[..., i, k], -1.0, 1.0))
    third = np.arctan2(-sign * R[..., i, j], R[..., i, i])
    return np.stack([first, second, third], axis=-1)


def _by_hinges(part: Part, turns: str) -> Part:
    if part.joint == HINGES:
        return part
    axes = [np.eye(3)["xyz".index(letter)] for letter in turns]
    R, omega = rotation(part.q[-4:]), np.array(part.v[-3:])
    angles = angles_of(R, axes)
    columns = [about(axes[2], -angles[2]) @ about(axes[1], -angles[1]) @ axes[0], about(axes[2], -angles[2]) @ axes[1]]
    rates = np.linalg.solve(np.column_stack([*columns, axes[2]]), omega)
    floats = part.joint == FREE
    return replace(
        part, joint=HINGES, axes=tuple(map(tuple, axes)), floats=floats, q=(*part.q[:-4], *angles),
        v=(*part.v[:-3], *rates),
    )  # fmt: skip


# motion -------------------------------------------------------------------------------------------------------------
def centers(tree: Tree, q: Any) -> Matrix:
    """Places of all centers of mass (…, 3 n), times `scale`, at joint coordinates (…, n_q)."""
    q, found, known, first = np.asarray(q, dtype=float), [], [], 0
    for part in tree.parts:
        own, first = q[..., first : first + len(part.q)], first + len(part.q)
        R, p = (np.eye(3), np.zeros(3)) if part.parent < 0 else known[part.parent]
        p = p + R @ np.array(part.at)
        if part.joint == FREE or part.floats:
            p = p + own[..., :3]
        if part.joint == HINGES:
            for axis, angle in zip(part.axes, np.moveaxis(own[..., 3 * part.floats :], -1, 0), strict=True):
                R = R @ about(axis, angle)
        else:
            R = R @ rotation(own[..., -4:])
        known.append((R, p))
        found.append(p + R @ np.array(part.center))
    return tree.scale * np.concatenate(found, axis=-1)


def _columns(part: Part, R: Any, own: Any, v: Any) -> tuple[Any, Any, Any]:
    """Of a joint in the axes of `R`, its parent's: turn of the child, angular columns by v, and their rates times v."""
    if part.joint != HINGES:
        turned = R @ rotation(own[-4:])
        return turned, turned, np.zeros(3)  # ω in the child's axes: its columns turn with ω itself, ω × ω = 0
    columns, change, omega = [], np.zeros(3), np.zeros(3)
    for axis, angle, rate in zip(part.axes, own[3 * part.floats :], v[3 * part.floats :], strict=True):
        column = R @ np.array(axis)
        change = change + rate * np.cross(omega, column)
        omega = omega + rate * column
        columns.append(column)
        R = R @ about(axis, angle)
    return R, np.column_stack(columns), change


def accelerations(tree: Tree, q: Vector, v: Vector) -> Vector:
    """v̇ from ``Σ (Jᵀ m J + J_ωᵀ I J_ω) v̇ = Σ Jᵀ m (g − a₀) − J_ωᵀ (I α₀ + ω × I ω)``, a₀ and α₀ with v̇ = 0."""
    n, known, place, first = len(v), list[Any](), 0, 0
    M, f, g = np.zeros((n, n)), np.zeros(n), np.array(tree.gravity)
    for part in tree.parts:
        own, rates = q[place : place + len(part.q)], v[first : first + len(part.v)]
        R, p, omega, alpha, speed, acceleration, turning, moving = (
            (np.eye(3), *np.zeros((5, 3)), np.zeros((3, n)), np.zeros((3, n)))
            if part.parent < 0
            else known[part.parent]
        )
        arm, spins, slides = R @ np.array(part.at), first, part.joint == FREE or part.floats
        acceleration = acceleration + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
        p, moving, turning = p + arm, moving - _hat(arm) @ turning, turning.copy()
        if slides:  # of bodies on the ground alone
            p, spins, moving[:, first : first + 3] = p + own[:3], first + 3, np.eye(3)
        R, columns, change = _columns(part, R, own, rates)
        relative = columns @ rates[spins - first :]
        alpha = alpha + change + np.cross(omega, relative)
        omega = omega + relative
        turning[:, spins : first + len(part.v)] = columns
        known.append((R, p, omega, alpha, speed, acceleration, turning, moving))
        out = R @ np.array(part.center)
        J, inertia = moving - _hat(out) @ turning, R @ np.diag(part.inertia) @ R.T
        bias = acceleration + np.cross(alpha, out) + np.cross(omega, np.cross(omega, out))
        M += part.mass * J.T @ J + turning.T @ inertia @ turning
        f += part.mass * J.T @ (g - bias) - turning.T @ (inertia @ alpha + np.cross(omega, inertia @ omega))
        place, first = place + len(part.q), first + len(part.v)
    return np.linalg.solve(M, f)


def _hat(a: Any) -> Any:
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def rates(tree: Tree, q: Vector, v: Vector) -> Vector:
    """q̇."""
    found, place, first = [], 0, 0
    for part in tree.parts:
        own, speed = q[place : place + len(part.q)], v[first : first + len(part.v)]
        turned = speed if part.joint == HINGES else np.r_[speed[:-3], 0.5 * times(own[-4:], np.r_[0.0, speed[-3:]])]
        found.append(turned)
        place, first = place + len(part.q), first + len(part.v)
    return np.concatenate(found)


def solved(rhs: Any, start: Vector, at: Vector, tol: float) -> Matrix:
    """States at times, by DOP853."""
    from scipy.integrate import solve_ivp

    found = solve_ivp(rhs, (0.0, at[-1]), start, "DOP853", at, rtol=max(tol, 2.3e-14), atol=tol)
    return np.asarray(found.y.T)


def tree_motion(tree: Tree, at: Vector, tol: float) -> Matrix:
    """What is compared of a tree, at increasing times from 0 on."""
    n = len(tree.q)

    def rhs(t: float, y: Vector) -> Vector:
        return np.r_[rates(tree, y[:n], y[n:]), accelerations(tree, y[:n], y[n:])]

    return centers(tree, solved(rhs, np.r_[tree.q, tree.v], at, tol)[:, :n])


# the scenes ---------------------------------------------------------------------------------------------------------
def _top() -> Tree:
    """m g l = 0.5886 N m, A = 0.008, C = 0.003 kg m² about the fixed point; released with spin alone, so it nutates.

    Compared is the direction of its axis.
    """
    length, lean = 0.06, 0.5
    across = 0.008 - length**2
    part = Part(
        "top", -1, (0.0, 0.0, 0.0), BALL, 1.0, (0.0, 0.0, length), (across, across, 0.003),
        (np.cos(lean / 2.0), np.sin(lean / 2.0), 0.0, 0.0), (0.0, 0.0, 180.0),
    )  # fmt: skip
    return Tree((part,), (0.0, 0.0, -9.81), 1.0 / length)


def _double() -> Tree:
    """Two bodies of general shape on ball joints; orientations and angular velocities are against the ground."""
    q1, q2 = np.array([np.cos(0.5), np.sin(0.5), 0.0, 0.0]), np.array([np.cos(0.3), 0.0, np.sin(0.3), 0.0])
    w1, w2 = np.array([0.3, 1.2, 2.0]), np.array([-0.5, 0.4, 5.0])
    between = times(q1 * [1.0, -1.0, -1.0, -1.0], q2)
    upper = Part(
        "upper", -1, (0.0, 0.0, 0.0), BALL, 1.0, (0.0, 0.0, -0.5), (0.09, 0.085, 0.01), tuple(q1), tuple(w1)
    )  # fmt: skip
    lower = Part(
        "lower", 0, (0.0, 0.0, -1.0), BALL, 0.8, (0.0, 0.0, -0.4), (0.06, 0.055, 0.006), tuple(between),
        tuple(w2 - rotation(between).T @ w1),
    )  # fmt: skip
    return Tree((upper, lower), (0.0, 0.0, -9.81))


def _chain(n: int = 8) -> Tree:
    """n flat bars in a row on ball joints, 1 m and 1 kg together, held level, bent and twisting; released."""
    length = 1.0 / n
    inertia = tuple(length**2 / (12.0 * n) * part for part in (1.1, 1.0, 0.12))
    first = (np.cos(np.pi / 4.0), 0.0, -np.sin(np.pi / 4.0), 0.0)
    parts = [
        Part(
            f"bar {k}", k - 1, (0.0, 0.0, -length if k else 0.0), BALL, length, (0.0, 0.0, -0.5 * length), inertia,
            (np.cos(0.1), np.sin(0.1), 0.0, 0.0) if k else first, (0.5, -0.3, 1.0 if k % 2 else -1.0),
        )
        for k in range(n)
    ]  # fmt: skip
    return Tree(tuple(parts), (0.0, 0.0, -9.81), turns="yxz")


def _human() -> Tree:
    """`mbd.human(70, 1.75)` in free flight, knees bent, every joint in motion: 34 degrees of freedom, no muscles."""
    import mbd

    person, parts, names = mbd.human(70.0, 1.75), list[Part](), list[str]()
    posture = person.standing(0.4)
    for k, joint in enumerate(person.joints):
        body: Any = joint.child.body
        own = (
            *(float(posture.get(f"trunk.{axis}", 0.0)) for axis in "xyz" if isinstance(joint, mbd.Free)),
            *posture.get(f"{joint.name}.orientation", (1.0, 0.0, 0.0, 0.0)),
        )
        kind, axes = (FREE if isinstance(joint, mbd.Free) else BALL), list[tuple[float, ...]]()
        if isinstance(joint, mbd.Universal):
            kind, axes = HINGES, [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)]
            own = (float(posture.get(f"{joint.name}.first", 0.0)), float(posture.get(f"{joint.name}.second", 0.0)))
        elif isinstance(joint, mbd.Revolute):
            kind, axes, own = HINGES, [tuple(map(float, joint.axis))], (float(posture.get(f"{joint.name}.angle", 0.0)),)
        speeds = tuple(1.5 * np.sin(2.0 * k + j) for j in range(len(joint.freedoms)))
        parent = -1 if joint.parent.body is _ground(joint) else names.index(joint.parent.body.name)
        names.append(body.name)
        parts.append(
            Part(
                joint.name, parent, tuple(map(float, joint.parent.offset)), kind, float(body.mass),
                tuple(map(float, body.center.offset)), tuple(map(float, body.inertia)), own, speeds, tuple(axes),
            )
        )  # fmt: skip
    return Tree(tuple(parts), (0.0, -9.81, 0.0))


def _ground(joint: Any) -> Any:
    """The body that carries a joint if it is the ground, else None."""
    body = joint.parent.body
    return body if type(body).__name__ == "Ground" else None


@cache
def tree(name: str) -> Tree:
    """The tree of a scene."""
    return TREES[name]()


TREES = {"S7_top": _top, "S7_double": _double, "S7_chain": _chain, "S7_human": _human}


@dataclass(frozen=True)
class Coin:
    """A thin disk that rolls on the plane z = 0, `lean` from upright about x; compared are its center and axis.

    heading, spin : rate of turning about z, and about its own axis [rad/s]
    """

    mass: float = 1.0
    radius: float = 0.5
    lean: float = 0.35
    heading: float = 0.6
    spin: float = 8.0

    @property
    def axis(self) -> Vector:
        """Along y if upright."""
        return np.array([0.0, np.cos(self.lean), np.sin(self.lean)])

    @property
    def up(self) -> Vector:
        """From the lowest point to the center, of length 1."""
        return np.array([0.0, -np.sin(self.lean), np.cos(self.lean)])

    @property
    def omega(self) -> Vector:
        """[rad/s], ground axes."""
        return np.array([0.0, 0.0, self.heading]) + self.spin * self.axis

    @property
    def place(self) -> Vector:
        """Of the center, over the point that touches first."""
        return self.radius * self.up


COIN = Coin()


def rolling(coin: Coin, y: Vector) -> Vector:
    """ẏ of y = (center, axis, ω): momentum about the center, with the force m (c̈ − g) at the lowest point.

    ``c̈ = d/dt (ω × R u)``,  ``d/dt (I_t ω + (I_a − I_t) (ω·n) n) = −R u × m (c̈ − g)``,  u the way up in the disk.
    """
    n, w, R, m = y[3:6] / np.linalg.norm(y[3:6]), y[6:9], coin.radius, coin.mass
    across, along, z = m * R**2 / 4.0, m * R**2 / 2.0, np.array([0.0, 0.0, 1.0])
    turn = np.cross(w, n)
    height, slope = np.sqrt(1.0 - n[2] ** 2), -n[2] * turn[2] / np.sqrt(1.0 - n[2] ** 2)
    u = (z - n[2] * n) / height
    change = (-(turn[2] * n + n[2] * turn) - slope * u) / height
    arm, back = _hat(R * u), np.cross(w, R * change) + np.array([0.0, 0.0, 9.81])
    inertia = across * np.eye(3) + (along - across) * np.outer(n, n)
    torque = -m * arm @ back - (along - across) * (w @ n) * turn
    return np.r_[np.cross(w, R * u), turn, np.linalg.solve(inertia - m * arm @ arm, torque)]


def coin_motion(coin: Coin, at: Vector, tol: float) -> Matrix:
    """Center and axis (times, 6)."""
    return solved(lambda t, y: rolling(coin, y), np.r_[coin.place, coin.axis, coin.omega], at, tol)[:, :6]
