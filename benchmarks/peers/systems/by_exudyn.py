# ruff: noqa: E402 — the switch must come before the import
"""Exudyn: bodies and joints in redundant coordinates, or a `KinematicTree` in joint coordinates; `SolveDynamic`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

sys.exudynFast = True  # type: ignore[attr-defined]  # the documented switch to its fast build

import exudyn as exu
from exudyn.itemInterface import (
    CoordinateSpringDamperExt,
    LoadCoordinate,
    LoadMassProportional,
    MarkerBodyMass,
    MarkerBodyRigid,
    MarkerNodeCoordinate,
    Mass1D,
    Node1D,
    NodeGenericData,
    NodeGenericODE2,
    NodePointGround,
    NodeRigidBody2D,
    ObjectContactCoordinate,
    ObjectGround,
    ObjectKinematicTree,
    ObjectRigidBody2D,
    RevoluteJoint2D,
    SensorNode,
    SpringDamper,
    Torque,
    TorsionalSpringDamper,
)  # fmt: skip

from benchmarks.peers.race import Attempt, Outcome, Sweep, seconds
from benchmarks.peers.scenes import ANDREWS, BALL, CHAINS, ELASTIC, FOUR_BARS, LEG, STOP, G, Scene
from benchmarks.peers.systems import space_exudyn

SOLVERS = exu.DynamicSolverType
REVOLUTE, SLIDE_Y = exu.JointType.RevoluteZ, exu.JointType.PrismaticY


def version() -> str:
    return str(exu.__version__)


class World:
    """A system to be filled with items, and how it is solved."""

    def __init__(self) -> None:
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        self.ground = self.system.AddObject(ObjectGround())
        self.sensors: list[Any] = []

    def watch(self, node: Any) -> None:
        """Record the coordinates of a node."""
        kind = exu.OutputVariableType.Coordinates
        self.sensors.append(
            self.system.AddSensor(SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind))
        )

    def marker(self, body: Any, at: complex) -> Any:
        place = [float(np.real(at)), float(np.imag(at)), 0.0]
        return self.system.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=place))

    def coordinate(self, node: Any, index: int) -> Any:
        return self.system.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=index))

    def fixed(self) -> Any:
        return self.coordinate(self.system.AddNode(NodePointGround()), 0)

    def body(
        self, mass: float, inertia: float, center: complex, angle: float, v: tuple[float, float, float], g: float = G
    ) -> Any:
        """A planar body, its center, angle and velocities (x, y, rotation)."""
        node = self.system.AddNode(
            NodeRigidBody2D(referenceCoordinates=[np.real(center), np.imag(center), angle], initialVelocities=list(v))
        )
        body = self.system.AddObject(ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))
        if g:
            at = self.system.AddMarker(MarkerBodyMass(bodyNumber=body))
            self.system.AddLoad(LoadMassProportional(markerNumber=at, loadVector=[0.0, -g, 0.0]))
        self.watch(node)
        return body

    def joint(self, first: Any, at: complex, second: Any, there: complex) -> None:
        self.system.AddObject(RevoluteJoint2D(markerNumbers=[self.marker(first, at), self.marker(second, there)]))

    def tree(
        self, masses: Sequence[float], inertias: Sequence[float], centers: Sequence[float], offsets: Sequence[float],
        start: Sequence[float], types: Any = None, stiffness: Sequence[float] = (), damping: Sequence[float] = (),
    ) -> Any:  # fmt: skip
        """Links along −y in a row; centers and offsets are y coordinates."""
        n = len(masses)
        node = self.system.AddNode(
            NodeGenericODE2(
                referenceCoordinates=[0.0] * n, initialCoordinates=list(map(float, start)),
                initialCoordinates_t=[0.0] * n, numberOfODE2Coordinates=n,
            )
        )  # fmt: skip

        def along(values: Sequence[float]) -> Any:
            return exu.Vector3DList([np.array([0.0, y, 0.0]) for y in values])

        self.system.AddObject(
            ObjectKinematicTree(
                nodeNumber=node, jointTypes=types or [REVOLUTE] * n, linkParents=list(range(-1, n - 1)),
                jointTransformations=exu.Matrix3DList([np.eye(3)] * n), jointOffsets=along(offsets),
                linkInertiasCOM=exu.Matrix3DList([np.eye(3) * inertia for inertia in inertias]),
                linkCOMs=along(centers),
                linkMasses=list(map(float, masses)), gravity=[0.0, -G, 0.0], jointPControlVector=list(stiffness),
                jointDControlVector=list(damping), jointPositionOffsetVector=[0.0] * len(stiffness),
                jointVelocityOffsetVector=[0.0] * len(damping),
            )
        )  # fmt: skip
        self.watch(node)
        return node

    def limit(self, node: Any, index: int, lower: float, upper: float, stiffness: float, damping: float) -> None:
        """Stops of a coordinate by springs and dampers."""
        states = self.system.AddNode(NodeGenericData(initialCoordinates=[0.0] * 3, numberOfDataCoordinates=3))
        self.system.AddObject(
            CoordinateSpringDamperExt(
                markerNumbers=[self.fixed(), self.coordinate(node, index)], limitStopsLower=lower,
                limitStopsUpper=upper,
                limitStopsStiffness=stiffness, limitStopsDamping=damping, useLimitStops=True, nodeNumber=states,
            )
        )  # fmt: skip

    def solve(
        self, scene: Scene, h: float, read: Callable[[list[Any]], Any], solver: Any = SOLVERS.GeneralizedAlpha,
        rho: float = 0.9, sparse: bool = False, newton: tuple[float, float] = (1e-10, 1e-11), adaptive: bool = True,
    ) -> Outcome:  # fmt: skip
        """Run and read what the sensors stored, at the scene's times if the steps hit them."""
        self.system.Assemble()
        words = exu.SimulationSettings()
        stepping = words.timeIntegration
        stepping.endTime, stepping.numberOfSteps, stepping.verboseMode = scene.until, round(scene.until / h), 0
        stepping.automaticStepSize, stepping.adaptiveStep = False, adaptive
        stepping.generalizedAlpha.spectralRadius = rho
        stepping.newton.useModifiedNewton = True
        stepping.newton.relativeTolerance, stepping.newton.absoluteTolerance = newton
        words.solutionSettings.writeSolutionToFile = False
        words.solutionSettings.sensorsWritePeriod = scene.every
        words.displayStatistics = words.displayComputationTime = False
        words.linearSolverType = exu.LinearSolverType.EigenSparse if sparse else exu.LinearSolverType.EXUdense
        words.parallel.numberOfThreads = 1
        spent = seconds(lambda: self.system.SolveDynamic(words, solverType=solver))
        stored = [np.asarray(self.system.GetSensorStoredData(sensor)) for sensor in self.sensors]
        own = stored[0][:, 0]
        rows = np.minimum(np.searchsorted(own, scene.times - 1e-9 * scene.until), len(own) - 1)
        if np.abs(own[rows] - scene.times).max() < 1e-9 * scene.every:
            return Outcome(read([table[rows, 1:] for table in stored]), spent, int(stepping.numberOfSteps))
        if own[-1] < scene.until * (1.0 - 1e-9):
            raise RuntimeError(f"stopped at t = {own[-1]:.4g} s")
        later = np.append(True, np.diff(own) > 0.0)
        return Outcome(
            read([table[later, 1:] for table in stored]), spent, int(stepping.numberOfSteps), times=own[later]
        )


def _chain_of_bodies(scene: Scene, h: float, **words: Any) -> Outcome:
    p, world = CHAINS[scene.name], World()
    above, at, place = world.ground, 0j, 0j
    for angle in p.angles:
        along = np.sin(angle) - 1j * np.cos(angle)
        rod = world.body(p.mass, p.mass * p.length**2 / 12.0, place + 0.5 * p.length * along, angle, (0.0, 0.0, 0.0))
        world.joint(above, at, rod, 0.5j * p.length)
        if p.damping:
            markers = [world.marker(above, at), world.marker(rod, 0.5j * p.length)]
            world.system.AddObject(TorsionalSpringDamper(markerNumbers=markers, damping=p.damping))
        above, at, place = rod, -0.5j * p.length, place + p.length * along
    return world.solve(
        scene, h, lambda tables: np.column_stack([t[:, 2] for t in tables]) + np.array(p.angles), **words
    )


def _chain_as_tree(scene: Scene, h: float, **words: Any) -> Outcome:
    p, world = CHAINS[scene.name], World()
    offsets, damping = [0.0, *[-p.length] * (p.n - 1)], [p.damping] * p.n if p.damping else []
    world.tree(
        [p.mass] * p.n, [p.mass * p.length**2 / 12.0] * p.n, [-0.5 * p.length] * p.n, offsets,
        np.diff(p.angles, prepend=0.0), stiffness=[0.0] * len(damping), damping=damping,
    )  # fmt: skip
    return world.solve(scene, h, lambda tables: np.cumsum(tables[0], axis=1), **words)


def _four_bars(scene: Scene, h: float, **words: Any) -> Outcome:
    p, world = FOUR_BARS[scene.name], World()
    inertia, half, rate = p.mass * p.length**2 / 12.0, 0.5 * p.length, p.speed / p.length
    places = [k * p.length for k in range(p.n + 1)]
    posts = [world.body(p.mass, inertia, x + 1j * half, 0.0, (0.5 * p.speed, 0.0, -rate)) for x in places]
    bars = [world.body(p.mass, inertia, x + half + 1j * p.length, 0.0, (p.speed, 0.0, 0.0)) for x in places[:-1]]
    for x, post in zip(places, posts, strict=True):
        world.joint(world.ground, x, post, -1j * half)
    for k, bar in enumerate(bars):
        world.joint(posts[k], 1j * half, bar, -half)
        world.joint(bar, half, posts[k + 1], 1j * half)
    return world.solve(scene, h, lambda tables: -tables[0][:, 2:3], sparse=p.n >= 10, newton=(1e-8, 1e-9), **words)


def _andrews(scene: Scene, h: float, **words: Any) -> Outcome:
    p, world = ANDREWS, World()
    start = np.array(p.start)
    absolute = start + np.array([0.0, start[0], 0.0, start[4], 0.0, start[6], 0.0])
    turn = np.exp(1j * absolute)
    centers = (p.ra, -p.da, p.sb - 1j * p.sa, -1j * (p.e - p.ea), p.ta + 1j * p.tb, p.zf - p.fa, p.ub - 1j * p.ua)
    origins = (0j, p.rr * turn[0], p.B, p.A + p.zt * turn[4], p.A, p.A - 1j * p.u * turn[6], p.A)
    bodies = [
        world.body(p.masses[k], p.inertias[k], origins[k] + turn[k] * centers[k], absolute[k], (0.0, 0.0, 0.0), g=0.0)
        for k in range(7)
    ]

    def tie(first: int, at: complex, second: int, there: complex) -> None:
        one = (world.ground, at) if first < 0 else (bodies[first], at - centers[first])
        world.joint(*one, bodies[second], there - centers[second])

    for first, at, second in (
        (-1, 0.0, 0),
        (0, p.rr, 1),
        (-1, p.B, 2),
        (-1, p.A, 4),
        (-1, p.A, 6),
        (4, p.zt, 3),
        (6, -1j * p.u, 5),
    ):
        tie(first, at, second, 0.0)
    for second, there in ((2, -1j * p.ss), (3, -1j * p.e), (5, p.zf)):
        tie(1, -p.d, second, there)
    ends = [world.marker(bodies[2], p.sd - 1j * p.sc - centers[2]), world.marker(world.ground, p.C)]
    world.system.AddObject(SpringDamper(markerNumbers=ends, stiffness=p.stiffness, referenceLength=p.rest))
    world.system.AddLoad(Torque(markerNumber=world.marker(bodies[0], 0.0), loadVector=[0.0, 0.0, p.torque]))

    def read(tables: list[Any]) -> Any:
        b, a2, c, a4, d, a6, e = np.array([t[:, 2] for t in tables]) + absolute[:, None]
        return np.column_stack([b, a2 - b, c, a4 - d, d, a6 - e, e])

    return world.solve(scene, h, read, newton=(1e-9, 1e-11), **words)


def _elastic(scene: Scene, h: float, **words: Any) -> Outcome:
    p, world = ELASTIC, World()
    world.tree(
        [0.0, p.mass], [0.0, p.inertia], [0.0, 0.0], [0.0, -p.length], [p.angle, 0.0], [REVOLUTE, SLIDE_Y],
        stiffness=[0.0, p.stiffness], damping=[0.0, p.damping],
    )  # fmt: skip
    return world.solve(scene, h, lambda tables: tables[0] * [1.0, -1.0], **words)


def _stop(scene: Scene, h: float, **words: Any) -> Outcome:
    p, world = STOP, World()
    node = world.tree([p.mass], [p.mass * p.length**2 / 12.0], [-0.5 * p.length], [0.0], [p.angle])
    world.limit(node, 0, p.at, 10.0, p.stiffness * p.length**2, p.damping * p.length**2)
    return world.solve(scene, h, lambda tables: tables[0], **words)


def _leg(scene: Scene, h: float, stiffness: float, share: float) -> Outcome:
    """The plastic stop as a stiff spring with `share` times the critical damping of 0.1 kg m²."""
    p, world = LEG, World()
    inertias = [p.thigh_mass * p.thigh**2 / 12.0, p.shank_mass * p.shank**2 / 12.0]
    start = [p.angles[0], p.angles[1] - p.angles[0]]
    node = world.tree([p.thigh_mass, p.shank_mass], inertias, [-0.5 * p.thigh, -0.5 * p.shank], [0.0, -p.thigh], start)
    world.limit(node, 1, -10.0, 0.0, stiffness, share * 2.0 * np.sqrt(0.1 * stiffness))
    return world.solve(scene, h, lambda tables: np.cumsum(tables[0], axis=1), adaptive=False)


def _ball(scene: Scene, h: float, stiffness: float) -> Outcome:
    """A penalty contact with the damping of the wanted restitution."""
    p, world = BALL, World()
    node = world.system.AddNode(Node1D(referenceCoordinates=[0.0], initialCoordinates=[p.height]))
    world.system.AddObject(Mass1D(mass=p.mass, nodeNumber=node))
    ends = [world.fixed(), world.coordinate(node, 0)]
    world.system.AddLoad(LoadCoordinate(markerNumber=ends[1], load=-p.mass * G))
    ratio = -np.log(p.restitution) / np.hypot(np.pi, np.log(p.restitution))
    state = world.system.AddNode(NodeGenericData(initialCoordinates=[1.0], numberOfDataCoordinates=1))
    world.system.AddObject(
        ObjectContactCoordinate(
            markerNumbers=ends, nodeNumber=state, contactStiffness=stiffness,
            contactDamping=2.0 * ratio * np.sqrt(stiffness * p.mass),
        )
    )  # fmt: skip
    world.watch(node)
    return world.solve(scene, h, lambda tables: tables[0])


def _swept(name: str, make: Any, scene: Scene, steps: Sequence[float], **words: Any) -> Sweep:
    return [Attempt(f"{name} h={h:.3g}", partial(make, scene, h, **words)) for h in steps]


def attempts(scene: Scene) -> list[Sweep]:
    if scene.family == "S7":
        return space_exudyn.attempts(scene)
    trapezoid, rk4, rk67 = ({"solver": solver} for solver in (SOLVERS.TrapezoidalIndex2, SOLVERS.RK44, SOLVERS.RK67))
    bodies, tree, alpha = "2D bodies, trapezoidal index 2", "tree, RK44", "generalized-alpha rho=0.9"
    if scene.family in ("S1", "S1d"):
        return [
            _swept(f"2D bodies, {alpha}", _chain_of_bodies, scene, (0.01, 0.001, 2e-4), rho=0.9),
            _swept(bodies, _chain_of_bodies, scene, (0.01, 0.002, 0.001, 2e-4), **trapezoid),
            _swept("tree, generalized-alpha rho=1", _chain_as_tree, scene, (0.01, 0.002, 0.001, 2e-4), rho=1.0),
            _swept(tree, _chain_as_tree, scene, (0.02, 0.01, 0.005, 0.002, 0.001, 2e-4), **rk4),
            _swept("tree, RK67", _chain_as_tree, scene, (0.05, 0.02, 0.01, 0.005, 0.002), **rk67),
        ]
    if scene.family == "S2":
        base = 0.02 / max(4, CHAINS[scene.name].n // 4)
        stiff = {**trapezoid, "newton": (1e-8, 1e-9), "sparse": CHAINS[scene.name].n >= 8}
        return [
            _swept(bodies, _chain_of_bodies, scene, (base, base / 2, base / 8, base / 32), **stiff),
            _swept(tree, _chain_as_tree, scene, (base, base / 2, base / 4, base / 16), **rk4),
        ]
    if scene.family == "S3a":
        many = FOUR_BARS[scene.name].n > 10  # the trapezoidal rule does not come to an end with forty of them
        return [
            _swept(f"2D bodies, {alpha}", _four_bars, scene, (0.01, 0.002, 0.001, 2e-4), rho=0.9),
            _swept(bodies, _four_bars, scene, () if many else (0.005, 0.001), **trapezoid),
        ]
    if scene.name == "S3b":
        steps = (1e-4, 1e-4 / 3, 1e-5, 2e-6)
        fine: list[tuple[str, dict[str, Any]]] = [(f"2D bodies, {alpha}", {"rho": 0.9}), (bodies, trapezoid)]
        return [_swept(name, _andrews, scene, steps, **words) for name, words in fine]
    if scene.name == "S4a":
        return [
            [Attempt(f"contact k={k:g} h={h:g}", partial(_ball, scene, h, k)) for k, h in ((1e5, 1e-4), (1e6, 1e-5))]
        ]
    if scene.name == "S4c":
        pairs = ((1e5, 1e-3), (1e5, 1e-4), (1e7, 1e-4), (1e7, 1e-5))
        return [[Attempt(f"limit stop k={k:g} h={h:g}, damping {d} ×", partial(_leg, scene, h, k, d)) for k, h in pairs]
                for d in (1, 5)]  # fmt: skip
    if scene.name == "S5":
        steps = (0.01, 0.005, 0.002, 0.001, 2e-4, 5e-5)
        return [
            _swept(f"tree, {alpha}", _elastic, scene, steps, rho=0.9),
            _swept("tree, trapezoidal", _elastic, scene, (0.01, 0.001, 2e-4), **trapezoid),
            _swept(tree, _elastic, scene, (5e-4, 2e-4, 1e-4), **rk4),
        ]
    if scene.name == "S5b":
        return [
            _swept(f"tree with stop, {alpha}", _stop, scene, (1e-3, 1e-4, 1e-5), rho=0.9),
            _swept(f"{tree} with stop", _stop, scene, (1e-4, 1e-5), **rk4),
        ]
    return []


def first_step(scene: Scene) -> None:
    """A tree, and one step."""
    _chain_as_tree(scene, scene.every)
