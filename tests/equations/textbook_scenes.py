"""The same planar mechanisms twice: of bodies, and of energies in the coordinates that these have."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy
from sympy import cos, sin

import mbd
from tests.helpers import one_body

G = 9.81


@dataclass(frozen=True)
class Twins:
    """A mechanism of bodies and one of energies; `names` are the coordinates of the first by those of the second.

    position, velocity, closed : a start, in the second's names; contacts have the same names in both
    """

    bodies: mbd.Model
    energies: mbd.Lagrangian
    names: dict[str, str]
    position: dict[str, float]
    velocity: dict[str, float]
    closed: tuple[str, ...] = ()
    until: float = 0.6

    def starts(self, **more: Any) -> tuple[mbd.State, mbd.State]:
        """Of bodies, and of energies."""
        given = [{self.names[k]: v for k, v in values.items()} for values in (self.position, self.velocity)]
        return (
            mbd.assemble(self.bodies, *given, closed=self.closed, **more),
            mbd.assemble(self.energies, self.position, self.velocity, closed=self.closed, **more),
        )


def coordinates(*names: str) -> list[mbd.Coordinate]:
    return [mbd.Coordinate(name, unit="rad" if name.startswith("a") else "m") for name in names]


def ball(rng: np.random.Generator) -> Twins:
    """A point mass over rough ground and against a wall; it bounces, slides and comes to rest."""
    mass, mu, e, wall = rng.uniform(0.5, 2.0), rng.uniform(0.2, 0.6), rng.uniform(0.2, 0.7), rng.uniform(0.4, 0.9)
    bodies, body = one_body(mbd.PointMass("body", mass), mbd.Translation, "place", title="ball")
    bodies.constrain(
        mbd.Unilateral("floor", mbd.touchdown(body.origin), restitution=e, friction=mu),
        mbd.Unilateral("wall", mbd.separation(body.origin, bodies.ground.point(wall, 0.0), (1, 0, 0)), restitution=0.5),
    )
    x, y = coordinates("x", "y")
    m, g, w = sympy.symbols("m g w")
    energies = mbd.Lagrangian(
        "ball", [x, y], m * (x.v**2 + y.v**2) / 2, m * g * y.q, parameters={m: mass, g: G, w: wall}
    )
    energies.constrain(
        mbd.Unilateral("floor", mbd.measure(y.q, tangents=x.q), restitution=e, friction=mu),
        mbd.Unilateral("wall", w - x.q, restitution=0.5),
    )
    speeds = {"x": rng.uniform(1.0, 2.0), "y": rng.uniform(-0.5, 0.5)}
    return Twins(bodies, energies, {"x": "place.x", "y": "place.y"}, {"x": 0.0, "y": rng.uniform(0.1, 0.3)}, speeds)


def stick(rng: np.random.Generator, friction: float | None = None) -> Twins:
    """A rod that falls on its end, which sticks (or slips) and lifts."""
    mass, length, center, inertia = rng.uniform(0.5, 2.0), rng.uniform(0.5, 1.0), 0.3, 0.05
    bodies, rod = one_body(mbd.Link("rod", mass, length, center, inertia), mbd.Planar, "float", title="stick")
    bodies.constrain(mbd.Unilateral("foot", mbd.touchdown(rod.end), friction=friction))
    x, y, a = coordinates("x", "y", "a")
    m, g, l, c, i = sympy.symbols("m g l c i")  # noqa: E741
    place = (x.q + c * sin(a.q), y.q - c * cos(a.q))
    speeds = [sum(p.diff(each.q) * each.v for each in (x, y, a)) for p in place]
    energies = mbd.Lagrangian(
        "stick", [x, y, a], m * (speeds[0] ** 2 + speeds[1] ** 2) / 2 + i * a.v**2 / 2, m * g * place[1],
        parameters={m: mass, g: G, l: length, c: center, i: inertia},
    )  # fmt: skip
    foot = mbd.measure(y.q - l * cos(a.q), tangents=[x.q + l * sin(a.q)])
    energies.constrain(mbd.Unilateral("foot", foot, friction=friction))
    angle = rng.uniform(-0.5, 0.5)
    names = {"x": "float.x", "y": "float.y", "a": "float.angle"}
    start = {"x": 0.0, "y": length * math.cos(angle) + rng.uniform(0.02, 0.1), "a": angle}
    return Twins(bodies, energies, names, start, {"x": rng.uniform(-0.5, 0.5), "a": rng.uniform(-1.0, 1.0)}, until=0.35)


def rough_stick(rng: np.random.Generator) -> Twins:
    """The same with Coulomb friction."""
    return stick(rng, friction=rng.uniform(0.1, 0.5))


def mat(rng: np.random.Generator) -> Twins:
    """A pendulum that swings into a mat, and a spring and damper on it."""
    mass, length, k, e = rng.uniform(0.5, 2.0), rng.uniform(0.5, 1.0), rng.uniform(2e3, 2e4), rng.uniform(0.3, 0.9)
    bodies = mbd.Model("pendulum")
    bob = mbd.Link("rod", mass, length, length, 0.02)
    pin = mbd.Revolute("pin", bodies.ground.origin, bob.start, loss=mbd.Viscous(0.1), stiffness=3.0, rest=0.2)
    bodies.connect(pin)
    bodies.constrain(mbd.Penalty("mat", mbd.flexion(pin), stiffness=k, exponent=1.5, restitution=e))
    (a,) = coordinates("a")
    m, g, l, i = sympy.symbols("m g l i")  # noqa: E741
    energies = mbd.Lagrangian(
        "pendulum", [a], (m * l**2 + i) * a.v**2 / 2, -m * g * l * cos(a.q), 0.05 * a.v**2,
        parameters={m: mass, g: G, l: length, i: 0.02},
    )  # fmt: skip
    energies.apply(mbd.Potential("spring", lambda angle, k: 0.5 * k * (angle - 0.2) ** 2, ["a", ("k", 3.0)]))
    flexed = -a.q if bodies_flex_to_negative(bodies) else a.q
    energies.constrain(mbd.Penalty("mat", mbd.measure(flexed, unit="rad"), stiffness=k, exponent=1.5, restitution=e))
    return Twins(bodies, energies, {"a": "pin.angle"}, {"a": -0.8}, {"a": rng.uniform(-0.5, 0.5)}, until=1.2)


def bodies_flex_to_negative(model: mbd.Model) -> bool:
    """Whether the gap of a flexion falls as the angle rises."""
    run = mbd.simulate(model, mbd.assemble(model, {"pin.angle": -0.3}), dt=1e-3, until=1e-3, backend="python")
    return bool(run["mat.gap"][0] > 0.0)


def compass(rng: np.random.Generator) -> Twins:
    """A hip on two legs whose feet follow each other by rules."""
    hip, leg, length, slope = 5.0, 1.0, 1.0, 0.06
    center = rng.uniform(0.3, 0.6)
    bodies = mbd.Model("compass", gravity=mbd.on_slope(slope))
    body = mbd.PointMass("hip", hip)
    bodies.connect(mbd.Translation("trunk", bodies.ground.origin, body.origin))
    x, y, left, right = coordinates("x", "y", "a left", "a right")
    m, c, l, gx, gy = sympy.symbols("m c l gx gy")  # noqa: E741
    T, V = hip * (x.v**2 + y.v**2) / 2, -hip * (gx * x.q + gy * y.q)
    feet = []
    for mine, other in ((left, right), (right, left)):
        name, its = (f"{each.name[2:]} foot" for each in (mine, other))
        bone = mbd.Link(mine.name[2:], leg, length, center)
        joint = mbd.Revolute(f"{mine.name[2:]} hip", body.origin, bone.start)
        bodies.connect(joint)
        ahead = mbd.measure(lambda a, b: a - b, f"{mine.name[2:]} hip.angle", f"{other.name[2:]} hip.angle", unit="rad")
        bodies.constrain(mbd.Unilateral(name, mbd.touchdown(bone.end), release=mbd.When(its), only_while=ahead))
        place = (x.q + c * sin(mine.q), y.q - c * cos(mine.q))
        speeds = [sum(p.diff(each.q) * each.v for each in (x, y, mine)) for p in place]
        T, V = T + m * (speeds[0] ** 2 + speeds[1] ** 2) / 2, V - m * (gx * place[0] + gy * place[1])
        gap = mbd.measure(y.q - l * cos(mine.q), tangents=x.q + l * sin(mine.q))
        feet.append(mbd.Unilateral(name, gap, release=mbd.When(its), only_while=mine.q - other.q))
    g = mbd.on_slope(slope)
    energies = mbd.Lagrangian(
        "compass", [x, y, left, right], T, V, parameters={m: leg, c: center, l: length, gx: g[0], gy: g[1]}
    )
    energies.constrain(*feet)
    names = {"x": "trunk.x", "y": "trunk.y", "a left": "left hip.angle", "a right": "right hip.angle"}
    start = {"a left": 0.25 + rng.uniform(-0.05, 0.05), "a right": -0.3}
    return Twins(bodies, energies, names, start, {"a left": -1.2, "a right": -0.4}, ("left foot",), until=0.8)


def sleigh(rng: np.random.Generator) -> Twins:
    """A body on a blade, tied to the origin by a rod that is driven longer."""
    mass, inertia, center = rng.uniform(0.5, 2.0), 0.2, rng.uniform(0.1, 0.3)
    bodies = mbd.Model("sleigh")
    body = mbd.RigidBody("body", mass, inertia, (center, 0.0, 0.0))
    bodies.connect(mbd.Planar("float", bodies.ground.origin, body.origin))
    bodies.constrain(
        mbd.KnifeEdge("blade", body.origin),
        mbd.Bilateral("rail", mbd.height(body.origin), lambda t: 0.1 * t * t),
    )
    x, y, a = coordinates("x", "y", "a")
    t = sympy.Symbol("t")
    place = (x.q + center * cos(a.q), y.q + center * sin(a.q))
    speeds = [sum(p.diff(each.q) * each.v for each in (x, y, a)) for p in place]
    energies = mbd.Lagrangian(
        "sleigh", [x, y, a], mass * (speeds[0] ** 2 + speeds[1] ** 2) / 2 + inertia * a.v**2 / 2, mass * G * place[1]
    )
    energies.constrain(
        mbd.Nonholonomic("blade", -x.v * sin(a.q) + y.v * cos(a.q)),
        mbd.Bilateral("rail", y.q, 0.1 * t**2),
    )
    names = {"x": "float.x", "y": "float.y", "a": "float.angle"}
    return Twins(bodies, energies, names, {"x": 0.1, "a": 0.7}, {"a": rng.uniform(-1.0, 1.0)}, until=0.3)


SCENES = [ball, stick, rough_stick, mat, compass, sleigh]
