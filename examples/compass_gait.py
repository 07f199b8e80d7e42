"""The compass gait: two straight legs walk down a slope of 3° with no motor and no control.

Legs of equal length scuff: at mid-stance the swing foot passes a little below the ground, where a real walker has
knees or stepping stones. The model watches a foot only while it is ahead of the other one: `only_while`. At the strike
the new foot stops dead; the old one is released just before and takes no impulse (the one-foot rule).

A. Goswami, B. Thuilot & B. Espiau, Compass-like biped robot, INRIA research report 2996 (1996): legs of 5 kg and 1 m,
10 kg at the hip. The start is just after a strike of the steady gait; angles are from the slope's normal.
"""

import math

import mbd

model = mbd.Model("compass gait", gravity=mbd.on_slope(math.radians(3.0)))
hip = mbd.PointMass("hip", mass=10.0)
model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
legs = {side: mbd.Link(f"{side} leg", mass=5.0, length=1.0, center=0.5) for side in ("left", "right")}
for side, other in ("left", "right"), ("right", "left"):
    foot, other_foot = legs[side].end, legs[other].end
    ahead = mbd.measure(lambda this, that: this[0] - that[0] - 0.1, foot, other_foot)  # by 0.1 m
    model.connect(mbd.Revolute(f"{side} hip", hip.origin, legs[side].start))
    model.constrain(
        mbd.Unilateral(f"{side} foot", mbd.touchdown(foot), release=mbd.When(f"{other} foot"), only_while=ahead)
    )

start = mbd.assemble(
    model,
    closed="left foot",
    position={"left hip.angle": 0.2710, "right hip.angle": -0.2710},
    velocity={"left hip.angle": -1.0924, "right hip.angle": -0.3774},
)
integrator, dt, until = mbd.HHT(alpha=0.05), 1e-3, 8.0
