"""The mechanisms that are measured. They stay as they are, so that figures of different days compare."""

from __future__ import annotations

from dataclasses import dataclass

import mbd


@dataclass(frozen=True)
class Compass:
    """Numbers of the compass walker, in the order of `c/compass.h`: masses [kg], lengths [m], gravity [m/s²]."""

    hip: float = 10.0
    leg: float = 5.0
    length: float = 0.9
    center: float = 0.4
    gx: float = mbd.on_slope(0.0524)[0]
    gy: float = mbd.on_slope(0.0524)[1]


@dataclass(frozen=True)
class Seven:
    """Numbers of the seven-link walker in SI units, in the order of `c/seven.h`."""

    trunk: float = 40.0
    thigh: float = 8.0
    shank: float = 3.5
    foot: float = 0.9
    trunk_inertia: float = 1.5
    thigh_inertia: float = 0.13
    shank_inertia: float = 0.05
    foot_inertia: float = 0.005
    trunk_center: float = 0.3
    thigh_center: float = 0.2
    shank_center: float = 0.18
    foot_x: float = 0.05
    foot_y: float = -0.03
    thigh_length: float = 0.45
    shank_length: float = 0.43
    gx: float = 0.0
    gy: float = -9.81


COMPASS, SEVEN = Compass(), Seven()


def compass(p: Compass = COMPASS) -> tuple[mbd.Model, mbd.State]:
    """Two legs and a hip mass, 4 degrees of freedom; the stance foot is held by two rows."""
    model = mbd.Model("compass", gravity=(p.gx, p.gy, 0.0))
    hip = mbd.PointMass("hip", mass=p.hip)
    left, right = (mbd.Link(f"{side} leg", p.leg, p.length, p.center) for side in ("left", "right"))
    model.connect(
        mbd.Translation("trunk", model.ground.origin, hip.origin),
        mbd.Revolute("left hip", hip.origin, left.start),
        mbd.Revolute("right hip", hip.origin, right.start),
    )
    model.constrain(
        mbd.Bilateral("foot y", mbd.measure(lambda foot: foot[1], left.end)),
        mbd.Bilateral("foot x", mbd.measure(lambda foot: foot[0], left.end)),
    )
    start = mbd.assemble(
        model,
        position={"left hip.angle": 0.271, "right hip.angle": -0.271},
        velocity={"left hip.angle": -1.09, "right hip.angle": -0.377},
    )
    return model, start


def seven(p: Seven = SEVEN) -> tuple[mbd.Model, mbd.State]:
    """Trunk, thighs, shanks and feet, 9 degrees of freedom; the stance foot is held flat by three rows."""
    model = mbd.Model("seven links", gravity=(p.gx, p.gy, 0.0))
    trunk = mbd.RigidBody("trunk", p.trunk, p.trunk_inertia, center=(0.0, p.trunk_center, 0.0))
    model.connect(mbd.Planar("root", model.ground.origin, trunk.origin))
    feet = {}
    for side in ("left", "right"):
        thigh = mbd.Link(f"{side} thigh", p.thigh, p.thigh_length, p.thigh_center, p.thigh_inertia)
        shank = mbd.Link(f"{side} shank", p.shank, p.shank_length, p.shank_center, p.shank_inertia)
        foot = mbd.RigidBody(f"{side} foot", p.foot, p.foot_inertia, center=(p.foot_x, p.foot_y, 0.0))
        feet[side] = foot
        model.connect(
            mbd.Revolute(f"{side} hip", trunk.origin, thigh.start),
            mbd.Revolute(f"{side} knee", thigh.end, shank.start),
            mbd.Revolute(f"{side} ankle", shank.end, foot.origin),
        )
    angles = ("root.angle", "left hip.angle", "left knee.angle", "left ankle.angle")
    model.constrain(
        mbd.Bilateral("foot x", mbd.measure(lambda foot: foot[0], feet["left"].origin)),
        mbd.Bilateral("foot y", mbd.measure(lambda foot: foot[1], feet["left"].origin)),
        mbd.Bilateral("foot flat", mbd.measure(lambda trunk, hip, knee, ankle: trunk + hip + knee + ankle, *angles)),
    )
    names = ("left hip", "left knee", "left ankle", "right hip", "right knee")
    position = dict(zip((f"{name}.angle" for name in names), (0.3, -0.2, -0.1, -0.2, -0.3), strict=True))
    return model, mbd.assemble(model, position=position)


def _kneed_legs(stiffness: float = 0.0) -> tuple[mbd.Model, dict[str, tuple[mbd.Revolute, mbd.Link]]]:
    """Hip mass, thighs and shanks of McGeer's walker; knee and shank of each side. A spring may pull the right knee."""
    model = mbd.Model("kneed walker", gravity=mbd.on_slope(0.0504))
    hip = mbd.PointMass("hip", mass=0.5)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    legs = {}
    for side, spring in ("left", 0.0), ("right", stiffness):
        thigh = mbd.Link(f"{side} thigh", mass=0.5, length=0.5, center=0.325)
        shank = mbd.Link(f"{side} shank", mass=0.05, length=0.5, center=0.125)
        knee = mbd.Revolute(f"{side} knee", thigh.end, shank.start, stiffness=spring, rest=0.3)
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, thigh.start), knee)
        legs[side] = knee, shank
    return model, legs


def kneed_model() -> mbd.Model:
    """McGeer's kneed walker with point masses (Chen 2007, MIT thesis)."""
    model, legs = _kneed_legs()
    for side, other in ("left", "right"), ("right", "left"):
        knee, shank = legs[side]
        strike, after = mbd.When(f"{other} foot"), mbd.When(f"{other} foot", after_impact=True)
        model.constrain(
            mbd.Unilateral(f"{side} foot", mbd.touchdown(shank.end), release=strike),
            mbd.Unilateral(f"{side} knee lock", mbd.flexion(knee), release=after),
        )
    return model


def kneed_walker() -> tuple[mbd.Model, mbd.State]:
    """The kneed walker at the fixed point of its gait, just after the strike of the left foot."""
    model = kneed_model()
    start = mbd.assemble(
        model,
        closed=["left foot", "left knee lock"],
        position={"left hip.angle": 0.18818546025339755 + 0.0504, "right hip.angle": -0.28898546025339755 + 0.0504},
        velocity={
            "left hip.angle": -1.1095873311765565,
            "right hip.angle": -0.05714810633751439,
            "right knee.angle": 0.0,
        },
    )
    return model, start


def knocking_walker(stop: bool) -> tuple[mbd.Model, mbd.State]:
    """The same legs on a held foot, with a spring that drives the swing knee against a stop without loss.

    Some thirty impacts a second, for ever. Without `stop` it is watched all the same, but out of reach.
    """
    model, legs = _kneed_legs(stiffness=0.5)
    foot = legs["left"][1].end
    reach = 0.0 if stop else 10.0
    gap = mbd.measure(lambda angle: reach - angle, "right knee.angle", unit="rad")
    model.constrain(
        mbd.Bilateral("foot x", mbd.measure(lambda foot: foot[0], foot)),
        mbd.Bilateral("foot y", mbd.measure(lambda foot: foot[1], foot)),
        mbd.Bilateral("left knee held", mbd.measure(lambda angle: angle, "left knee.angle", unit="rad")),
        mbd.Unilateral("stop", gap, restitution=1.0),
    )
    position = {"left hip.angle": 0.2, "right hip.angle": -0.2, "right knee.angle": -0.01}
    return model, mbd.assemble(model, position=position)
