"""Drake in space: ball joints by roll, pitch and yaw or three hinges; error-controlled Runge–Kutta."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from pydrake.all import (
    BallRpyJoint,
    DiagramBuilder,
    FixedOffsetFrame,
    MultibodyPlant,
    PrismaticJoint,
    QuaternionFloatingJoint,
    RevoluteJoint,
    RigidTransform,
    RotationalInertia,
    Simulator,
    SpatialInertia,
)  # fmt: skip

from benchmarks.peers.race import Attempt, Outcome, Sweep
from benchmarks.peers.scenes import Scene
from benchmarks.peers.space import TREES, Part, Tree, centers, rotation, tree

ACCURACIES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
STEPS = {"S7_top": (2.5e-3, 5e-4), "S7_double": (0.01, 0.001), "S7_chain": (0.005, 5e-4), "S7_human": (0.0125, 0.0025)}


def _joints(plant: Any, part: Part, frame: Any, body: Any, name: str) -> list[Any]:
    """Added between a frame and a body: one, or hinges and slides with bodies without mass between them."""
    if part.joint == "ball":
        return [plant.AddJoint(BallRpyJoint(name, frame, body.body_frame()))]
    if part.joint == "free":
        return [plant.AddJoint(QuaternionFloatingJoint(name, frame, body.body_frame()))]
    made = []
    kinds: list[tuple[Any, Any]] = [(PrismaticJoint, axis) for axis in np.eye(3)] if part.floats else []
    kinds += [(RevoluteJoint, np.array(axis)) for axis in part.axes]
    for k, (kind, axis) in enumerate(kinds):
        last = k == len(kinds) - 1
        onto = body if last else plant.AddRigidBody(f"{name} {k}", SpatialInertia.Zero())
        made.append(plant.AddJoint(kind(f"{name} {k}", frame, onto.body_frame(), axis)))
        frame = onto.body_frame()
    return made


def _native(tree: Tree) -> Tree:
    """What its coordinates are: angles of balls about z, y, x in turn."""
    hinges = replace(tree, turns="zyx").by_hinges
    parts = [part if part.joint == "free" else hinges.parts[k] for k, part in enumerate(tree.parts)]
    return replace(tree, parts=tuple(parts))


def _start(part: Part, shown: Part) -> tuple[list[float], Any]:
    """q and v of its joint."""
    if part.joint == "free":
        return [*part.q[3:], *part.q[:3]], np.r_[rotation(part.q[3:]) @ np.array(part.v[3:]), part.v[:3]]
    if part.joint == "ball":
        return list(shown.q[::-1]), rotation(part.q) @ np.array(part.v)
    return list(part.q), np.array(part.v)


def _run(scene: Scene, tree: Tree, **words: Any) -> Outcome:
    from benchmarks.peers.systems.by_drake import _advance, _integrate_by

    builder, shown = DiagramBuilder(), _native(tree)
    plant, bodies, joints = builder.AddSystem(MultibodyPlant(time_step=0.0)), list[Any](), list[list[Any]]()
    for k, part in enumerate(tree.parts):
        inertia = SpatialInertia.MakeFromCentralInertia(part.mass, list(part.center), RotationalInertia(*part.inertia))
        body = plant.AddRigidBody(f"body {k}", inertia)
        base = plant.world_frame() if part.parent < 0 else bodies[part.parent].body_frame()
        frame = plant.AddFrame(FixedOffsetFrame(f"at {k}", base, RigidTransform(list(part.at))))
        joints.append(_joints(plant, part, frame, body, f"joint {k}"))
        bodies.append(body)
    plant.mutable_gravity_field().set_gravity_vector(list(tree.gravity))
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    q, v, order = np.zeros(plant.num_positions()), np.zeros(plant.num_velocities()), list[int]()
    for part, each, own in zip(tree.parts, shown.parts, joints, strict=True):
        places = [joint.position_start() + j for joint in own for j in range(joint.num_positions())]
        speeds = [joint.velocity_start() + j for joint in own for j in range(joint.num_velocities())]
        q[places], v[speeds] = _start(part, each)
        order += {"ball": places[::-1], "free": [*places[4:], *places[:4]]}.get(part.joint, places)
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    _integrate_by(simulator, words["scheme"], words.get("accuracy", 0.0), words.get("step", 0.0))
    simulator.Initialize()
    rows, spent = _advance(simulator, scene, lambda: plant.GetPositions(context).copy())
    taken = simulator.get_integrator().get_num_steps_taken()
    return Outcome(centers(shown, rows[:, order]), spent, taken)


def attempts(scene: Scene) -> list[Sweep]:
    if scene.name not in TREES:
        return []
    own = tree(scene.name)
    ways = [("three hinges", own.by_hinges)]
    if scene.name != "S7_chain":  # whose first bar begins at the singularity of roll, pitch and yaw
        ways.append(("ball joints", own))
    sweeps = []
    for name, made in ways:
        for scheme in ("runge_kutta5", "runge_kutta3"):
            run = partial(_run, scene, made, scheme=scheme)
            sweeps.append([Attempt(f"{name}, {scheme} accuracy={a:g}", partial(run, accuracy=a)) for a in ACCURACIES])
        fixed = partial(_run, scene, made, scheme="runge_kutta5")
        sweeps.append([Attempt(f"{name}, runge_kutta5 h={h:g}", partial(fixed, step=h)) for h in STEPS[scene.name]])
    return sweeps
