"""Pinocchio: `aba` and `constraintDynamics` in a Runge–Kutta loop in Python, as it has no simulator of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin

from benchmarks.peers.race import Attempt, Outcome, Sweep, seconds
from benchmarks.peers.scenes import ANDREWS, CHAINS, ELASTIC, FOUR_BARS, G, Scene
from benchmarks.peers.systems import space_pinocchio

Accelerate = Callable[[Any, Any], Any]


def version() -> str:
    return str(pin.__version__)


def _at(z: complex) -> Any:
    return pin.SE3(np.eye(3), np.array([np.real(z), 0.0, np.imag(z)]))


def _added(
    model: Any, parent: int, at: complex, mass: float, inertia: float, center: complex, turn: float = 1.0
) -> int:
    """A body on a hinge about −y (θ towards +x from straight down), or +y with turn = −1."""
    joint = model.addJoint(
        parent, pin.JointModelRevoluteUnaligned(np.array([0.0, -turn, 0.0])), _at(at), f"j{model.njoints}"
    )
    body = pin.Inertia(mass, np.array([np.real(center), 0.0, np.imag(center)]), np.eye(3) * inertia)
    model.appendBodyToJoint(joint, body, pin.SE3.Identity())
    return int(joint)


def _model(gravity: float = G) -> Any:
    model = pin.Model()
    model.gravity.linear = np.array([0.0, 0.0, -gravity])
    return model


def _run(scene: Scene, acceleration: Accelerate, q: Any, v: Any, h: float, read: Callable[[Any], Any]) -> Outcome:
    """Classical Runge–Kutta."""
    block, rows = round(scene.every / h), [np.array(q, dtype=float)]

    def run() -> None:
        q1, v1 = rows[0], np.array(v, dtype=float)
        for _ in scene.times[1:]:
            for _ in range(block):
                a1 = acceleration(q1, v1)
                v2 = v1 + h / 2 * a1
                a2 = acceleration(q1 + h / 2 * v1, v2)
                v3 = v1 + h / 2 * a2
                a3 = acceleration(q1 + h / 2 * v2, v3)
                v4 = v1 + h * a3
                a4 = acceleration(q1 + h * v3, v4)
                q1 = q1 + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4)
                v1 = v1 + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            rows.append(q1)

    spent = seconds(run)
    return Outcome(read(np.array(rows)), spent, block * (len(scene.times) - 1))


def _chain(scene: Scene, h: float) -> Outcome:
    p, model, joint = CHAINS[scene.name], _model(), 0
    for k in range(p.n):
        joint = _added(
            model, joint, -1j * p.length if k else 0.0, p.mass, p.mass * p.length**2 / 12.0, -0.5j * p.length
        )
    data = model.createData()

    def acceleration(q: Any, v: Any) -> Any:
        return pin.aba(model, data, q, v, -p.damping * v).copy()

    return _run(
        scene, acceleration, np.diff(p.angles, prepend=0.0), np.zeros(p.n), h, lambda rows: np.cumsum(rows, axis=1)
    )


def _tied(
    model: Any, ties: Sequence[tuple[int, complex, int, complex]], frequency: float, precision: float
) -> Callable[..., Any]:
    """Accelerations with pairs of points held together, by Baumgarte's correction of a frequency."""
    models, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for first, at, second, there in ties:
        tie = pin.RigidConstraintModel(
            pin.ContactType.CONTACT_3D, model, first, _at(at), second, _at(there), pin.ReferenceFrame.LOCAL
        )
        tie.setBaumgarteCorrectorParameters(pin.BaumgarteCorrectorParameters(frequency**2, 2.0 * frequency))
        models.append(tie)
        datas.append(tie.createData())
    data = model.createData()
    pin.initConstraintDynamics(model, data, models, datas)
    proximal = pin.ProximalSettings(precision, 1e2 * precision, 50)
    return lambda q, v, tau: pin.constraintDynamics(model, data, q, v, tau, models, datas, proximal).copy()


def _four_bars(scene: Scene, h: float) -> Outcome:
    p, model = FOUR_BARS[scene.name], _model()
    inertia, length = p.mass * p.length**2 / 12.0, p.length
    posts, couplers = [], []
    for k in range(p.n + 1):
        posts.append(_added(model, 0, k * length, p.mass, inertia, 0.5j * length, -1.0))
        if k < p.n:
            couplers.append(_added(model, posts[k], 1j * length, p.mass, inertia, 0.5 * length, -1.0))
    v = np.zeros(model.nv)
    v[[model.joints[joint].idx_v for joint in posts]] = p.speed / length
    v[[model.joints[joint].idx_v for joint in couplers]] = -p.speed / length
    ties = [(couplers[k], length, posts[k + 1], 1j * length) for k in range(p.n)]
    accelerate, none = _tied(model, ties, 10.0, 1e-12), np.zeros(model.nv)
    first = model.joints[posts[0]].idx_q
    return _run(scene, lambda q, v: accelerate(q, v, none), np.zeros(model.nq), v, h, lambda rows: rows[:, [first]])


def _andrews(scene: Scene, h: float) -> Outcome:
    p, model = ANDREWS, _model(0.0)

    def add(k: int, parent: int, at: complex, center: complex) -> int:
        return _added(model, parent, at, p.masses[k - 1], p.inertias[k - 1], center)

    k1 = add(1, 0, 0.0, p.ra)
    k2 = add(2, k1, p.rr, -p.da)
    k3 = add(3, 0, p.B, p.sb - 1j * p.sa)
    k5 = add(5, 0, p.A, p.ta + 1j * p.tb)
    k4 = add(4, k5, p.zt, -1j * (p.e - p.ea))
    k7 = add(7, 0, p.A, p.ub - 1j * p.ua)
    k6 = add(6, k7, -1j * p.u, p.zf - p.fa)
    places = [model.joints[joint].idx_q for joint in (k1, k2, k3, k4, k5, k6, k7)]
    ends = ((k3, -1j * p.ss), (k4, -1j * p.e), (k6, p.zf))
    accelerate, tau = _tied(model, [(k2, -p.d, joint, at) for joint, at in ends], 0.0, 1e-14), np.zeros(7)
    tau[places[0]] = p.torque

    def acceleration(q: Any, v: Any) -> Any:
        arm = (p.sd - 1j * p.sc) * np.exp(1j * q[places[2]])
        reach = p.B + arm - p.C
        force = -p.stiffness * (1.0 - p.rest / abs(reach)) * reach
        tau[places[2]] = (np.conj(1j * arm) * force).real
        return accelerate(q, v, tau)

    start = np.zeros(7)
    start[places] = p.start
    return _run(scene, acceleration, start, np.zeros(7), h, lambda rows: rows[:, places])


def _elastic(scene: Scene, h: float) -> Outcome:
    p, model = ELASTIC, _model()
    hinge = model.addJoint(0, pin.JointModelRevoluteUnaligned(np.array([0.0, -1.0, 0.0])), pin.SE3.Identity(), "hinge")
    slide = model.addJoint(
        hinge, pin.JointModelPrismaticUnaligned(np.array([0.0, 0.0, -1.0])), pin.SE3.Identity(), "slide"
    )
    bob = pin.Inertia(p.mass, np.array([0.0, 0.0, -p.length]), np.eye(3) * p.inertia)
    model.appendBodyToJoint(slide, bob, pin.SE3.Identity())
    data, tau = model.createData(), np.zeros(2)

    def acceleration(q: Any, v: Any) -> Any:
        tau[1] = -p.stiffness * q[1] - p.damping * v[1]
        return pin.aba(model, data, q, v, tau).copy()

    return _run(scene, acceleration, [p.angle, 0.0], np.zeros(2), h, lambda rows: rows)


def attempts(scene: Scene) -> list[Sweep]:
    if scene.family == "S7":
        return space_pinocchio.attempts(scene)
    makers = {"S1": _chain, "S1d": _chain, "S2": _chain, "S3a": _four_bars, "S3b": _andrews, "S5": _elastic}
    make = makers.get(scene.family)
    if make is None:
        return []
    base = 0.02 / max(4, CHAINS[scene.name].n // 4) if scene.family == "S2" else 0.0
    steps = {
        "S2": (base, base / 2, base / 4, base / 16), "S3a": (0.01, 0.005, 0.002), "S5": (5e-4, 2e-4),
        "S3b": (1e-4, 1e-4 / 3, 1e-5, 2e-6),
    }.get(scene.family, (0.02, 0.01, 0.005, 0.002, 0.001, 2e-4))  # fmt: skip
    call = "constraintDynamics" if scene.family.startswith("S3") else "aba"
    return [[Attempt(f"{call}, RK4 in Python h={h:.3g}", partial(make, scene, h)) for h in steps]]


def first_step(scene: Scene) -> None:
    """A model, and one step."""
    _chain(scene, scene.every)
