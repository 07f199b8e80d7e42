"""Random mechanisms on which nothing acts for a while: at rest, at constant speed, moved and held, balanced."""

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import mbd


@dataclass(frozen=True)
class Units:
    """How many of some units a meter, a kilogram, a second are."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    @property
    def inertia(self) -> float:
        return self.mass * self.length**2

    @property
    def gravity(self) -> float:
        return self.length / self.time**2


@dataclass(frozen=True)
class Scene:
    """A model with what `mbd.assemble` is to be given; `drives`: motions in SI by the coordinate moved."""

    model: Any
    start: dict[str, Any]
    drives: dict[str, Callable[[float], float]] = field(default_factory=dict)
    heavy: bool = False


def rise(x: Any) -> Any:
    """0 before 0, 1 after 1, with continuous accelerations."""
    x = mbd.clip(x, 0.0, 1.0)
    return x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)


def law(rng: random.Random, shape: str, start: float) -> Callable[[Any], Any]:
    """A motion from a start: moved and held, from the beginning or after a rest, at rest, at constant speed, others."""
    begin, by = rng.choice([0.0, 0.0, 0.1]), rng.uniform(0.3, 1.0) * rng.choice([-1.0, 1.0])
    end = rng.uniform(0.3, 0.4)
    return {
        "moved and held": lambda t: start + by * rise((t - begin) / (end - begin)),
        "at constant speed": lambda t: start + 3.0 * by * t,
        "at rest": lambda t: start + 0.0 * t,
        "from rest": lambda t: start + 5.0 * by * t**3,
        "to and fro": lambda t: start + by * (1.0 - mbd.cos(6.0 * t)),
    }[shape]


SHAPES = ("moved and held", "at constant speed", "at rest", "from rest", "to and fro")
DRIVEN = ("slide", "slider-crank", "four-bar", "chain", "pendulum", "arm in space", "gantry in space")
BALANCED = ("cardan", "double cardan", "gyroscope", "belt", "pair", "ball and universal")


def driven(kind: str, seed: int, units: Units, cut: str = "auto", shape: str = "") -> Scene:
    """A mechanism with one drive or all of them; half of them without gravity, half aligned with axes, at zeros."""
    rng = random.Random(f"{kind} {seed}")
    heavy, aligned, shape = rng.random() < 0.5, rng.random() < 0.5, shape or rng.choice(SHAPES)
    model = mbd.Model(f"{kind} {seed}", gravity=(0.0, -9.81 * units.gravity * heavy, 0.0), cut=cut)
    first, second = (0.0, 0.0) if aligned else (rng.uniform(-1.0, 1.0), rng.uniform(-0.5, 0.5))
    R, drives, position = rng.uniform(0.05, 0.3), dict[str, Any](), dict[str, float]()
    L = R * rng.uniform(2.5, 4.0)
    loss = rng.choice([None, mbd.Viscous(0.1 * units.inertia / units.time), mbd.Quadratic(0.1 * units.inertia)])

    def drive(name: str, joint: Any, start: float, size: float = 1.0) -> None:
        motion, coordinate = law(rng, shape, start), f"{joint.name}.{joint.labels[0].name}"
        drives[coordinate], position[coordinate] = motion, size * start
        model.constrain(mbd.Bilateral(name, joint, value=lambda t: size * motion(t / units.time)))

    def link(name: str, length: float) -> Any:
        mass, center = math.exp(rng.uniform(-2.0, 2.0)), 0.5 if aligned else rng.uniform(0.2, 0.8)
        return mbd.Link(name, mass * units.mass, length * units.length, center * length * units.length,
                        rng.uniform(0.05, 0.2) * mass * length**2 * units.inertia)  # fmt: skip

    if kind == "slide":
        body = mbd.PointMass("body", rng.uniform(0.1, 5.0) * units.mass)
        drag = rng.choice([mbd.Viscous(5.0 * units.mass / units.time), mbd.Quadratic(50.0 * units.mass / units.length)])
        model.connect(bore := mbd.Prismatic("bore", model.ground.origin, body.origin, loss=drag))
        drive("drive", bore, first, units.length)
        return Scene(model, {"position": position}, drives, heavy)
    if kind.endswith("in space"):
        a, b = (solid(rng, name, units, (0.0, 0.0, 0.0) if aligned else (R, 0.0, 0.0)) for name in "ab")
        if kind == "arm in space":
            turn = mbd.Revolute("turn", model.ground.origin, a.origin, axis=(0.0, 1.0, 0.0))
            model.connect(turn, lift := mbd.Revolute("lift", a.point(R * units.length, 0.0, 0.0), b.origin))
            drive("drive", turn, first)
            drive("other drive", lift, second)
        else:
            slide = mbd.Prismatic("slide", model.ground.origin, a.origin, axis=(1.0, 0.0, 0.0))
            model.connect(slide, mbd.Spherical("ball", a.origin, b.origin))
            drive("drive", slide, 0.0, units.length)
        return Scene(model, {"position": position}, drives, heavy)
    arm = link("arm", R)
    model.connect(crank := mbd.Revolute("crank", model.ground.origin, arm.start, loss=loss))
    if kind != "pendulum":
        rod = link("rod", L)
        model.connect(pin := mbd.Revolute("pin", arm.end, rod.start))
    drive("drive", crank, first)
    if kind == "chain":
        drive("other drive", pin, second)
    elif kind == "four-bar":
        rocker, base = link("rocker", 0.8 * L), model.ground.point(1.05 * L * units.length, 0.0, name="base")
        model.connect(mbd.Revolute("base", base, rocker.start), mbd.Revolute("top", rod.end, rocker.end))
    elif kind == "slider-crank":
        piston = mbd.PointMass("piston", 0.5 * units.mass)
        model.connect(mbd.Prismatic("bore", model.ground.origin, piston.origin),
                      mbd.Revolute("wrist", rod.end, piston.origin))  # fmt: skip
        reach = R * math.sin(first) + math.sqrt(L**2 - (R * math.cos(first)) ** 2)
        position["bore.displacement"] = reach * units.length
    return Scene(model, {"position": position}, drives, heavy)


def solid(rng: random.Random, name: str, units: Units, center: Any = (0.0, 0.0, 0.0)) -> Any:
    """A body with a random inertia, of revolution for one in two."""
    a, b, c = (rng.uniform(0.01, 0.05) for _ in range(3))
    c = b if rng.random() < 0.5 else c
    inertia = tuple(each * units.inertia for each in (b + c, a + c, a + b))
    return mbd.RigidBody(name, rng.uniform(0.2, 5.0) * units.mass, inertia,
                         center=tuple(each * units.length for each in center))  # fmt: skip


def balanced(kind: str, seed: int, units: Units, cut: str = "auto") -> Scene:
    """A mechanism whose mass centers do not move, at a zero angle for two in three, at rest for some."""
    rng = random.Random(f"{kind} {seed}")
    heavy, zero = rng.random() < 0.4, rng.choice([0.0, 0.0, rng.uniform(-1.0, 1.0)])
    spin = rng.choice([0.0, 5.0, rng.uniform(-9.0, 9.0)]) / units.time
    model = mbd.Model(f"{kind} {seed}", gravity=(0.0, 0.0, -9.81 * units.gravity * heavy), cut=cut)
    ground, bend = model.ground, rng.uniform(0.2, 0.8)
    along, across = (math.cos(bend), math.sin(bend), 0.0), (-math.sin(bend), math.cos(bend), 0.0)
    a, b, c = (solid(rng, name, units) for name in "abc")
    upright, x, y = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    if kind.endswith("cardan"):
        model.connect(mbd.Revolute("in", ground.origin, a.origin, axis=x),
                      mbd.Universal("u", a.origin, b.origin, axis=upright, second_axis=across))  # fmt: skip
        if kind == "cardan":
            model.connect(mbd.Revolute("out", ground.origin, b.origin, axis=along))
        else:
            zero = 0.0  # its rows depend on each other: other angles are found to their tolerance only
            far = [rng.choice([0.0, 0.2]) * units.length * each for each in along]
            model.connect(mbd.Universal("w", b.point(*far), c.origin, axis=across, second_axis=upright),
                          mbd.Revolute("out", ground.point(*far, name="far"), c.origin, axis=x))  # fmt: skip
        return Scene(model, {"position": {"in.angle": zero}, "velocity": {"in.angle": spin}}, heavy=heavy)
    if kind == "gyroscope":
        model.connect(mbd.Spherical("ball", ground.origin, a.origin), mbd.Revolute("axle", a.origin, b.origin, axis=x))
        return Scene(model, {"velocity": {"axle.angle": 5.0 * spin}}, heavy=heavy)
    if kind == "belt":
        model.connect(mbd.Revolute("one", ground.origin, a.origin, axis=x),
                      mbd.Revolute("two", ground.point(0.0, 0.0, 0.5 * units.length), b.origin, axis=x))  # fmt: skip
        radii = [rng.uniform(0.05, 0.3) * units.length for _ in range(2)]
        model.constrain(mbd.Nonholonomic("belt", lambda u, w: radii[0] * u - radii[1] * w,
                                         arguments=("one.angle.rate", "two.angle.rate"), unit="m"))  # fmt: skip
        return Scene(model, {"velocity": {"one.angle": spin}}, heavy=heavy)
    if kind == "pair":
        model.connect(mbd.Free("fly", ground.origin, a.origin),
                      mbd.Revolute("hinge", a.point(0.3 * units.length, 0.0, 0.0), b.origin, axis=x))  # fmt: skip
        return Scene(model, {"velocity": {"fly.x": 0.3 * spin * units.length, "hinge.angle": spin}}, heavy=heavy)
    model.connect(mbd.Spherical("ball", ground.origin, a.origin), mbd.Revolute("hinge", a.origin, b.origin, axis=y),
                  mbd.Universal("u", b.origin, ground.origin, axis=upright, second_axis=x))  # fmt: skip
    return Scene(model, {"velocity": {"hinge.angle": spin}}, heavy=heavy)


def shaft(seed: int, cut: str) -> tuple[Scene, Any]:
    """Balanced wheels over universal joints at one point, the first driven by a table, and the table."""
    rng = random.Random(f"shaft {seed}")
    model = mbd.Model("shaft", gravity=(0.0, -9.81 * (rng.random() < 0.5), 0.0), cut=cut)
    end, velocity, position = model.ground.origin, dict[str, float](), dict[str, float]()
    for k in range(3):
        size = rng.uniform(0.01, 0.03)
        wheel = mbd.RigidBody(f"wheel {k}", rng.uniform(0.5, 2.0), (size, size, 2.0 * size))
        if k:
            joint: Any = mbd.Universal(f"joint {k}", end, wheel.origin, axis=(1, 0, 0), second_axis=(0, 1, 0))
            position[f"joint {k}.first"] = rng.choice([0.0, 0.3])
            for axis in ("first", "second"):
                velocity[f"joint {k}.{axis}"] = rng.choice([3.0, rng.uniform(-3.0, 3.0)])
        else:
            joint = mbd.Revolute("joint 0", end, wheel.origin)
        model.connect(joint)
        end = wheel.origin
    times = [0.0, rng.uniform(0.08, 0.15), rng.uniform(0.2, 0.25)]
    values = [0.0, rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1)]
    table = mbd.Samples(times, values, kind="spline", ends="clamped")
    model.constrain(mbd.Bilateral("drive", model.joints[0], value=table))
    return Scene(model, {"position": position, "velocity": velocity}), table
