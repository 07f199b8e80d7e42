"""MuJoCo: hinge trees, `mj_step` in blocks between output times; loops, limits and contacts are its soft constraints.

The planar scenes lie in x–z; a hinge about −y turns θ from straight down towards +x.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import mujoco
import numpy as np

from benchmarks.peers.race import Attempt, Outcome, Sweep, seconds
from benchmarks.peers.scenes import (
    ANDREWS,
    BALL,
    CHAINS,
    ELASTIC,
    FOUR_BARS,
    LEG,
    STOP,
    WHEEL,
    G,
    Scene,
)  # fmt: skip
from benchmarks.peers.systems import space_mujoco

HINGE = '<joint type="hinge" axis="0 -1 0" {}/>'
HARD, HARD_LIMIT = 'solimp="0.9999 0.9999 0.001"', 'solimplimit="0.9999 0.9999 0.001"'
RESETS = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)


def version() -> str:
    return str(mujoco.__version__)


def _model(
    h: float, scheme: str, bodies: str, rest: str = "", flags: str = 'contact="disable"', gravity: str = f"0 0 {-G}",
    option: str = "",
) -> Any:  # fmt: skip
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian" autolimits="true" boundmass="0"/><size memory="500M"/>'
        f'<option gravity="{gravity}" timestep="{h:.15g}" integrator="{scheme}" {option}><flag {flags}/></option>'
        f"<worldbody>{bodies}</worldbody>{rest}</mujoco>"
    )


def _mass(mass: float, inertia: float, x: float, z: float) -> str:
    around = " ".join([f"{inertia:.17g}"] * 3)
    return f'<inertial pos="{x:.17g} 0 {z:.17g}" mass="{mass:.17g}" diaginertia="{around}"/>'


def _run(scene: Scene, model: Any, q: Any, read: Callable[[Any], Any], v: Any = 0.0, force: Any = 0.0) -> Outcome:
    """Blocks of steps; a model that blew up is put back to its start by MuJoCo, which counts as a failure."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q, v, force
    mujoco.mj_forward(model, data)
    block = round(scene.every / model.opt.timestep)
    rows = [data.qpos.copy()]

    def run() -> None:
        for _ in scene.times[1:]:
            mujoco.mj_step(model, data, nstep=block)
            rows.append(data.qpos.copy())

    spent = seconds(run)
    if any(data.warning[reset].number for reset in RESETS):
        raise RuntimeError("the simulation blew up and was reset")
    return Outcome(read(np.array(rows)), spent, block * (len(scene.times) - 1))


def _summed(rows: Any) -> Any:
    return np.cumsum(rows, axis=1)


def _chain(scene: Scene, scheme: str, h: float) -> Outcome:
    p = CHAINS[scene.name]
    rod = _mass(p.mass, p.mass * p.length**2 / 12.0, 0.0, -p.length / 2.0)
    bodies = "".join(
        f'<body pos="0 0 {-p.length if k else 0.0:.17g}">{HINGE.format(f"""damping="{p.damping}" """)}{rod}'
        for k in range(p.n)
    )
    model = _model(h, scheme, bodies + "</body>" * p.n, flags='contact="disable" constraint="disable"')
    return _run(scene, model, np.diff(p.angles, prepend=0.0), _summed)


def _four_bars(scene: Scene, scheme: str, h: float) -> Outcome:
    p = FOUR_BARS[scene.name]
    inertia, joint, bodies, ties = p.mass * p.length**2 / 12.0, HINGE.replace("-1", "1").format(""), "", ""
    for k in range(p.n + 1):
        bodies += f'<body name="p{k}" pos="{k * p.length} 0 0">{joint}{_mass(p.mass, inertia, 0.0, p.length / 2.0)}'
        if k < p.n:
            coupler = _mass(p.mass, inertia, p.length / 2.0, 0.0)
            bodies += f'<body name="c{k}" pos="0 0 {p.length}">{joint}{coupler}</body>'
            ties += f'<connect body1="c{k}" body2="p{k + 1}" anchor="{p.length} 0 0" solref="{2.0 * h:.9g} 1" {HARD}/>'
        bodies += "</body>"
    rate = p.speed / p.length
    v = [rate if k % 2 == 0 else -rate for k in range(2 * p.n + 1)]
    model = _model(h, scheme, bodies, f"<equality>{ties}</equality>", option='tolerance="1e-14" iterations="50"')
    return _run(scene, model, 0.0, lambda rows: rows[:, :1], v)


def _andrews(scene: Scene, scheme: str, h: float) -> Outcome:
    """Bodies in the order K1 K2 K3 K5 K4 K7 K6."""
    p = ANDREWS
    joint = HINGE.format("")

    def body(k: int, at: complex, center: complex, inside: str = "") -> str:
        own = _mass(p.masses[k - 1], p.inertias[k - 1], np.real(center), np.imag(center))
        return f'<body name="K{k}" pos="{np.real(at):.17g} 0 {np.imag(at):.17g}">{joint}{own}{inside}</body>'

    def site(name: str, at: complex) -> str:
        return f'<site name="{name}" pos="{np.real(at):.17g} 0 {np.imag(at):.17g}"/>'

    tip = {k: site(f"E{k}", at) for k, at in {2: -p.d, 3: -1j * p.ss, 4: -1j * p.e, 6: p.zf}.items()}
    bodies = body(1, 0.0, p.ra, body(2, p.rr, -p.da, tip[2]))
    bodies += body(3, p.B, p.sb - 1j * p.sa, tip[3] + site("D", p.sd - 1j * p.sc))
    bodies += body(5, p.A, p.ta + 1j * p.tb, body(4, p.zt, -1j * (p.e - p.ea), tip[4]))
    bodies += body(7, p.A, p.ub - 1j * p.ua, body(6, -1j * p.u, p.zf - p.fa, tip[6])) + site("C", p.C)
    ends = '<site site="D"/><site site="C"/>'
    spring = f'<tendon><spatial stiffness="{p.stiffness}" springlength="{p.rest}">{ends}</spatial></tendon>'
    ties = "".join(f'<connect site1="E2" site2="E{k}" solref="{2.0 * h:.12g} 1" {HARD}/>' for k in (3, 4, 6))
    model = _model(
        h,
        scheme,
        bodies,
        f"{spring}<equality>{ties}</equality>",
        gravity="0 0 0",
        option='tolerance="1e-15" iterations="100"',
    )
    order = [0, 1, 2, 4, 3, 6, 5]
    force = np.r_[p.torque, np.zeros(6)]
    return _run(scene, model, np.array(p.start)[order], lambda rows: rows[:, order], force=force)


def _elastic(scene: Scene, scheme: str, h: float) -> Outcome:
    p = ELASTIC
    slide = f'<joint type="slide" axis="0 0 -1" stiffness="{p.stiffness}" damping="{p.damping}"/>'
    bodies = f"<body>{HINGE.format('')}{slide}{_mass(p.mass, p.inertia, 0.0, -p.length)}</body>"
    model = _model(h, scheme, bodies, flags='contact="disable" constraint="disable"')
    return _run(scene, model, [p.angle, 0.0], lambda rows: rows)


def _stop(scene: Scene, scheme: str, h: float) -> Outcome:
    """A joint limit with stiffness and damping per unit of inertia, as MuJoCo wants them."""
    p = STOP
    inertia = p.mass * p.length**2 / 3.0
    stiffness, damping = p.stiffness * p.length**2 / inertia, p.damping * p.length**2 / inertia
    limit = f'limited="true" range="{p.at} 10" solreflimit="{-stiffness:.9g} {-damping:.9g}" {HARD_LIMIT}'
    rod = _mass(p.mass, p.mass * p.length**2 / 12.0, 0.0, -p.length / 2.0)
    model = _model(h, scheme, f"<body>{HINGE.format(limit)}{rod}</body>", option='tolerance="1e-14"')
    return _run(scene, model, [p.angle], lambda rows: rows)


def _leg(scene: Scene, scheme: str, h: float, ratio: float) -> Outcome:
    """The stop is a joint limit; its damping ratio must be well above 1, or it rebounds."""
    p = LEG
    limit = f'limited="true" range="-10 0" solreflimit="{2.0 * h:.9g} {ratio}" {HARD_LIMIT}'
    thigh = _mass(p.thigh_mass, p.thigh_mass * p.thigh**2 / 12.0, 0.0, -p.thigh / 2.0)
    shank = _mass(p.shank_mass, p.shank_mass * p.shank**2 / 12.0, 0.0, -p.shank / 2.0)
    inside = f'<body pos="0 0 {-p.thigh}">{HINGE.format(limit)}{shank}</body>'
    model = _model(h, scheme, f"<body>{HINGE.format('')}{thigh}{inside}</body>", option='tolerance="1e-14"')
    return _run(scene, model, [p.angles[0], p.angles[1] - p.angles[0]], _summed)


def _zeta(e: float) -> float:
    """Damping ratio of a spring and damper that cannot pull, for restitution e: exp(−tan f (π − 2f)) = e, ζ = sin f."""
    from scipy.optimize import brentq

    return float(np.sin(brentq(lambda f: np.exp(-np.tan(f) * (np.pi - 2.0 * f)) - e, 1e-6, 1.4)))


def _ball(scene: Scene, scheme: str, h: float, share: float) -> Outcome:
    """Contact by a spring of frequency share/h with the damping of the wanted restitution."""
    p, frequency = BALL, share / h
    law = f'solref="{-(frequency**2):.9g} {-2.0 * _zeta(p.restitution) * frequency:.9g}" {HARD}'
    bodies = (
        f'<geom type="plane" size="5 5 .1" {law}/>'
        f'<body pos="0 0 {p.height + p.radius}"><joint type="slide" axis="0 0 1"/>'
        f'<geom type="sphere" size="{p.radius}" mass="{p.mass}" {law}/></body>'
    )
    model = _model(h, scheme, bodies, flags='contact="enable"', option='cone="elliptic"')
    return _run(scene, model, [0.0], lambda rows: rows + p.height)


def _wheel(scene: Scene, scheme: str, h: float) -> Outcome:
    """Small spheres as feet; the times at which the wheel has turned by another spoke, interpolated within a step."""
    p, radius, half = WHEEL[scene.name], 1e-4, np.pi / WHEEL[scene.name].spokes
    turns = 2.0 * half * np.arange(p.spokes)
    feet = "".join(
        f'<geom type="sphere" size="{radius}" mass="0" pos="{x:.12g} 0 {-z:.12g}" friction="2"/>'
        for x, z in zip(p.length * np.sin(turns), p.length * np.cos(turns), strict=True)
    )
    joints = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 1 0"/>'
    body = f'<body pos="0 0 {p.length + radius}">{joints}{_mass(p.mass, p.inertia, 0.0, 0.0)}{feet}</body>'
    law = f'<default><geom solref="{2.0 * h:.9g} 10" solimp="0.999 0.999 0.001"/></default>'
    model = _model(
        h, scheme, f'<geom type="plane" size="100 5 .1" friction="2"/>{body}', law, 'contact="enable"',
        f"{G * np.sin(p.slope):.15g} 0 {-G * np.cos(p.slope):.15g}", 'cone="elliptic" impratio="100" tolerance="1e-12"',
    )  # fmt: skip
    data, times, steps, due = mujoco.MjData(model), [], 0, half
    data.qpos[:] = [0.0, p.length * (np.cos(half) - 1.0), -half]
    data.qvel[:] = [p.speed * p.length * np.cos(half), p.speed * p.length * np.sin(half), p.speed]

    def run() -> None:
        nonlocal steps, due
        while len(times) < p.steps and data.time < scene.until:
            before = data.qpos[2]
            mujoco.mj_step(model, data)
            steps += 1
            if before < due <= data.qpos[2]:
                times.append(data.time - h * (data.qpos[2] - due) / (data.qpos[2] - before))
                due += 2.0 * half

    spent = seconds(run)
    return Outcome(np.array(times)[:, None], spent, steps)


MAKERS: dict[str, tuple[Any, Sequence[tuple[Any, ...]]]] = {
    "S1": (_chain, [("RK4", (0.02, 0.01, 0.005, 0.002, 0.001, 5e-4, 2e-4)), ("implicitfast", (0.01, 0.001, 1e-4))]),
    "S1d": (_chain, [("RK4", (0.02, 0.01, 0.005, 0.002, 0.001, 5e-4)), ("implicitfast", (0.01, 0.001, 1e-4))]),
    "S3a": (_four_bars, [("RK4", (0.005, 0.002, 0.001, 5e-4)), ("implicitfast", (0.002, 0.001, 2e-4))]),
    "S3b": (_andrews, [("RK4", (1e-4, 2e-5, 5e-6, 1e-6)), ("implicitfast", (1e-5, 1e-6))]),
    "S4a": (_ball, [("Euler", (1e-3, 1e-4, 2e-5), share) for share in (0.05, 0.2)] + [("RK4", (1e-4, 2e-5), 0.05)]),
    "S4b": (_wheel, [("implicitfast", (2e-3, 5e-4, 1e-4)), ("RK4", (5e-4, 1e-4))]),
    "S4c": (_leg, [("implicitfast", (2e-3, 1e-3, 1e-4, 1e-5), 10), *(("RK4", (1e-3, 1e-4), d) for d in (10, 1))]),
    "S5": (_elastic, [("RK4", (5e-4, 2e-4, 1e-4)), ("implicitfast", (1e-3, 1e-4))]),
    "S5b": (_stop, [("RK4", (1e-3, 1e-4, 1e-5)), ("implicitfast", (1e-3, 1e-4, 1e-5))]),
}  # fmt: skip
"""Maker; and for each sweep the integrator, its steps, and further arguments."""


def attempts(scene: Scene) -> list[Sweep]:
    if scene.family == "S7":
        return space_mujoco.attempts(scene)
    if scene.family == "S2":
        base = 0.02 / max(4, CHAINS[scene.name].n // 4)
        make, sweeps = _chain, [("RK4", (base, base / 2, base / 4, base / 16, base / 64))]
    else:
        key = scene.name if scene.name in MAKERS else scene.family
        if key not in MAKERS or scene.name == "S4b_point":
            return []
        make, sweeps = MAKERS[key]
    return [
        [
            Attempt(" ".join(map(str, (scheme, f"h={h:.3g}", *more))), partial(make, scene, scheme, h, *more))
            for h in steps
        ]
        for scheme, steps, *more in sweeps
    ]


def first_step(scene: Scene) -> None:
    """A model from XML, and one step."""
    _chain(scene, "RK4", scene.every)
