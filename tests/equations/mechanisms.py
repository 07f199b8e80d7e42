"""Mechanisms that the laws of mechanics are tried on: random trees, a leg with everything, loops."""

import random

import mbd
from mbd.bodies.base import Body, Frame
from mbd.testing.mechanisms import random_tree
from tests.simulation.mechanisms import kneed_walker as walker

__all__ = ["four_bar", "furnished", "leg", "random_tree", "walker"]


def furnished(model: mbd.Model, seed: int) -> mbd.Model:
    """The model with a spring, a damper, applied forces, and rows between its last body and the ground."""
    rng = random.Random(seed)
    bodies = [body for body in model.bodies.values() if body is not model.ground]
    last, first = bodies[-1], bodies[0]
    spatial = any(joint.is_planar is False for joint in model.joints)

    def point(body: Body) -> Frame:
        return body.point(rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5) if spatial else 0.0)

    anchor = model.ground.point(2.0, 1.5, 0.7 if spatial else 0.0)
    model.apply(
        mbd.Spring("spring", anchor, point(last), stiffness=7.0, length=0.8),
        mbd.Damper("damper", point(model.ground), point(last), mbd.Viscous(0.7) + mbd.Quadratic(0.3)),
        mbd.Applied("push", point(last), force=lambda t, p: (mbd.sin(t) * p[0], 2.0, 0.3 * t), torque=(0.3, -0.2, 0.5),
                    arguments=("t", point(first))),
        mbd.Potential("well", lambda p: 0.5 * p[0] * p[0] * p[1], arguments=(point(last),)),
    )  # fmt: skip
    model.constrain(
        mbd.Bilateral("rod", mbd.distance(model.ground.point(3.0, 2.0), point(last)), value=lambda t: 2.0 + 0.1 * t**2),
        mbd.Unilateral("foot", mbd.touchdown(point(last), ground=lambda x: 0.1 * mbd.sin(x))),
        mbd.Penalty("pad", mbd.height(point(last)), stiffness=50.0, damping=2.0, exponent=2),
    )
    return model


def leg() -> mbd.Model:
    """A planar leg with losses, springs, stops and a motor on its joints."""
    model = mbd.Model("leg", gravity=mbd.on_slope(0.05))
    hip = mbd.PointMass("hip", mass=1.5)
    thigh = mbd.Link("thigh", mass=0.7, length=0.5, center=0.2, inertia=0.02)
    shank = mbd.Link("shank", mass=0.3, length=0.45, center=0.2, inertia=0.01)
    base = mbd.Translation("trunk", model.ground.origin, hip.origin, loss={"x": mbd.Viscous(0.4)})
    upper = mbd.Revolute("hip joint", hip.origin, thigh.start, loss=mbd.Viscous(0.1) + mbd.Quadratic(0.2))
    knee = mbd.Revolute("knee", thigh.end, shank.start, loss=mbd.Quadratic(0.3), stiffness=3.0, rest=-0.2)
    model.connect(base, upper, knee)
    model.constrain(
        mbd.Unilateral("foot", mbd.touchdown(shank.end), only_while=mbd.measure("hip joint.angle", unit="rad")),
        mbd.Unilateral("lock", mbd.flexion(knee), release=mbd.When("foot", after_impact=True)),
        mbd.Penalty("stop", mbd.flexion(knee, 0.1), stiffness=300.0, damping=2.0),
        mbd.Event("toe off", mbd.measure("shank.end.vy")),
    )
    model.apply(
        mbd.Motor("drive", upper, lambda t, angle: 0.3 * mbd.sin(2.0 * t) * angle, arguments=["t", "knee.angle"]),
        mbd.TorsionSpring("ankle-like", upper, stiffness=2.0, rest=0.3),
    )
    return model


def four_bar(cut="auto") -> mbd.Model:
    """A four-bar linkage with a damper in one pin and a spring in another."""
    model = mbd.Model("four-bar", cut=cut)
    crank = mbd.Link("crank", mass=1.0, length=0.5, center=0.2, inertia=0.03)
    coupler = mbd.Link("coupler", mass=2.0, length=1.2, center=0.6, inertia=0.2)
    rocker = mbd.Link("rocker", mass=1.5, length=1.0, center=0.4, inertia=0.1)
    model.connect(
        mbd.Revolute("A", model.ground.origin, crank.start, loss=mbd.Viscous(0.2)),
        mbd.Revolute("B", crank.end, coupler.start, stiffness=1.5, rest=0.3),
        mbd.Revolute("C", rocker.end, coupler.end, loss=mbd.Viscous(0.4)),
        mbd.Revolute("D", model.ground.point(1.0, 0.2), rocker.start),
    )
    model.apply(mbd.Motor("drive", model.joints[0], torque=lambda t: 0.5 + t))
    return model
