"""DART: skeletons in joint coordinates, `World.step` (semi-implicit Euler, constraints as an LCP)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import dartpy as dart
import numpy as np

from benchmarks.peers.race import Attempt, Outcome, Sweep, seconds
from benchmarks.peers.scenes import BALL, CHAINS, ELASTIC, FOUR_BARS, LEG, WHEEL, G, Scene
from benchmarks.peers.systems import space_dart

D = dart.dynamics
DOWN_TURN = (0.0, -1.0, 0.0)


def version() -> str:
    return str(dart.__version__)


def _shift(x: float, z: float) -> Any:
    place = dart.math.Isometry3()
    place.set_translation([x, 0.0, z])
    return place


def _body(
    skeleton: Any, parent: Any, mass: float, inertia: float, center: complex, at: complex,
    axis: tuple[float, ...] = DOWN_TURN, slides: bool = False,
) -> tuple[Any, Any]:  # fmt: skip
    """(joint, body) on a hinge about the axis or a slide along it."""
    properties = (D.PrismaticJointProperties if slides else D.RevoluteJointProperties)()
    properties.mName = f"j{skeleton.getNumJoints()}"
    properties.mAxis = np.array(axis)
    properties.mT_ParentBodyToJoint = _shift(np.real(at), np.imag(at))
    make = skeleton.createPrismaticJointAndBodyNodePair if slides else skeleton.createRevoluteJointAndBodyNodePair
    joint, body = make(parent, properties)
    body.setInertia(D.Inertia(mass, np.array([np.real(center), 0.0, np.imag(center)]), np.eye(3) * inertia))
    return joint, body


def _world(h: float, *skeletons: Any, gravity: tuple[float, float, float] = (0.0, 0.0, -G)) -> Any:
    world = dart.simulation.World()
    world.setGravity(list(gravity))
    world.setTimeStep(h)
    for skeleton in skeletons:
        world.addSkeleton(skeleton)
    return world


def _run(scene: Scene, world: Any, skeleton: Any, read: Callable[[Any], Any]) -> Outcome:
    block, rows = round(scene.every / world.getTimeStep()), [skeleton.getPositions().copy()]

    def run() -> None:
        for _ in scene.times[1:]:
            for _ in range(block):
                world.step()
            rows.append(skeleton.getPositions().copy())

    spent = seconds(run)
    return Outcome(read(np.array(rows)), spent, block * (len(scene.times) - 1))


def _summed(rows: Any) -> Any:
    return np.cumsum(rows, axis=1)


def _chain(scene: Scene, h: float) -> Outcome:
    p, skeleton, body = CHAINS[scene.name], D.Skeleton("chain"), None
    for k in range(p.n):
        at = -1j * p.length if k else 0.0
        joint, body = _body(skeleton, body, p.mass, p.mass * p.length**2 / 12.0, -0.5j * p.length, at)
        joint.setDampingCoefficient(0, p.damping)
    skeleton.disableSelfCollisionCheck()
    skeleton.setPositions(np.diff(p.angles, prepend=0.0))
    return _run(scene, _world(h, skeleton), skeleton, _summed)


def _four_bars(scene: Scene, h: float) -> Outcome:
    p, skeleton = FOUR_BARS[scene.name], D.Skeleton("four-bars")
    inertia, length, up = p.mass * p.length**2 / 12.0, p.length, (0.0, 1.0, 0.0)
    posts, couplers, rates = [], [], []
    for k in range(p.n + 1):
        posts.append(_body(skeleton, None, p.mass, inertia, 0.5j * length, k * length, up)[1])
        rates.append(p.speed / length)
        if k < p.n:
            couplers.append(_body(skeleton, posts[k], p.mass, inertia, 0.5 * length, 1j * length, up)[1])
            rates.append(-p.speed / length)
    skeleton.disableSelfCollisionCheck()
    world = _world(h, skeleton)
    for k in range(p.n):
        joint = dart.constraint.BallJointConstraint(
            couplers[k], posts[k + 1], np.array([(k + 1) * length, 0.0, length])
        )
        world.getConstraintSolver().addConstraint(joint)
    skeleton.setVelocities(np.array(rates))
    return _run(scene, world, skeleton, lambda rows: rows[:, :1])


def _elastic(scene: Scene, h: float) -> Outcome:
    """A massless arm is not possible: it weighs 1e-9 kg."""
    p, skeleton = ELASTIC, D.Skeleton("elastic")
    _, arm = _body(skeleton, None, 1e-9, 1e-12, 0.0, 0.0)
    joint, _ = _body(skeleton, arm, p.mass, p.inertia, -1j * p.length, 0.0, (0.0, 0.0, -1.0), slides=True)
    joint.setSpringStiffness(0, p.stiffness)
    joint.setDampingCoefficient(0, p.damping)
    skeleton.setPositions(np.array([p.angle, 0.0]))
    return _run(scene, _world(h, skeleton), skeleton, lambda rows: rows)


def _shaped(body: Any, shape: Any, x: float, z: float, restitution: float, friction: float) -> None:
    node = body.createShapeNode(shape)
    node.setRelativeTransform(_shift(x, z))
    node.createCollisionAspect()
    node.createDynamicsAspect()
    node.getDynamicsAspect().setRestitutionCoeff(restitution)
    node.getDynamicsAspect().setFrictionCoeff(friction)


def _ground(restitution: float, friction: float) -> Any:
    skeleton = D.Skeleton("ground")
    _, body = skeleton.createWeldJointAndBodyNodePair()
    _shaped(body, D.BoxShape([200.0, 10.0, 1.0]), 0.0, -0.5, restitution, friction)
    return skeleton


def _ball(scene: Scene, h: float) -> Outcome:
    p, skeleton = BALL, D.Skeleton("ball")
    _, body = _body(skeleton, None, p.mass, 0.01, 0.0, 0.0, (0.0, 0.0, 1.0), slides=True)
    _shaped(body, D.SphereShape(p.radius), 0.0, 0.0, p.restitution, 0.0)
    skeleton.setPositions(np.array([p.height + p.radius]))
    return _run(scene, _world(h, skeleton, _ground(1.0, 0.0)), skeleton, lambda rows: rows - p.radius)


def _leg(scene: Scene, h: float) -> Outcome:
    p, skeleton = LEG, D.Skeleton("leg")
    _, thigh = _body(skeleton, None, p.thigh_mass, p.thigh_mass * p.thigh**2 / 12.0, -0.5j * p.thigh, 0.0)
    knee, _ = _body(skeleton, thigh, p.shank_mass, p.shank_mass * p.shank**2 / 12.0, -0.5j * p.shank, -1j * p.thigh)
    knee.setPositionLowerLimit(0, -10.0)
    knee.setPositionUpperLimit(0, 0.0)
    knee.setLimitEnforcement(True)
    skeleton.disableSelfCollisionCheck()
    skeleton.setPositions(np.array([p.angles[0], p.angles[1] - p.angles[0]]))
    return _run(scene, _world(h, skeleton), skeleton, _summed)


def _wheel(scene: Scene, h: float) -> Outcome:
    """Small spheres as feet, friction 5; the times at which the wheel has turned by another spoke."""
    p, radius, half = WHEEL[scene.name], 1e-4, np.pi / WHEEL[scene.name].spokes
    skeleton = D.Skeleton("wheel")
    joint, body = skeleton.createPlanarJointAndBodyNodePair()
    joint.setZXPlane()
    body.setInertia(D.Inertia(p.mass, np.zeros(3), np.eye(3) * p.inertia))
    for turn in 2.0 * half * np.arange(p.spokes):
        _shaped(body, D.SphereShape(radius), p.length * np.sin(turn), -p.length * np.cos(turn), 0.0, 5.0)
    gravity = (G * np.sin(p.slope), 0.0, -G * np.cos(p.slope))
    world = _world(h, skeleton, _ground(0.0, 5.0), gravity=gravity)
    skeleton.setPositions(np.array([p.length * np.cos(half) + radius, 0.0, -half]))
    skeleton.setVelocities(np.array([p.speed * p.length * np.sin(half), p.speed * p.length * np.cos(half), p.speed]))
    times: list[float] = []
    steps, due, angle = 0, half, -half

    def run() -> None:
        nonlocal steps, due, angle
        while len(times) < p.steps and world.getTime() < scene.until:
            world.step()
            steps, before, angle = steps + 1, angle, skeleton.getPosition(2)
            if before < due <= angle:
                times.append(world.getTime() - h * (angle - due) / (angle - before))
                due += 2.0 * half

    spent = seconds(run)
    return Outcome(np.array(times)[:, None], spent, steps)


MAKERS = {
    "S1": (_chain, (0.01, 0.001, 1e-4, 1e-5)), "S1d": (_chain, (0.01, 0.001, 1e-4, 1e-5)),
    "S3a": (_four_bars, (0.005, 0.001, 2e-4)), "S4a": (_ball, (1e-2, 1e-3, 1e-4, 2e-5)),
    "S4b": (_wheel, (2e-3, 5e-4, 1e-4)), "S4c": (_leg, (1e-3, 1e-4, 1e-5)), "S5": (_elastic, (0.01, 0.001, 1e-4, 1e-5)),
}  # fmt: skip


def attempts(scene: Scene) -> list[Sweep]:
    if scene.family == "S7":
        return space_dart.attempts(scene)
    if scene.family == "S2":
        base = 0.02 / max(4, CHAINS[scene.name].n // 4)
        make, steps = _chain, (base, base / 8, base / 64)
    elif scene.family in MAKERS and scene.name != "S4b_point":
        make, steps = MAKERS[scene.family]
    else:
        return []
    return [[Attempt(f"World.step h={h:.3g}", partial(make, scene, h)) for h in steps]]


def first_step(scene: Scene) -> None:
    """A skeleton, and one step."""
    _chain(scene, scene.every)
