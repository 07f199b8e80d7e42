"""Pinocchio in space: `aba` in Runge–Kutta loops in Python, on its manifolds or with three hinges for a ball joint."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.integrate._ivp import dop853_coefficients as tableau

from benchmarks.peers.race import Attempt, Outcome, Sweep, seconds
from benchmarks.peers.scenes import Scene
from benchmarks.peers.space import TREES, Part, Tree, centers, tree

STEPS = {
    "S7_top": (0.025, 0.0125, 0.01, 5e-3, 2.5e-3, 1e-3, 5e-4, 2.5e-4),
    "S7_double": (0.1, 0.05, 0.025, 0.02, 0.01, 0.005, 0.002, 0.001),
    "S7_chain": (0.02, 0.01, 0.005, 0.002, 0.001, 5e-4),
    "S7_human": (0.05, 0.025, 0.0125, 0.01, 0.005, 0.0025, 0.001),
}
A, B = tableau.A[:12, :12].copy(), tableau.B.copy()
HINGE = {0: pin.JointModelRX, 1: pin.JointModelRY, 2: pin.JointModelRZ}
SLIDE = (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ)


def _joints(part: Part) -> list[Any]:
    if part.joint == "free":
        return [pin.JointModelFreeFlyer()]
    if part.joint == "ball":
        return [pin.JointModelSpherical()]
    found = [slide() for slide in SLIDE] if part.floats else []
    for axis in part.axes:
        place = int(np.argmax(np.abs(axis)))
        straight = axis[place] == 1.0
        found.append(HINGE[place]() if straight else pin.JointModelRevoluteUnaligned(np.array(axis)))
    return found


class Model:
    """A tree in Pinocchio; `q` and `v` of the start, and `read` from its coordinates to what is compared."""

    def __init__(self, tree: Tree) -> None:
        self.tree, self.model, joints = tree, pin.Model(), list[int]()
        self.model.gravity.linear = np.array(tree.gravity)
        for k, part in enumerate(tree.parts):
            joint, at = (joints[part.parent] if part.parent >= 0 else 0), pin.SE3(np.eye(3), np.array(part.at))
            for j, kind in enumerate(_joints(part)):
                joint = self.model.addJoint(joint, kind, at if j == 0 else pin.SE3.Identity(), f"{k} {j}")
            solid = pin.Inertia(part.mass, np.array(part.center), np.diag(part.inertia))
            self.model.appendBodyToJoint(joint, solid, pin.SE3.Identity())
            joints.append(joint)
        self.data, self.none = self.model.createData(), np.zeros(self.model.nv)
        self.places = [place for k in range(len(tree.parts)) for place in self._places(k)]
        self.speeds = [place for k in range(len(tree.parts)) for place in self._speeds(k)]
        self.q, self.v = np.zeros(self.model.nq), np.zeros(self.model.nv)
        self.q[self.places] = tree.q
        ours = np.concatenate([_own_velocity(part) for part in tree.parts])
        self.v[self.speeds] = ours

    def _of(self, k: int) -> list[Any]:
        return [self.model.joints[self.model.getJointId(f"{k} {j}")] for j in range(len(_joints(self.tree.parts[k])))]

    def _places(self, k: int) -> list[int]:
        """Where our coordinates are among its own; its quaternions end with w."""
        places = [joint.idx_q + j for joint in self._of(k) for j in range(joint.nq)]
        return places if self.tree.parts[k].joint == "hinges" else [*places[:-4], places[-1], *places[-4:-1]]

    def _speeds(self, k: int) -> list[int]:
        return [joint.idx_v + j for joint in self._of(k) for j in range(joint.nv)]

    def acceleration(self, q: Any, v: Any) -> Any:
        return pin.aba(self.model, self.data, q, v, self.none).copy()

    def read(self, rows: Any) -> Any:
        return centers(self.tree, np.array(rows)[:, self.places])


def _own_velocity(part: Part) -> Any:
    """Its floating bodies have the velocity in their own axes."""
    if part.joint != "free":
        return np.array(part.v)
    from benchmarks.peers.space import rotation

    return np.r_[rotation(part.q[3:]).T @ np.array(part.v[:3]), part.v[3:]]


def _rk4(scene: Scene, tree: Tree, h: float) -> Outcome:
    """Classical Runge–Kutta, with increments on the manifold where coordinates do not add."""
    made, block = Model(tree), round(scene.every / h)
    model, rows = made.model, [made.q]

    def run() -> None:
        q, v = made.q, made.v
        for _ in scene.times[1:]:
            for _ in range(block):
                a1 = made.acceleration(q, v)
                v2 = v + h / 2 * a1
                a2 = made.acceleration(pin.integrate(model, q, h / 2 * v), v2)
                v3 = v + h / 2 * a2
                a3 = made.acceleration(pin.integrate(model, q, h / 2 * v2), v3)
                v4 = v + h * a3
                a4 = made.acceleration(pin.integrate(model, q, h * v3), v4)
                q = pin.integrate(model, q, h / 6 * (v + 2 * v2 + 2 * v3 + v4))
                v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            rows.append(q)

    spent = seconds(run)
    return Outcome(made.read(rows), spent, block * (len(scene.times) - 1))


def _dop853(scene: Scene, tree: Tree, h: float) -> Outcome:
    """Dormand–Prince of order 8 with equal steps, coordinates that add."""
    made, block = Model(tree), round(scene.every / h)
    n, rows, K = len(made.q), [made.q], np.zeros((12, 2 * len(made.q)))

    def slope(y: Any, out: Any) -> None:
        out[:n], out[n:] = y[n:], pin.aba(made.model, made.data, y[:n], y[n:], made.none)

    def run() -> None:
        y = np.r_[made.q, made.v]
        for _ in scene.times[1:]:
            for _ in range(block):
                slope(y, K[0])
                for s in range(1, 12):
                    slope(y + h * (A[s, :s] @ K[:s]), K[s])
                y = y + h * (B @ K)
            rows.append(y[:n].copy())

    spent = seconds(run)
    return Outcome(made.read(rows), spent, block * (len(scene.times) - 1))


def attempts(scene: Scene) -> list[Sweep]:
    if scene.name not in TREES:
        return []
    own, hinges, steps = tree(scene.name), tree(scene.name).by_hinges, STEPS[scene.name]
    return [
        [Attempt(f"aba, {name} in Python h={h:g}", partial(make, scene, made, h)) for h in steps]
        for name, make, made in (
            ("RK4 on manifolds", _rk4, own), ("RK4, three hinges", _rk4, hinges),
            ("DOP853, three hinges", _dop853, hinges),
        )
    ]  # fmt: skip
