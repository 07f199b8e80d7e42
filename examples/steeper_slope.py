"""A steeper slope makes it limp: gaits of a walker of two straight legs along the slope, and a doubling of its period.

Legs of 5 kg and 1 m, 10 kg at the hip (A. Goswami, B. Thuilot & B. Espiau, INRIA research report 2996, 1996). At 4.39°
a Floquet multiplier passes −1: from there on the walk with equal steps is unstable, and one with a long step after a
short one is stable. With a heavier hip that happens on a gentler slope.
"""

import math

import mbd


def gravity(slope):
    return {"gravity.x": 9.81 * math.sin(slope), "gravity.y": -9.81 * math.cos(slope)}


model = mbd.Model("compass gait", gravity=mbd.on_slope(math.radians(3.0)))
hip = mbd.PointMass("hip", mass=10.0)
model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
legs = {side: mbd.Link(f"{side} leg", mass=5.0, length=1.0, center=0.5) for side in ("left", "right")}
for side, other in ("left", "right"), ("right", "left"):
    model.connect(mbd.Revolute(f"{side} hip", hip.origin, legs[side].start))
    ahead = mbd.measure(lambda this, that: this[0] - that[0], legs[side].end, legs[other].end)
    foot, release = mbd.touchdown(legs[side].end), mbd.When(f"{other} foot")
    model.constrain(mbd.Unilateral(f"{side} foot", foot, release=release, only_while=ahead))

posture, rates = {"left hip.angle": 0.27, "right hip.angle": -0.27}, {"left hip.angle": -1.1, "right hip.angle": -0.4}
start = mbd.assemble(model, posture, rates, closed="left foot", open="right foot")
slope = {"parameters": {"slope": math.radians(3.0)}, "functions": {"slope": gravity}}
gait = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"), **slope)
slopes = mbd.branch(gait, "slope", to=math.radians(4.6))
(doubling,) = slopes.points("doubling")
limping = slopes.switch(doubling)
heavier = slopes.follow(doubling, "hip.mass", to=15.0, steps=5)
start, integrator, dt, until = gait.state, mbd.RungeKutta853(), 2e-3, 8.0
