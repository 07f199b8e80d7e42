"""Shapes of wild scenes: small mechanisms with everything that switches, each made by a random generator."""

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import mbd
from mbd.testing.mechanisms import random_loop, random_scene, random_tree


@dataclass(frozen=True)
class Shape:
    """A model, a posture that it can take [m, rad], and its size [m]."""

    model: Any
    position: dict[str, float]
    size: float = 1.0


def _size(rng: random.Random) -> float:
    """Mostly metres."""
    return rng.choice([1.0, 1.0, 1.0, 1e-4, 1e4])


def _dry(rng: random.Random) -> mbd.Coulomb:
    return mbd.Coulomb(10.0 ** rng.uniform(-2, 1))


def _friction(rng: random.Random) -> dict[str, Any]:
    """How a foot holds: it sticks, slides, rubs or bounces."""
    return rng.choice(
        [
            {}, {"friction": 0.0}, {"friction": rng.uniform(0.05, 1.5)},
            {"friction": rng.choice([0.0, 0.4]), "restitution": rng.choice([0.3, 0.8, 1.0])},
        ]
    )  # fmt: skip


def _penalty(rng: random.Random, name: str, measure: Any) -> mbd.Penalty:
    """A force law of any kind, up to 1e10 N/m."""
    stiffness = 10.0 ** rng.uniform(1, 10)
    law = rng.choice([None, "exact", "hunt-crossley", "lankarani-nikravesh", "flores", "gonthier", "kelvin-voigt"])
    if law is None:
        damping, release = rng.choice([0.0, 1.0, 100.0]), rng.choice(["gap", "pull"])
        return mbd.Penalty(name, measure, stiffness, damping, rng.choice([1.0, 1.5, 2.0]), release=release)
    e = rng.uniform(0.1, 1.0)
    if law == "kelvin-voigt":
        return mbd.Penalty(name, measure, stiffness, restitution=e, law=law, effective_mass=1.0)
    return mbd.Penalty(name, measure, stiffness, exponent=rng.choice([1.0, 1.5]), restitution=e, law=law)


def _ground(rng: random.Random, level: float) -> Any:
    """A floor: at rest, tilted, running, or shaking."""
    return rng.choice(
        [
            mbd.Plane((0.0, 1.0, 0.0), level), mbd.Plane((rng.uniform(-0.5, 0.5), 1.0, 0.0), level),
            mbd.Plane((0.0, 1.0, 0.0), level, velocity=(rng.uniform(-2, 2), 0.0, 0.0)),
            lambda x, t: level + 0.05 * mbd.sin(20.0 * t) + 0.02 * mbd.sin(3.0 * x),
            lambda x: level + 0.1 * mbd.sin(2.0 * x),
        ]
    )  # fmt: skip


def tree(rng: random.Random) -> Shape:
    """A planar tree over the ground, some of its joints dry."""
    model = random_scene(rng.randrange(1 << 30), rng.randint(1, 3))
    for place, joint in enumerate(model.joints):
        if isinstance(joint, mbd.Revolute | mbd.Prismatic) and rng.random() < 0.4:
            model.joints[place] = replace(joint, loss=_dry(rng) + mbd.Viscous(0.1))
    return Shape(_renewed(model), {})


def _renewed(model: mbd.Model) -> mbd.Model:
    """The model with measures of joints as they are now."""
    by_name = {joint.name: joint for joint in model.joints}
    for place, law in enumerate(model.constraints):
        measure = getattr(law, "measure", None)
        joint = getattr(measure, "joint", None)
        if joint is not None:
            model.constraints[place] = replace(law, measure=replace(measure, joint=by_name[joint.name]))  # type: ignore[type-var]
    return model


def loop(rng: random.Random) -> Shape:
    """A planar loop with dry hinges and pins, and a stop."""
    model, angles = random_loop(rng.randrange(1 << 30), rng.randint(3, 4))
    for place, joint in enumerate(model.joints):
        draw = rng.random()
        loss = _dry(rng) if draw < 0.3 else mbd.PinFriction(rng.uniform(0.05, 0.5), 0.02) if draw < 0.6 else joint.loss
        model.joints[place] = replace(joint, loss=loss)  # type: ignore[type-var]
    hinge = model.joints[0]
    limit = angles[f"{hinge.name}.angle"] - rng.uniform(0.05, 0.5)
    model.constrain(mbd.Unilateral("stop", mbd.flexion(hinge, limit), restitution=rng.choice([0.0, 0.5])))
    return Shape(model, angles)


def cranks(rng: random.Random) -> Shape:
    """Parallel cranks with more of them than needed, and a rod that says the same again."""
    size, model = _size(rng), mbd.Model("parallel cranks")
    ends: list[Any] = []
    coupler = mbd.Link("coupler", 1.0, 2.0 * size, size, 0.3 * size * size)
    angles: dict[str, float] = {}
    for k in range(3):
        crank = mbd.Link(f"crank {k}", 1.0, size, 0.5 * size, 0.1 * size * size)
        loss = rng.choice([None, _dry(rng), mbd.Viscous(0.1)])
        model.connect(mbd.Revolute(f"pin {k}", model.ground.point(k * size, 0.0), crank.start, loss=loss))
        ends.append(crank.end)
        angles[f"pin {k}.angle"] = rng.uniform(0.3, 1.2) if not angles else angles["pin 0.angle"]
    for k, end in enumerate(ends):
        model.connect(mbd.Revolute(f"joint {k}", end, coupler.point(0.0, -k * size)))
    if rng.random() < 0.5:
        model.constrain(mbd.Bilateral("rod", mbd.distance(model.ground.point(size, 0.0), ends[1]), value=size))
    model.constrain(mbd.Unilateral("stop", mbd.flexion(model.joints[0], -0.2), restitution=0.5))
    return Shape(model, angles, 1.0)


def balls(rng: random.Random) -> Shape:
    """Point masses in a corner of floor and wall."""
    size, model = _size(rng), mbd.Model("balls")
    position: dict[str, float] = {}
    floor = _ground(rng, 0.0)
    for k in range(rng.randint(1, 2)):
        ball = mbd.PointMass(f"ball {k}", 1.0)
        model.connect(mbd.Translation(f"flight {k}", model.ground.origin, ball.origin))
        wall = mbd.touchdown(ball.origin, mbd.Plane((1.0, 0.1, 0.0), -size))
        model.constrain(
            mbd.Unilateral(f"floor {k}", mbd.touchdown(ball.origin, floor), **_friction(rng)),
            rng.choice([mbd.Unilateral(f"wall {k}", wall, **_friction(rng)), _penalty(rng, f"wall {k}", wall)]),
        )
        position |= {f"flight {k}.x": k * size, f"flight {k}.y": 0.2 * size}
    return Shape(model, position, size)


def block(rng: random.Random) -> Shape:
    """A block that lands on its corners, perhaps on a cart."""
    model, ground = mbd.Model("block"), _ground(rng, 0.0)
    body = mbd.RigidBody("block", 1.0, 0.2)
    model.connect(mbd.Planar("fall", model.ground.origin, body.origin))
    if rng.random() < 0.4:
        cart = mbd.PointMass("cart", 2.0)
        model.connect(mbd.Prismatic("rail", model.ground.origin, cart.origin, loss=rng.choice([None, _dry(rng)])))
        ground = mbd.Plane(frame=cart.origin)
    for k in range(rng.randint(1, 3)):
        corner = body.point((-0.5, 0.5, 0.1)[k], -0.3)
        model.constrain(mbd.Unilateral(f"corner {k}", mbd.touchdown(corner, ground), **_friction(rng)))
    return Shape(model, {"fall.x": 0.0, "fall.y": rng.choice([0.3, 0.5]), "fall.angle": 0.0})


def wheels(rng: random.Random) -> Shape:
    """Wheels that roll, a blade, and rows on velocities."""
    model = mbd.Model("wheels", gravity=rng.choice([(2.0, -9.81, 0.0), (0.0, -9.81, 0.0), (0.0, 0.0, 0.0)]))
    wheel = mbd.RigidBody("wheel", 1.0, 0.05)
    model.connect(mbd.Planar("ride", model.ground.origin, wheel.origin))
    draw = rng.randrange(3)
    if draw == 0:
        plane = mbd.Plane(velocity=(rng.choice([0.0, 0.7]), 0.0, 0.0))
        model.constrain(mbd.Rolling("tyre", wheel.origin, 0.3, plane))
        model.constrain(mbd.Bilateral("road", mbd.height(wheel.origin), value=0.3))
    elif draw == 1:
        model.constrain(mbd.KnifeEdge("blade", wheel.point(0.4, 0.0)))
    else:
        names = ("ride.x.rate", "ride.y.rate", "ride.angle")
        model.constrain(mbd.Nonholonomic("row", lambda a, b, c: a * mbd.sin(c) - b * mbd.cos(c), arguments=names))
    wall = mbd.touchdown(wheel.origin, mbd.Plane((-1.0, 0.0, 0.0), -1.0))
    model.constrain(mbd.Unilateral("wall", wall, restitution=rng.choice([0.0, 0.7]), friction=0.0))
    return Shape(model, {"ride.x": 0.0, "ride.y": 0.3, "ride.angle": rng.uniform(-1, 1)})


def space(rng: random.Random) -> Shape:
    """A tree in space with stops and a foot."""
    model = random_tree(rng.randrange(1 << 30), rng.randint(1, 2), spatial=True, most=4, turned=0.3)
    body = list(model.bodies.values())[-1]
    how: dict[str, Any] = rng.choice([{}, {"friction": 0.0, "restitution": 0.7}])
    foot = mbd.touchdown(body.point(0.1, -0.2, 0.3), mbd.Plane((0.2, 1.0, 0.1), -1.5))
    model.constrain(mbd.Unilateral("foot", foot, **how))
    stops = [joint for joint in model.joints if len(joint.labels) == 1]
    for joint in stops[:1]:
        model.constrain(_penalty(rng, "buffer", mbd.flexion(joint, -1.0)))
    return Shape(model, {})


def mats(rng: random.Random) -> Shape:
    """A pendulum between force laws of every kind."""
    model, bob = mbd.Model("mats"), mbd.Link("bob", 1.0, 1.0, 0.6, 0.1)
    hinge = mbd.Revolute("hinge", model.ground.origin, bob.start, loss=rng.choice([None, mbd.Viscous(0.1)]))
    model.connect(hinge)
    model.constrain(
        _penalty(rng, "front", mbd.extension(hinge, -0.3)), _penalty(rng, "back", mbd.flexion(hinge, -0.3)),
        _penalty(rng, "mat", mbd.touchdown(bob.end, _ground(rng, -0.98))),
    )  # fmt: skip
    return Shape(model, {"hinge.angle": 0.2})


def rules(rng: random.Random) -> Shape:
    """Two legs whose feet release each other, events that reset, a controller."""
    model, hip = mbd.Model("rules", gravity=mbd.on_slope(0.05)), mbd.PointMass("hip", 1.0)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    for side, other in ("left", "right"), ("right", "left"):
        leg = mbd.Link(f"{side} leg", 0.3, 1.0, 0.5, 0.02)
        loss = rng.choice([None, _dry(rng), mbd.Viscous(0.01)])
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, leg.start, loss=loss))
        release = rng.choice([None, mbd.When(f"{other} foot"), mbd.When(f"{other} foot", after_impact=True)])
        only = rng.choice([None, mbd.measure(f"{side} hip.angle", unit="rad")])
        foot = mbd.Unilateral(f"{side} foot", mbd.touchdown(leg.end), release=release, only_while=only)
        model.constrain(foot)
    reset = rng.choice([None, {"left hip.rate": 0.5}, lambda values: {"left hip.rate": -values["left hip.rate"]}])
    model.constrain(mbd.Event("swing", mbd.measure("left hip.angle", unit="rad"), reset=reset))
    if rng.random() < 0.3:
        model.apply(mbd.Motor("drive", model.joints[1], torque=0.1))

        def update(time: float, values: Any, state: Any) -> dict[str, float]:
            return {"drive.torque": math.sin(10.0 * time)}

        model.apply(mbd.Controller("control", update, on=("swing", "left foot"), writes=("drive.torque",)))
    return Shape(model, {"trunk.x": 0.0, "trunk.y": 0.98, "left hip.angle": 0.2, "right hip.angle": -0.2})


def pins(rng: random.Random) -> Shape:
    """A dry chain that touches the ground."""
    size, model = _size(rng), mbd.Model("chain")
    end: Any = model.ground.point(0.0, 1.5 * size)
    position = {}
    for k in range(rng.randint(1, 3)):
        link = mbd.Link(f"link {k}", 1.0, size, 0.5 * size, 0.08 * size * size)
        loss = rng.choice([_dry(rng), mbd.PinFriction(0.3, 0.05 * size), _dry(rng) + mbd.PinFriction(0.1, 0.05 * size)])
        model.connect(mbd.Revolute(f"pin {k}", end, link.start, loss=loss))
        end, position[f"pin {k}.angle"] = link.end, rng.uniform(1.0, 1.6) if k == 0 else 0.1
    model.constrain(mbd.Unilateral("tip", mbd.touchdown(end), **_friction(rng)))
    return Shape(model, position, 1.0)


def column(rng: random.Random) -> Shape:
    """Balls above each other, and a lid."""
    model, below = mbd.Model("column"), None
    position = {}
    for k in range(rng.randint(2, 4)):
        ball = mbd.PointMass(f"ball {k}", 1.0)
        loss = rng.choice([None, None, _dry(rng)])
        model.connect(mbd.Prismatic(f"slide {k}", model.ground.origin, ball.origin, axis=(0, 1, 0), loss=loss))
        measure: Any = mbd.height(ball.origin)
        if below is not None:
            measure = mbd.separation(below, ball.origin, (0.0, 1.0, 0.0))
        model.constrain(mbd.Unilateral(f"contact {k}", measure, restitution=rng.choice([0.0, 0.5, 1.0])))
        below, position[f"slide {k}.displacement"] = ball.origin, 0.1 * k * rng.choice([0.0, 1.0])
    return Shape(model, position)


def textbook(rng: random.Random) -> Shape:
    """Lagrange's equations of a pendulum in x and y."""
    power = rng.choice([1, 3])
    model = mbd.Lagrangian(
        "pendulum in x and y", ["x", "y"], kinetic=lambda x_rate, y_rate: (x_rate**2 + y_rate**2) / 2,
        potential=lambda x, y: 9.81 * y + 100.0 * x ** (power + 1),
        dissipation=(lambda x_rate: 0.1 * x_rate**2) if rng.random() < 0.5 else 0,
        constraints={"rod": lambda x, y: (x**2 + y**2 - 1) / 2},
    )  # fmt: skip
    return Shape(model, {"x": 0.8, "y": -0.6})


SHAPES: tuple[Callable[[random.Random], Shape], ...] = (
    tree, loop, cranks, balls, block, wheels, space, mats, rules, pins, column, textbook,
)  # fmt: skip
