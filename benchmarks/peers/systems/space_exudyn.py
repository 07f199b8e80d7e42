"""Exudyn in space: a `KinematicTree` with three hinges for a ball joint, bodies on spherical joints, a rolling disc."""

from __future__ import annotations

from functools import partial
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    LoadMassProportional,
    MarkerBodyMass,
    MarkerBodyRigid,
    NodeGenericODE2,
    NodeRigidBodyEP,
    NodeRigidBodyRotVecLG,
    ObjectGround,
    ObjectJointRollingDisc,
    ObjectJointSpherical,
    ObjectKinematicTree,
    ObjectRigidBody,
    SensorBody,
    SensorNode,
)  # fmt: skip

from benchmarks.peers.race import Attempt, Outcome, Sweep, seconds
from benchmarks.peers.scenes import Scene
from benchmarks.peers.space import COIN, TREES, Tree, centers, rotation, tree

SOLVERS = exu.DynamicSolverType
HINGES = (exu.JointType.RevoluteX, exu.JointType.RevoluteY, exu.JointType.RevoluteZ)
SLIDES = (exu.JointType.PrismaticX, exu.JointType.PrismaticY, exu.JointType.PrismaticZ)
TINY = (np.zeros((3, 3)), np.zeros(3), 0.0)
STEPS = {
    "S7_top": (0.025, 0.0125, 0.01, 5e-3, 2.5e-3, 1e-3, 5e-4, 2.5e-4, 1e-4),
    "S7_double": (0.05, 0.025, 0.02, 0.01, 0.005, 0.002, 0.001),
    "S7_chain": (0.02, 0.01, 0.005, 0.002, 0.001, 5e-4),
    "S7_human": (0.05, 0.025, 0.0125, 0.01, 0.005, 0.0025, 0.001),
    "S7_coin": (0.02, 0.01, 0.005, 0.002, 0.001, 5e-4, 2e-4),
}


def _solve(
    scene: Scene,
    system: Any,
    h: float,
    solver: Any,
    rho: float | None = None,
    newton: tuple[float, float] = (1e-10, 1e-11),
) -> float:
    system.Assemble()
    words = exu.SimulationSettings()
    stepping = words.timeIntegration
    stepping.endTime, stepping.numberOfSteps, stepping.verboseMode = scene.until, round(scene.until / h), 0
    stepping.automaticStepSize, stepping.adaptiveStep = False, False
    if rho is not None:
        stepping.generalizedAlpha.spectralRadius = rho
    stepping.newton.useModifiedNewton = True
    stepping.newton.relativeTolerance, stepping.newton.absoluteTolerance = 1e-10, 1e-11
    stepping.explicitIntegration.useLieGroupIntegration = True
    stepping.explicitIntegration.dynamicSolverType = solver
    words.solutionSettings.writeSolutionToFile = False
    words.solutionSettings.sensorsWritePeriod = scene.every
    words.displayStatistics = words.displayComputationTime = False
    words.linearSolverType = exu.LinearSolverType.EXUdense
    words.parallel.numberOfThreads = 1
    return seconds(lambda: system.SolveDynamic(words, solverType=solver))


def _stored(scene: Scene, system: Any, sensor: Any) -> Any:
    """What a sensor has stored at the scene's times."""
    table = np.asarray(system.GetSensorStoredData(sensor))
    rows = np.minimum(np.searchsorted(table[:, 0], scene.times - 1e-9 * scene.until), len(table) - 1)
    if np.abs(table[rows, 0] - scene.times).max() > 1e-9 * scene.every:
        raise RuntimeError(f"stopped at t = {table[-1, 0]:.4g} s")
    return table[rows, 1:]


def _as_tree(scene: Scene, tree: Tree, h: float, solver: Any, **words: Any) -> Outcome:
    """Every hinge is a joint of the tree; links between the hinges of one body weigh nothing."""
    system = exu.SystemContainer().AddSystem()
    types, parents, offsets, links, last, turned = [], list[int](), [], [], list[int](), []
    for part in tree.parts:
        kinds = ([(kind, None) for kind in SLIDES] if part.floats else []) + [
            (HINGES[int(np.argmax(np.abs(axis)))], axis) for axis in part.axes
        ]
        for k, (kind, axis) in enumerate(kinds):
            parents.append((last[part.parent] if part.parent >= 0 else -1) if k == 0 else len(types) - 1)
            offsets.append(np.array(part.at) if k == 0 else np.zeros(3))
            types.append(kind)
            turned.append(-1.0 if axis is not None and min(axis) < 0.0 else 1.0)
            links.append(TINY)
        links[-1] = (np.diag(part.inertia), np.array(part.center), part.mass)
        last.append(len(types) - 1)
    n, sign = len(types), np.array(turned)
    node = system.AddNode(
        NodeGenericODE2(
            referenceCoordinates=[0.0] * n, initialCoordinates=list(sign * tree.q),
            initialCoordinates_t=list(sign * tree.v), numberOfODE2Coordinates=n,
        )
    )  # fmt: skip
    inertias, places, masses = zip(*links, strict=True)
    system.AddObject(
        ObjectKinematicTree(
            nodeNumber=node, jointTypes=types, linkParents=parents, jointOffsets=exu.Vector3DList(offsets),
            jointTransformations=exu.Matrix3DList([np.eye(3)] * n), linkInertiasCOM=exu.Matrix3DList(list(inertias)),
            linkCOMs=exu.Vector3DList(list(places)), linkMasses=list(masses), gravity=list(tree.gravity),
        )
    )  # fmt: skip
    sensor = system.AddSensor(
        SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=exu.OutputVariableType.Coordinates)
    )
    spent = _solve(scene, system, h, solver, **words)
    return Outcome(centers(tree, sign * _stored(scene, system, sensor)), spent, round(scene.until / h))


def _moving(tree: Tree) -> list[tuple[Any, Any, Any, Any]]:
    """R, center, its velocity and ω in body axes of every body at the start; of trees of balls."""
    found: list[tuple[Any, Any, Any, Any]] = []
    known: list[tuple[Any, Any, Any, Any]] = []
    for part in tree.parts:
        R, p, v, w = (np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3)) if part.parent < 0 else known[part.parent]
        arm = R @ np.array(part.at)
        p, v, R = p + arm, v + np.cross(w, arm), R @ rotation(part.q)
        w = w + R @ np.array(part.v)
        known.append((R, p, v, w))
        out = R @ np.array(part.center)
        found.append((R, p + out, v + np.cross(w, out), R.T @ w))
    return found


def _as_bodies(scene: Scene, tree: Tree, h: float, solver: Any, **words: Any) -> Outcome:
    """Bodies with Euler parameters on spherical joints."""
    system = exu.SystemContainer().AddSystem()
    ground, bodies, sensors = system.AddObject(ObjectGround()), list[Any](), list[Any]()
    for part, (R, place, velocity, omega) in zip(tree.parts, _moving(tree), strict=True):
        p = _quaternion(R)
        change = 0.5 * np.array([
            [-p[1], -p[2], -p[3]], [p[0], -p[3], p[2]], [p[3], p[0], -p[1]], [-p[2], p[1], p[0]],
        ]) @ omega  # fmt: skip
        node = system.AddNode(
            NodeRigidBodyEP(referenceCoordinates=[*place, *p], initialVelocities=[*velocity, *change])
        )
        inertia = [*part.inertia, 0.0, 0.0, 0.0]
        body = system.AddObject(ObjectRigidBody(physicsMass=part.mass, physicsInertia=inertia, nodeNumber=node))
        at = system.AddMarker(MarkerBodyMass(bodyNumber=body))
        system.AddLoad(LoadMassProportional(markerNumber=at, loadVector=list(tree.gravity)))
        above, before = (
            (ground, np.zeros(3))
            if part.parent < 0
            else (bodies[part.parent], np.array(tree.parts[part.parent].center))
        )
        ends = (above, np.array(part.at) - before), (body, -np.array(part.center))
        markers = [system.AddMarker(MarkerBodyRigid(bodyNumber=b, localPosition=list(local))) for b, local in ends]
        system.AddObject(ObjectJointSpherical(markerNumbers=markers))
        bodies.append(body)
        kind = exu.OutputVariableType.Position
        sensors.append(system.AddSensor(SensorBody(bodyNumber=body, storeInternal=True, outputVariableType=kind)))
    spent = _solve(scene, system, h, solver, **words)
    return Outcome(
        tree.scale * np.hstack([_stored(scene, system, sensor) for sensor in sensors]), spent, round(scene.until / h)
    )


def _quaternion(R: Any) -> Any:
    values, vectors = np.linalg.eigh(np.array([
        [R[0, 0] + R[1, 1] + R[2, 2], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
        [R[2, 1] - R[1, 2], R[0, 0] - R[1, 1] - R[2, 2], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]],
        [R[0, 2] - R[2, 0], R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], R[1, 2] + R[2, 1]],
        [R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1]],
    ]))  # fmt: skip
    return vectors[:, np.argmax(values)]


def _coin(scene: Scene, h: float, solver: Any, **words: Any) -> Outcome:
    """Its joint for an ideal disc; the axis of the disc is the body's x."""
    p, system = COIN, exu.SystemContainer().AddSystem()
    ground = system.AddObject(ObjectGround())
    R = np.column_stack([p.axis, np.cross(p.up, p.axis), p.up])
    across = p.mass * p.radius**2 / 4.0
    node = system.AddNode(
        NodeRigidBodyRotVecLG(
            referenceCoordinates=[*p.place, 0.0, 0.0, 0.0],
            initialVelocities=[*np.cross(p.omega, p.place), *(R.T @ p.omega)],
            initialCoordinates=[0.0, 0.0, 0.0, *_vector(R)],
        )
    )  # fmt: skip
    inertia = [2.0 * across, across, across, 0.0, 0.0, 0.0]
    body = system.AddObject(ObjectRigidBody(physicsMass=p.mass, physicsInertia=inertia, nodeNumber=node))
    at = system.AddMarker(MarkerBodyMass(bodyNumber=body))
    system.AddLoad(LoadMassProportional(markerNumber=at, loadVector=[0.0, 0.0, -9.81]))
    markers = [system.AddMarker(MarkerBodyRigid(bodyNumber=each)) for each in (ground, body)]
    system.AddObject(ObjectJointRollingDisc(markerNumbers=markers, discRadius=p.radius))
    kinds = exu.OutputVariableType.Position, exu.OutputVariableType.RotationMatrix
    sensors = [
        system.AddSensor(SensorBody(bodyNumber=body, storeInternal=True, outputVariableType=kind)) for kind in kinds
    ]
    spent = _solve(scene, system, h, solver, **words)
    place, turned = (_stored(scene, system, sensor) for sensor in sensors)
    return Outcome(np.hstack([place, turned[:, [0, 3, 6]]]), spent, round(scene.until / h))


def _vector(R: Any) -> Any:
    """Angle times axis."""
    q = _quaternion(R)
    q = q if q[0] >= 0.0 else -q
    angle = 2.0 * np.arctan2(np.linalg.norm(q[1:]), q[0])
    return q[1:] * (angle / np.linalg.norm(q[1:]))


def attempts(scene: Scene) -> list[Sweep]:
    trapezoid, alpha = {"solver": SOLVERS.TrapezoidalIndex2}, {"solver": SOLVERS.GeneralizedAlpha, "rho": 0.9}
    if scene.name == "S7_coin":
        ways: list[tuple[str, Any, dict[str, Any]]] = [
            ("rolling disc, generalized-alpha rho=0.9", _coin, alpha),
            ("rolling disc, generalized-alpha rho=1", _coin, {**alpha, "rho": 1.0}),
            ("rolling disc, trapezoidal index 2", _coin, trapezoid),
        ]
    elif scene.name in TREES:
        own, hinges = tree(scene.name), tree(scene.name).by_hinges
        ways = [
            ("tree of hinges, RK44", partial(_as_tree, tree=hinges), {"solver": SOLVERS.RK44}),
            ("tree of hinges, RK67", partial(_as_tree, tree=hinges), {"solver": SOLVERS.RK67}),
        ]
        if all(part.joint == "ball" for part in own.parts):
            ways.append(("bodies, trapezoidal index 2", partial(_as_bodies, tree=own), trapezoid))
    else:
        return []
    return [
        [Attempt(f"{name} h={h:g}", partial(make, scene, h=h, **words)) for h in STEPS[scene.name]]
        for name, make, words in ways
    ]
