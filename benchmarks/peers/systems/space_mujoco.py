"""MuJoCo in space: ball joints and floating bodies as it has them, or three hinges on one body in their place."""

from __future__ import annotations

from functools import partial
from typing import Any

import mujoco
import numpy as np

from benchmarks.peers.race import Attempt, Outcome, Sweep, seconds
from benchmarks.peers.scenes import Scene
from benchmarks.peers.space import TREES, Part, Tree, centers, tree

STEPS = {
    "S7_top": (0.025, 0.0125, 0.01, 5e-3, 2.5e-3, 1e-3, 5e-4, 2.5e-4, 1e-4, 5e-5),
    "S7_double": (0.1, 0.05, 0.1 / 3, 0.02, 0.01, 0.005, 0.002, 0.001, 5e-4),
    "S7_chain": (0.01, 0.02 / 3, 0.005, 0.004, 0.0025, 0.002, 0.001, 5e-4, 2e-4, 1e-4),
    "S7_human": (0.05, 0.025, 0.05 / 3, 0.01, 0.005, 0.0025, 0.001, 5e-4),
}


def _numbers(values: Any) -> str:
    return " ".join(f"{value:.17g}" for value in values)


def _joints(part: Part) -> str:
    if part.joint == "free":
        return "<freejoint/>"
    if part.joint == "ball":
        return '<joint type="ball"/>'
    slides = "".join(f'<joint type="slide" axis="{_numbers(axis)}"/>' for axis in np.eye(3)) if part.floats else ""
    return slides + "".join(f'<joint type="hinge" axis="{_numbers(axis)}"/>' for axis in part.axes)


def _body(tree: Tree, k: int) -> str:
    part = tree.parts[k]
    mass = f'mass="{part.mass:.17g}" pos="{_numbers(part.center)}" diaginertia="{_numbers(part.inertia)}"'
    inside = "".join(_body(tree, j) for j, each in enumerate(tree.parts) if each.parent == k)
    return f'<body name="b{k}" pos="{_numbers(part.at)}">{_joints(part)}<inertial {mass}/>{inside}</body>'


def _run(scene: Scene, tree: Tree, scheme: str, h: float) -> Outcome:
    roots = "".join(_body(tree, k) for k, part in enumerate(tree.parts) if part.parent < 0)
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian" balanceinertia="false"/><size memory="500M"/><option timestep="{h:.17g}" '
        f'gravity="{_numbers(tree.gravity)}" integrator="{scheme}">'
        f'<flag contact="disable" constraint="disable"/></option>'
        f"<worldbody>{roots}</worldbody></mujoco>"
    )
    data, block = mujoco.MjData(model), round(scene.every / h)
    q, v, place, first = [], [], 0, 0
    order = [model.body(f"b{k}").id for k in range(len(tree.parts))]  # depth first in the model
    for k, part in enumerate(tree.parts):
        joint = model.body_jntadr[order[k]]
        place, first = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        q += range(place, place + len(part.q))
        v += range(first, first + len(part.v))
    data.qpos[q], data.qvel[v] = tree.q, tree.v
    rows = [data.qpos.copy()]

    def run() -> None:
        for _ in scene.times[1:]:
            mujoco.mj_step(model, data, nstep=block)
            rows.append(data.qpos.copy())

    spent = seconds(run)
    return Outcome(centers(tree, np.array(rows)[:, q]), spent, block * (len(scene.times) - 1))


def attempts(scene: Scene) -> list[Sweep]:
    if scene.name not in TREES:
        return []
    own, hinges = tree(scene.name), tree(scene.name).by_hinges
    return [
        [Attempt(f"{name}, {scheme} h={h:g}", partial(_run, scene, made, scheme, h)) for h in STEPS[scene.name]]
        for name, made, scheme in (
            ("ball joints", own, "RK4"), ("three hinges", hinges, "RK4"), ("ball joints", own, "implicitfast"),
        )
    ]  # fmt: skip
