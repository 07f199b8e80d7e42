"""Small mechanisms whose contacts have answers in closed form, and a walker."""

import mbd

G = 9.81
"""Gravity [m/s²]."""


def falling(mass: float = 2.0) -> tuple[mbd.Model, mbd.PointMass]:
    """A ball on a vertical line, without a floor: 'fall.displacement' is its height."""
    model = mbd.Model("ball")
    body = mbd.PointMass("ball", mass=mass)
    model.connect(mbd.Prismatic("fall", model.ground.origin, body.origin, axis=(0, 1, 0)))
    return model, body


def ball(mass: float = 2.0, **contact) -> mbd.Model:
    """A ball that falls on the contact 'floor'."""
    model, body = falling(mass)
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin), **contact))
    return model


def point(gravity=(0.0, -G, 0.0), mass: float = 1.0) -> tuple[mbd.Model, mbd.PointMass]:
    """A point that moves in the plane: 'place.x', 'place.y'."""
    model = mbd.Model("point", gravity=gravity)
    body = mbd.PointMass("body", mass=mass)
    model.connect(mbd.Translation("place", model.ground.origin, body.origin))
    return model, body


def two_balls() -> tuple[mbd.Model, mbd.PointMass, mbd.PointMass]:
    """Two independent balls, 'a' and 'b', at heights 'a.displacement' and 'b.displacement'."""
    model = mbd.Model("two balls")
    bodies = [mbd.PointMass(f"ball {name}", mass=1.0) for name in "ab"]
    for name, body in zip("ab", bodies, strict=True):
        model.connect(mbd.Prismatic(name, model.ground.origin, body.origin, axis=(0, 1, 0)))
    return model, bodies[0], bodies[1]


def box(friction: float | None = 0.0, restitution: float = 0.0, reverse: bool = False) -> mbd.Model:
    """A box 0.5 m wide and 0.3 m high over the ground, with the contacts 'left' and 'right' at its lower corners."""
    model = mbd.Model("box")
    body = mbd.RigidBody("box", mass=2.0, inertia=0.2)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    contacts = [
        mbd.Unilateral(name, mbd.touchdown(body.point(x, -0.15)), restitution=restitution, friction=friction)
        for name, x in (("left", -0.25), ("right", 0.25))
    ]
    model.constrain(*(contacts[::-1] if reverse else contacts))
    return model


def pendulum(loss=None) -> mbd.Model:
    """A rod of 1 kg and 1 m on a hinge with the coordinate 'hinge.angle'."""
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=1.0 / 12.0)
    model.connect(mbd.Revolute("hinge", model.ground.origin, rod.start, loss=loss))
    return model


def kneed_walker(slope: float = 0.0504, cut="auto", loss=None) -> mbd.Model:
    """The kneed walker of Chen: locking knees, McGeer's rule at the feet."""
    walker = mbd.Model("kneed walker", gravity=mbd.on_slope(slope), cut=cut)
    hip = mbd.PointMass("hip", mass=0.5)
    walker.connect(mbd.Translation("trunk", walker.ground.origin, hip.origin))
    for side, other in ("left", "right"), ("right", "left"):
        thigh = mbd.Link(f"{side} thigh", mass=0.5, length=0.5, center=0.325)
        shank = mbd.Link(f"{side} shank", mass=0.05, length=0.5, center=0.125)
        knee = mbd.Revolute(f"{side} knee", thigh.end, shank.start, loss=loss)
        walker.connect(mbd.Revolute(f"{side} hip", hip.origin, thigh.start), knee)
        walker.constrain(
            mbd.Unilateral(f"{side} foot", mbd.touchdown(shank.end), release=mbd.When(f"{other} foot")),
            mbd.Unilateral(
                f"{side} knee lock", mbd.flexion(knee), release=mbd.When(f"{other} foot", after_impact=True)
            ),
        )
    return walker


def kneed_walker_start(walker: mbd.Model, **more) -> mbd.State:
    """Just after heel strike, near the fixed point of its gait."""
    return mbd.assemble(
        walker,
        closed=["left foot", "left knee lock"],
        position={"left hip.angle": 0.2385854603, "right hip.angle": -0.2385854603},
        velocity={"left hip.angle": -1.1095873312, "right hip.angle": -0.0571481063, "right knee.angle": 0.0},
        **more,
    )


def run(model: mbd.Model, position=None, velocity=None, closed=(), open=(), integrator=None, **settings):
    """Assemble and simulate, by default with HHT and steps of 10 ms."""
    backend = {"backend": settings["backend"]} if "backend" in settings else {}
    start = mbd.assemble(model, position=position, velocity=velocity, closed=closed, open=open, **backend)
    return mbd.simulate(model, start, integrator or mbd.HHT(alpha=0.05), **{"dt": 0.01, "until": 1.0, **settings})
