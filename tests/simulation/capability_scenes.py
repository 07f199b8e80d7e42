"""A small scene for each law of the capability table: its model, start, end, and the number that is compared."""

import mbd
from tests.helpers import one_body


def _bar(name, length=1.0):
    return mbd.Link(name, length=length, **mbd.rod(mass=1.0, length=length).link)


def _pendulum(loss=None):
    model, bar = mbd.Model("pendulum"), _bar("bar")
    model.connect(mbd.Revolute("hinge", model.ground.origin, bar.start, loss=loss))
    return model, bar


def _ball(**law):
    model, ball = one_body(mbd.PointMass("ball", 1.0), mbd.Translation, "flight")
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(ball.origin), **law))
    start = mbd.assemble(model, position={"flight.y": 0.1}, velocity={"flight.x": 1.0})
    return model, start, 0.35, "flight.x"


def tree():
    """No row, no contact."""
    model, _ = _pendulum()
    return model, mbd.assemble(model, position={"hinge.angle": 1.0}), 0.5, "hinge.angle"


def rows_on_positions():
    """A rod to the ground in place of a joint."""
    model, ball = one_body(mbd.PointMass("ball", 1.0), mbd.Translation, "flight", title="rod")
    model.constrain(mbd.Bilateral("rod", mbd.distance(model.ground.origin, ball.origin), value=1.0))
    return model, mbd.assemble(model, position={"flight.x": 0.6, "flight.y": -0.8}), 0.5, "flight.x"


def rows_on_velocities():
    """A sleigh."""
    model, sleigh = mbd.Model("sleigh", gravity=(0.0, -1.0, 0.0)), mbd.RigidBody("sleigh", 1.0, 0.2, (0.2, 0.0, 0.0))
    model.connect(mbd.Planar("glide", model.ground.origin, sleigh.origin))
    model.constrain(mbd.KnifeEdge("blade", sleigh.origin))
    start = mbd.assemble(model, velocity={"glide.x": 1.0, "glide.angle": 1.0})
    return model, start, 0.5, "glide.x"


def rolling():
    """A wheel on a plane."""
    model, wheel = one_body(mbd.RigidBody("wheel", 1.0, 0.05), mbd.Planar, "ride", gravity=(1.0, -9.81, 0.0))
    model.constrain(mbd.Bilateral("road", mbd.height(wheel.origin), value=0.3), mbd.Rolling("tyre", wheel.origin, 0.3))
    return model, mbd.assemble(model, position={"ride.y": 0.3}), 0.5, "ride.x"


def sticking_contact():
    """A bar that lands on its end and topples over it."""
    model, bar = mbd.Model("bar"), _bar("bar")
    model.connect(mbd.Planar("fall", model.ground.origin, bar.start))
    model.constrain(mbd.Unilateral("tip", mbd.touchdown(bar.end)))
    start = mbd.assemble(model, position={"fall.y": 1.0, "fall.angle": 0.5}, velocity={"fall.x": 0.5})
    return model, start, 0.4, "fall.angle"


def frictionless_contact():
    """A ball that stays on the floor, and glides."""
    return _ball(friction=0.0)


def rebound():
    """A ball that jumps."""
    model, start, until, _ = _ball(friction=0.0, restitution=0.8)
    return model, start, until, "flight.y"


def sliding_contact():
    """A ball that lands and is slowed down by friction."""
    return _ball(friction=0.3)


def released_contact():
    """A foot that another one releases."""
    model, hip = one_body(mbd.PointMass("hip", 1.0), mbd.Translation, "trunk", gravity=mbd.on_slope(0.05))
    for side, other in ("left", "right"), ("right", "left"):
        leg = mbd.Link(f"{side} leg", 0.3, 1.0, 0.5, 0.02)
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, leg.start))
        release = mbd.When(f"{other} foot")
        model.constrain(mbd.Unilateral(f"{side} foot", mbd.touchdown(leg.end), release=release))
    pose = {"left hip.angle": -0.05, "right hip.angle": 0.3}
    start = mbd.assemble(model, pose, velocity={"left hip.angle": -1.5}, closed=["left foot"])
    return model, start, 0.3, "left hip.angle"


def penalty():
    """A pendulum against a rubber stop."""
    model, _ = _pendulum()
    model.constrain(mbd.Penalty("stop", mbd.extension(model.joints[0], -0.2), stiffness=500.0, damping=5.0))
    return model, mbd.assemble(model, {"hinge.angle": 0.0}, velocity={"hinge.angle": 2.0}), 0.3, "hinge.angle"


def penalty_with_restitution():
    """The same with a law that holds the speed of approach."""
    model, _ = _pendulum()
    model.constrain(mbd.Penalty("stop", mbd.extension(model.joints[0], -0.2), stiffness=500.0, restitution=0.5))
    return model, mbd.assemble(model, {"hinge.angle": 0.0}, velocity={"hinge.angle": 2.0}), 0.3, "hinge.angle"


def dry_joint():
    """A hinge that comes to rest by Coulomb's friction."""
    model, _ = _pendulum(mbd.Coulomb(3.0))
    return model, mbd.assemble(model, {"hinge.angle": 0.3}, velocity={"hinge.angle": 1.0}), 0.5, "hinge.angle"


def pin():
    """A hinge whose friction follows its reaction."""
    model, _ = _pendulum(mbd.PinFriction(0.4, 0.1))
    return model, mbd.assemble(model, {"hinge.angle": 0.3}, velocity={"hinge.angle": 1.0}), 0.5, "hinge.angle"


def event():
    """A swing pushed as it passes its lowest place."""
    model, _ = _pendulum()
    guard = mbd.measure("hinge.angle", unit="rad")
    model.constrain(mbd.Event("push", guard, reset=lambda v: {"hinge.rate": 1.5 * v["hinge.rate"]}))
    return model, mbd.assemble(model, position={"hinge.angle": 0.5}), 0.6, "hinge.angle"


def controller():
    """A motor switched by a contact and a clock."""
    model, _ = _pendulum()
    model.apply(mbd.Motor("drive", model.joints[0], torque=0.5))
    model.constrain(mbd.Unilateral("stop", mbd.extension(model.joints[0], -0.2), restitution=0.5))

    def update(time, values, state):
        return {"drive.torque": 0.5 - time}

    model.apply(mbd.Controller("control", update, period=0.11, on="stop", writes="drive.torque"))
    return model, mbd.assemble(model, {"hinge.angle": 0.0}, velocity={"hinge.angle": 2.0}), 0.3, "hinge.angle"


SCENES = {
    "tree": tree, "rows on positions": rows_on_positions, "rows on velocities": rows_on_velocities,
    "rolling": rolling, "sticking contact": sticking_contact, "frictionless contact": frictionless_contact,
    "restitution": rebound, "friction μ": sliding_contact, "release=When": released_contact, "penalty": penalty,
    "penalty with restitution": penalty_with_restitution, "dry joint": dry_joint, "pin friction": pin,
    "event": event, "controller": controller,
}  # fmt: skip
