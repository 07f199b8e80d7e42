"""Linkages that pass singular configurations, each with its motion on one coordinate."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Any

import numpy as np

import mbd

G = 9.81


@dataclass(frozen=True)
class Passage:
    """A model and its start; the coordinate that is followed, for how long, and how far a run is off its branch.

    `inertia` and `pull` of ``inertia(φ) φ̈ + ½ inertia'(φ) φ̇² = pull(φ)`` give the same motion by one coordinate.
    """

    start: tuple[Any, Any]
    angle: str
    until: float
    off: Callable[[Any], float]
    inertia: Callable[[float], tuple[float, float]]
    pull: Callable[[float], float]
    pace: float = 5e-4

    def end(self) -> float:
        """The coordinate at the end, by Runge and Kutta's method on the one coordinate."""
        start = self.start[1]
        place = list(start.names).index(self.angle)

        def slope(y: Any) -> Any:
            size, change = self.inertia(y[0])
            return np.array([y[1], (self.pull(y[0]) - 0.5 * change * y[1] ** 2) / size])

        y, steps = np.array([start.q[place], start.v[place]]), round(self.until / self.pace)
        dt = self.until / steps
        for _ in range(steps):
            k1 = slope(y)
            k2 = slope(y + 0.5 * dt * k1)
            k3 = slope(y + 0.5 * dt * k2)
            y = y + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + slope(y + dt * k3))
        return float(y[0])


def rod(length: float, mass: float = 1.0) -> dict[str, float]:
    """A uniform rod."""
    return {"mass": mass, "length": length, "center": 0.5 * length, "inertia": mass * length**2 / 12.0}


def apart(run: Any, *angles: str) -> float:
    """Largest difference of angles that are equal on the branch."""
    return max(float(np.max(np.abs(run[angle] - run[angles[0]]))) for angle in angles[1:])


def four_bars(count: int, until: float = 3.0) -> Passage:
    """`count` parallelograms side by side: cranks upright on one base, couplers of the same length (IFToMM A02)."""
    model = mbd.Model("four-bars")
    cranks = [mbd.Link(f"crank {k}", **rod(1.0)) for k in range(count + 1)]
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"base {k}", model.ground.point(float(k), 0.0, name=f"base {k}"), crank.start))
    for k in range(count):
        coupler = mbd.Link(f"coupler {k}", **rod(1.0))
        model.connect(mbd.Revolute(f"left {k}", cranks[k].end, coupler.start))
        model.connect(mbd.Revolute(f"right {k}", coupler.end, cranks[k + 1].end))
    upright = {f"base {k}.angle": pi for k in range(count + 1)} | {f"left {k}.angle": -pi / 2 for k in range(count)}
    start = mbd.assemble(model, position=upright, velocity={"base 0.angle": -1.0})
    names = [f"base {k}.angle" for k in range(count + 1)]
    inertia, moment = (count + 1) / 3.0 + count, (count + 1) / 2.0 + count
    return Passage((model, start), names[0], until, lambda run: apart(run, *names), lambda phi: (inertia, 0.0),
                   lambda phi: -G * moment * sin(phi))  # fmt: skip


def slider_crank(length: float, turn: float = 4.0, until: float = 0.8) -> Passage:
    """Crank and rod of one length, the slider on the line through the crank's pivot."""
    model = mbd.Model("slider-crank")
    crank, coupler, slider = mbd.Link("crank", **rod(length)), mbd.Link("rod", **rod(length)), mbd.PointMass("s", 1.0)
    model.connect(
        mbd.Revolute("main", model.ground.origin, crank.start), mbd.Revolute("pin", crank.end, coupler.start),
        mbd.Prismatic("guide", model.ground.origin, slider.origin), mbd.Revolute("wrist", slider.origin, coupler.end),
    )  # fmt: skip
    position = {"main.angle": 0.5 + pi / 2, "pin.angle": -1.0, "guide.displacement": 2.0 * length * cos(0.5)}
    start = mbd.assemble(model, position=position, velocity={"main.angle": turn})

    def off(run: Any) -> float:
        return float(np.max(np.abs(run["guide.displacement"] - 2.0 * length * np.sin(run["main.angle"]))))

    def inertia(phi: float) -> tuple[float, float]:  # phi from −y: x ~ sin, y ~ −cos
        size = 1 / 3 + 1 / 12 + 2.25 * cos(phi) ** 2 + 0.25 * sin(phi) ** 2 + 4.0 * cos(phi) ** 2
        return length**2 * size, -12.0 * length**2 * cos(phi) * sin(phi)

    return Passage((model, start), "main.angle", until, off, inertia, lambda phi: -G * length * sin(phi))


def platform(legs: Any, length: float = 1.0, turn: float = 6.0, with_belt: bool = False) -> Passage:
    """A body on parallel cranks that stand on one line: flat, it might tilt. More than two legs are redundant.

    With a belt, a row on velocities drives a wheel at half the speed.
    """
    model, body = mbd.Model("platform"), mbd.RigidBody("platform", mass=2.0, inertia=0.3)
    cranks = [mbd.Link(f"leg {k}", **rod(length)) for k in range(len(legs))]
    for k, (x, crank) in enumerate(zip(legs, cranks, strict=True)):
        foot = model.ground.point(x, 0.0, name=f"foot {k}")
        top = body.point(x, 0.0, name=f"top {k}")
        model.connect(mbd.Revolute(f"base {k}", foot, crank.start), mbd.Revolute(f"top {k}", crank.end, top))
    names = [f"base {k}.angle" for k in range(len(legs))]
    position, velocity = dict.fromkeys(names, 0.3) | {"top 0.angle": -0.3}, {names[0]: turn}
    inertia = len(legs) * length**2 / 3.0 + 2.0 * length**2
    if with_belt:
        wheel = mbd.Link("wheel", mass=1.0, length=1.0, center=0.0, inertia=0.4)
        model.connect(mbd.Revolute("hub", model.ground.point(0.0, 3.0, name="hub"), wheel.start))
        speeds = ("base 0.angle.rate", "hub.angle.rate")
        model.constrain(mbd.Nonholonomic("belt", lambda x, y: x - 2.0 * y, arguments=speeds, unit="rad"))
        velocity["hub.angle"], inertia = 0.5 * turn, inertia + 0.1
    moment = G * length * (0.5 * len(legs) + 2.0)
    start = mbd.assemble(model, position=position, velocity=velocity)
    return Passage((model, start), names[0], 1.0, lambda run: apart(run, *names), lambda phi: (inertia, 0.0),
                   lambda phi: -moment * sin(phi))  # fmt: skip


def stopped(turn: float = 6.0) -> Passage:
    """A parallelogram that meets a soft stop before it is flat, with a block at rest on a table beside it."""
    model = mbd.Model("stopped")
    one, other, coupler = (mbd.Link(name, **rod(1.0)) for name in ("one", "other", "coupler"))
    base = mbd.Revolute("a", model.ground.origin, one.start)
    model.connect(
        base, mbd.Revolute("d", model.ground.point(1.0, 0.0, name="d"), other.start),
        mbd.Revolute("b", one.end, coupler.start), mbd.Revolute("c", coupler.end, other.end),
    )  # fmt: skip
    block = mbd.PointMass("block", 1.0)
    guide = mbd.Translation("guide", model.ground.point(5.0, 0.0, name="table"), block.origin)
    model.connect(guide)
    model.constrain(
        mbd.Penalty("stop", mbd.flexion(base, -1.4), stiffness=40.0, damping=0.0, release="pull"),
        mbd.Unilateral("rests", mbd.height(block.origin)),
    )
    position = {"a.angle": 0.3, "d.angle": 0.3, "b.angle": pi / 2 - 0.3}
    start = mbd.assemble(model, position=position, velocity={"a.angle": turn}, closed=["rests"])
    return Passage(
        (model, start), "a.angle", 0.4, lambda run: apart(run, "a.angle", "d.angle"), lambda phi: (5.0 / 3.0, 0.0),
        lambda phi: -2.0 * G * sin(phi) - 40.0 * max(phi - 1.4, 0.0), pace=2e-5,
    )  # fmt: skip


def kite(a: float = 1.0, b: float = 1.6, until: float = 0.6) -> Passage:
    """Base and crank of one length, the other two links of another: they fold where the crank lies on the base."""
    model, phi = mbd.Model("kite"), 0.9
    crank, coupler, rocker = mbd.Link("crank", **rod(a)), mbd.Link("coupler", **rod(b)), mbd.Link("rocker", **rod(b))
    model.connect(
        mbd.Revolute("a", model.ground.origin, crank.start),
        mbd.Revolute("d", model.ground.point(a, 0.0, name="far"), rocker.start),
        mbd.Revolute("b", crank.end, coupler.start), mbd.Revolute("c", coupler.end, rocker.end),
    )  # fmt: skip

    def reach(phi: Any) -> tuple[Any, Any, Any]:
        """Distance of the tip from the origin, on the line at half the crank's angle; its slope and second slope."""
        s, c = np.sin(phi / 2), np.cos(phi / 2)
        root = np.sqrt(b * b - (a * s) ** 2)
        first = -a * s / 2 - a * a * s * c / (2 * root)
        second = -a * c / 4 - a * a * (c * c - s * s) / (4 * root) - (a * a * s * c) ** 2 / (4 * root**3)
        return a * c + root, first, second

    def links(phi: Any) -> tuple[Any, Any]:
        """Directions of coupler and rocker."""
        r = reach(phi)[0]
        x, y = r * np.cos(phi / 2), r * np.sin(phi / 2)
        return np.arctan2(y - a * np.sin(phi), x - a * np.cos(phi)), np.arctan2(y, x - a)

    def off(run: Any) -> float:
        found = run["d.angle"] - pi / 2 - links(run["a.angle"] - pi / 2)[1]
        return float(np.max(np.abs((found + pi) % (2 * pi) - pi)))

    def energy(phi: float) -> tuple[float, float]:
        """Twice the kinetic energy at unit rate, and the potential energy."""
        r, r1, _ = reach(phi)
        u, w = np.array([cos(phi / 2), sin(phi / 2)]), np.array([-sin(phi / 2), cos(phi / 2)])
        tip, tip1 = r * u, r1 * u + 0.5 * r * w
        end, end1 = a * np.array([cos(phi), sin(phi)]), a * np.array([-sin(phi), cos(phi)])
        total, height = 0.0, 0.5 * end[1] + 0.5 * (end[1] + tip[1]) + 0.5 * tip[1]
        for p, q in (np.zeros(2), end1), (end1, tip1), (np.zeros(2), tip1):
            total += (p @ p + p @ q + q @ q) / 3.0  # a uniform rod from its ends
        return float(total), float(G * height)

    def inertia(angle: float) -> tuple[float, float]:
        phi, d = angle - pi / 2, 1e-5
        return energy(phi)[0], (energy(phi + d)[0] - energy(phi - d)[0]) / (2 * d)

    def pull(angle: float) -> float:
        phi, d = angle - pi / 2, 1e-5
        return -(energy(phi + d)[1] - energy(phi - d)[1]) / (2 * d)

    one, two = links(phi)
    position = {"a.angle": phi + pi / 2, "b.angle": float(one) - phi, "d.angle": float(two) + pi / 2}
    start = mbd.assemble(model, position=position, velocity={"a.angle": -6.0})
    return Passage((model, start), "a.angle", until, off, inertia, pull)
