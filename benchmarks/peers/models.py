"""The scenes in the words of `mbd`, and how their runs are read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import mbd
from benchmarks.peers.scenes import (
    ANDREWS,
    BALL,
    CHAINS,
    COMPASS,
    ELASTIC,
    FOUR_BARS,
    LEG,
    STOP,
    WHEEL,
    Chain,
    FourBars,
    G,
    Scene,
    Wheel,
)  # fmt: skip
from benchmarks.peers.space import COIN, TREES, Part, Tree, centers, rotation, tree
from mbd.arrays import Matrix, Vector

Read = Callable[[mbd.Trajectory, Vector], Matrix]
X_OF_POSE = tuple[float, float, float]


@dataclass(frozen=True)
class Posed:
    """A model, its start, and what is compared: ``read(run, times)`` → (times, compared)."""

    model: mbd.Model
    start: mbd.State
    read: Read


def at(run: mbd.Trajectory, times: Vector, *names: str) -> Matrix:
    """Named quantities (times, names): stored rows where they lie on the times, else as `run.at` has them."""
    rows = np.minimum(np.searchsorted(run.time, times - 1e-9), len(run.time) - 1)
    if not run.events and np.allclose(run.time[rows], times, rtol=0.0, atol=1e-9):
        return np.stack([run[name][rows] for name in names], axis=1)
    found = run.at(times).read(*names)
    return np.stack([found[name] for name in names], axis=1)


def uniform(name: str, mass: float, length: float) -> mbd.Link:
    """A uniform rod."""
    return mbd.Link(name, mass, length, length / 2.0, mass * length**2 / 12.0)


def chain(p: Chain) -> Posed:
    """Rods hanging from each other; relative angles are summed up for the comparison."""
    model = mbd.Model("chain")
    above, names = model.ground.origin, []
    for k in range(p.n):
        rod = uniform(f"rod {k}", p.mass, p.length)
        loss = mbd.Viscous(p.damping) if p.damping else None
        model.connect(mbd.Revolute(f"joint {k}", above, rod.start, loss=loss))
        above, names = rod.end, [*names, f"joint {k}.angle"]
    start = mbd.assemble(model, position=dict(zip(names, np.diff(p.angles, prepend=0.0), strict=True)))
    return Posed(model, start, lambda run, times: np.cumsum(at(run, times, *names), axis=1))


def four_bars(p: FourBars) -> Posed:
    """Posts and couplers; the joints at the right ends of the couplers close the loops."""
    model, inertia = mbd.Model("four-bars"), p.mass * p.length**2 / 12.0
    posts = [mbd.RigidBody(f"post {k}", p.mass, inertia, center=(0.0, p.length / 2.0, 0.0)) for k in range(p.n + 1)]
    for k, post in enumerate(posts):
        model.connect(mbd.Revolute(f"foot {k}", model.ground.point(k * p.length, 0.0, 0.0), post.origin))
    for k in range(p.n):
        coupler = mbd.RigidBody(f"coupler {k}", p.mass, inertia, center=(p.length / 2.0, 0.0, 0.0))
        model.connect(mbd.Revolute(f"left {k}", posts[k].point(0.0, p.length, 0.0), coupler.origin))
        right = coupler.point(p.length, 0.0, 0.0), posts[k + 1].point(0.0, p.length, 0.0)
        model.connect(mbd.Revolute(f"right {k}", *right))
    position = {f"foot {k}.angle": 0.0 for k in range(p.n + 1)}
    start = mbd.assemble(model, position=position, velocity={"foot 0.angle": -p.speed / p.length})
    return Posed(model, start, lambda run, times: -at(run, times, "foot 0.angle"))


def andrews() -> Posed:
    """Seven bodies as in the test set's figure; the three joints at the end of body 2 close the loops."""
    p = ANDREWS
    model = mbd.Model("Andrews", gravity=(0.0, 0.0, 0.0))
    centers = (p.ra, -p.da, p.sb - 1j * p.sa, -1j * (p.e - p.ea), p.ta + 1j * p.tb, p.zf - p.fa, p.ub - 1j * p.ua)
    k1, k2, k3, k4, k5, k6, k7 = (
        mbd.RigidBody(f"K{k}", mass, inertia, center=_place(center))
        for k, (mass, inertia, center) in enumerate(zip(p.masses, p.inertias, centers, strict=True), 1)
    )
    ground = {name: model.ground.point(*_place(place)) for name, place in (("A", p.A), ("B", p.B), ("C", p.C))}
    crank = mbd.Revolute("beta", model.ground.origin, k1.origin)
    model.connect(
        crank,
        mbd.Revolute("theta", k1.point(p.rr, 0.0, 0.0), k2.origin),
        mbd.Revolute("gamma", ground["B"], k3.origin),
        mbd.Revolute("delta", ground["A"], k5.origin),
        mbd.Revolute("phi", k5.point(p.zt, 0.0, 0.0), k4.origin),
        mbd.Revolute("epsilon", ground["A"], k7.origin),
        mbd.Revolute("omega", k7.point(0.0, -p.u, 0.0), k6.origin),
    )
    ends = {"3": k3.point(0.0, -p.ss, 0.0), "4": k4.point(0.0, -p.e, 0.0), "6": k6.point(p.zf, 0.0, 0.0)}
    for name, end in ends.items():
        model.connect(mbd.Revolute(f"loop {name}", k2.point(-p.d, 0.0, 0.0), end))
    model.apply(
        mbd.Spring("spring", k3.point(p.sd, -p.sc, 0.0), ground["C"], p.stiffness, p.rest),
        mbd.Motor("drive", crank, p.torque),
    )
    names = [f"{name}.angle" for name in ("beta", "theta", "gamma", "phi", "delta", "omega", "epsilon")]
    start = mbd.assemble(model, position=dict(zip(names, p.start, strict=True)), project=True)
    return Posed(model, start, lambda run, times: at(run, times, *names))


def _place(z: complex) -> X_OF_POSE:
    return (float(np.real(z)), float(np.imag(z)), 0.0)


def ball() -> Posed:
    """A point that falls; `radius` would only shift it."""
    model = mbd.Model("ball")
    body = mbd.PointMass("ball", BALL.mass)
    model.connect(mbd.Prismatic("fall", model.ground.origin, body.origin, axis=(0.0, 1.0, 0.0)))
    gap = mbd.measure(lambda height: height, "fall.displacement")
    model.constrain(mbd.Unilateral("floor", gap, restitution=BALL.restitution))
    start = mbd.assemble(model, position={"fall.displacement": BALL.height})
    return Posed(model, start, lambda run, times: at(run, times, "fall.displacement"))


def wheel(p: Wheel) -> Posed:
    """A hub that is carried by one spoke after the other; seen from the slope's normal."""
    model, half = mbd.Model("rimless wheel", gravity=mbd.on_slope(p.slope)), np.pi / p.spokes
    hub = mbd.RigidBody("hub", p.mass, p.inertia)
    model.connect(mbd.Planar("axle", model.ground.origin, hub.origin))
    angles = [-(2 * k + 1) * half for k in range(p.spokes)]  # of the hub from the normal, seen from the foot of spoke k
    for k, angle in enumerate(angles):
        foot = hub.point(-p.length * np.sin(angle), -p.length * np.cos(angle), 0.0)
        others = tuple(mbd.When(f"foot {other}") for other in range(p.spokes) if other != k)
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(foot), release=others))
    position = {"axle.x": 0.0, "axle.y": p.length * np.cos(half), "axle.angle": 0.0}
    start = mbd.assemble(model, closed=["foot 0"], position=position, velocity={"axle.angle": -p.speed})
    return Posed(model, start, lambda run, times: _strikes(run, p.steps))


def _strikes(run: mbd.Trajectory, count: int) -> Matrix:
    """Times of the closings (count, 1)."""
    return np.array([event.time for event in run.events if event.kind == "closed"])[:count, None]


def stance(p: Wheel) -> Posed:
    """The same wheel, of which angle and rate of the stance spoke are read."""
    posed, half = wheel(p), np.pi / p.spokes

    def read(run: mbd.Trajectory, times: Vector) -> Matrix:
        turned, rate = at(run, times, "axle.angle", "axle.angle.rate").T
        steps = np.searchsorted(_strikes(run, len(run.events))[:, 0], times, side="right")
        return np.stack([-turned - (2 * steps + 1) * half + p.slope, -rate], axis=1)

    return Posed(posed.model, posed.start, read)


def leg() -> Posed:
    """Thigh and shank on a fixed hip; the knee's stop is a contact on its angle."""
    p, model = LEG, mbd.Model("leg")
    thigh, shank = uniform("thigh", p.thigh_mass, p.thigh), uniform("shank", p.shank_mass, p.shank)
    knee = mbd.Revolute("knee", thigh.end, shank.start)
    model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start), knee)
    model.constrain(mbd.Unilateral("stop", mbd.measure(lambda angle: -angle, "knee.angle", unit="rad")))
    position = {"hip.angle": p.angles[0], "knee.angle": p.angles[1] - p.angles[0]}
    start = mbd.assemble(model, position=position)
    return Posed(model, start, lambda run, times: np.cumsum(at(run, times, "hip.angle", "knee.angle"), axis=1))


def compass() -> Posed:
    """Two legs on a hip; each foot lets go as the other one strikes. Legs scuff at mid-stance, which is ignored."""
    p = COMPASS
    model = mbd.Model("compass gait", gravity=mbd.on_slope(p.slope))
    hip = mbd.PointMass("hip", p.hip)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    legs = {side: mbd.Link(f"{side} leg", p.leg, p.length, p.center) for side in ("left", "right")}
    for side, other in ("left", "right"), ("right", "left"):
        foot, other_foot = legs[side].end, legs[other].end
        ahead = mbd.measure(lambda this, that: this[0] - that[0] - 0.01, foot, other_foot)
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, legs[side].start))
        model.constrain(
            mbd.Unilateral(f"{side} foot", mbd.touchdown(foot), release=mbd.When(f"{other} foot"), only_while=ahead)
        )
    stance_angle, swing_angle, stance_rate, swing_rate = p.start
    start = mbd.assemble(
        model,
        closed="left foot",
        open="right foot",
        position={"left hip.angle": p.slope - stance_angle, "right hip.angle": p.slope - swing_angle},
        velocity={"left hip.angle": -stance_rate, "right hip.angle": -swing_rate},
    )

    def read(run: mbd.Trajectory, times: Vector) -> Matrix:
        strikes = _strikes(run, len(run.events))[:, 0]
        odd = (np.searchsorted(strikes, times, side="right") % 2 == 1)[:, None]
        angles = p.slope - at(run, times, "left hip.angle", "right hip.angle")
        rates = -at(run, times, "left hip.angle.rate", "right hip.angle.rate")
        return np.hstack([np.where(odd, pair[:, ::-1], pair) for pair in (angles, rates)])

    return Posed(model, start, read)


def elastic() -> Posed:
    """Hinge, massless arm, slide with spring and damper, bob."""
    p, model = ELASTIC, mbd.Model("elastic pendulum")
    arm, bob = mbd.RigidBody("arm", 0.0, 0.0), mbd.RigidBody("bob", p.mass, p.inertia)
    slide = mbd.Prismatic(
        "slide", arm.point(0.0, -p.length, 0.0), bob.origin, axis=(0.0, -1.0, 0.0), stiffness=p.stiffness,
        loss=mbd.Viscous(p.damping),
    )  # fmt: skip
    model.connect(mbd.Revolute("hinge", model.ground.origin, arm.origin), slide)
    start = mbd.assemble(model, position={"hinge.angle": p.angle})
    return Posed(model, start, lambda run, times: at(run, times, "hinge.angle", "slide.displacement"))


def stop() -> Posed:
    """A rod and a penalty contact at its tip, along its arc; the damper may pull just before release."""
    p, model = STOP, mbd.Model("stop")
    rod = uniform("rod", p.mass, p.length)
    model.connect(mbd.Revolute("hinge", model.ground.origin, rod.start))
    arc = mbd.measure(lambda angle: p.length * (angle - p.at), "hinge.angle", unit="m")
    model.constrain(mbd.Penalty("stop", arc, p.stiffness, p.damping, release="gap"))
    start = mbd.assemble(model, position={"hinge.angle": p.angle})
    return Posed(model, start, lambda run, times: at(run, times, "hinge.angle"))


def in_space(tree: Tree) -> Posed:
    """A tree on ball joints, hinges and floating bodies."""
    model, bodies, shown = mbd.Model("tree", gravity=tree.gravity), list[mbd.RigidBody](), list[str]()
    position, velocity = dict[str, Any](), dict[str, Any]()
    for part in tree.parts:
        body = mbd.RigidBody(part.name, part.mass, part.inertia, center=part.center)
        frames = (bodies[part.parent] if part.parent >= 0 else model.ground).point(*part.at), body.origin
        bodies.append(body)
        name, values = f"{part.name} joint", list(part.q)
        if part.joint == "hinges":
            own = _hinged(model, part, name, *frames)
            speeds: list[tuple[str, Any]] = list(zip(own, part.v, strict=True))
        else:
            model.connect((mbd.Free if part.joint == "free" else mbd.Spherical)(name, *frames))
            places = [f"{name}.{axis}" for axis in "xyz"] if part.joint == "free" else []
            own, values = [*places, f"{name}.orientation"], [*values[:-4], tuple(values[-4:])]  # type: ignore[list-item]
            speeds = [*zip(places, part.v, strict=False), (f"{name}.angular_velocity", part.v[-3:])]
        position |= dict(zip(own, values, strict=True))
        velocity |= dict(speeds)
        shown += [name for each in own for name in _components(each)]
    start = mbd.assemble(model, position, velocity)
    return Posed(model, start, lambda run, times: centers(tree, at(run, times, *shown)))


def _hinged(model: mbd.Model, part: Part, name: str, before: Any, body: Any) -> list[str]:
    """Coordinates of slides and hinges in a row, between them bodies without mass; two hinges are a `Universal`."""
    if len(part.axes) == 2:
        model.connect(mbd.Universal(name, before, body))
        return [f"{name}.first", f"{name}.second"]
    found = []
    if part.floats:
        carrier = mbd.RigidBody(f"{name} carrier", 0.0, 0.0)
        model.connect(mbd.Translation(f"{name} slides", before, carrier.origin, axes="xyz"))
        before, found = carrier.origin, [f"{name} slides.{axis}" for axis in "xyz"]
    for k, axis in enumerate(part.axes):
        after = body if k == len(part.axes) - 1 else mbd.RigidBody(f"{name} link {k}", 0.0, 0.0).origin
        model.connect(mbd.Revolute(f"{name} {k}", before, after, axis=axis))
        before = after
        found.append(f"{name} {k}.angle")
    return found


def _components(name: str) -> list[str]:
    return [f"{name}.{part}" for part in "wxyz"] if name.endswith("orientation") else [name]


def coin() -> Posed:
    """A disk whose edge stays on the plane y = 0, where it rolls; ours is the scene's turned by −π/2 about x."""
    p, turned = COIN, np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    model, about = mbd.Model("coin", gravity=(0.0, -G, 0.0)), (0.0, 0.0, -1.0)
    across = p.mass * p.radius**2 / 4.0
    disk = mbd.RigidBody("disk", p.mass, (across, across, 2.0 * across))
    model.connect(mbd.Free("float", model.ground.origin, disk.origin))
    model.constrain(mbd.Bilateral("edge", mbd.disk_touchdown(disk.origin, p.radius, axis=about)))
    model.constrain(mbd.Rolling("grip", disk.origin, p.radius, axis=about))
    x, y, z = (float(part) for part in turned @ p.place)
    place = {"float.orientation": ((1.0, 0.0, 0.0), p.lean), "float.x": x, "float.y": y, "float.z": z}
    omega = rotation(np.array([np.cos(p.lean / 2.0), np.sin(p.lean / 2.0), 0.0, 0.0])).T @ turned @ p.omega
    start = mbd.assemble(model, place, {"float.angular_velocity": tuple(omega)})

    def read(run: mbd.Trajectory, times: Vector) -> Matrix:
        values = at(run, times, "float.x", "float.y", "float.z", *_components("float.orientation"))
        return np.hstack([values[:, :3] @ turned, -rotation(values[:, 3:])[..., 2] @ turned])

    return Posed(model, start, read)


def posed(scene: Scene) -> Posed:
    """The model of a scene."""
    name = scene.name
    if name in TREES:
        return in_space(tree(name))
    if name in CHAINS:
        return chain(CHAINS[name])
    if name in FOUR_BARS:
        return four_bars(FOUR_BARS[name])
    if name in WHEEL:
        return wheel(WHEEL[name]) if name == "S4b" else stance(WHEEL[name])
    return {"S3b": andrews, "S4a": ball, "S4c": leg, "S4d": compass, "S5": elastic, "S5b": stop, "S7_coin": coin}[
        name
    ]()
