"""Which pushes does a walker survive? The basin of a compass gait over the rates of its legs just after a step.

Legs of 5 kg and 1 m, 10 kg at the hip, down a slope of 3° (A. Goswami, B. Thuilot & B. Espiau, INRIA research report
2996, 1996). Both feet are on the slope; every start is walked until it has come into the ball round the gait, or falls.
"""

import math

import numpy as np

import mbd

model = mbd.Model("compass gait", gravity=mbd.on_slope(math.radians(3.0)))
hip = mbd.PointMass("hip", mass=10.0)
model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
legs = {side: mbd.Link(f"{side} leg", mass=5.0, length=1.0, center=0.5) for side in ("left", "right")}
for side, other in ("left", "right"), ("right", "left"):
    foot, other_foot = legs[side].end, legs[other].end
    ahead = mbd.measure(lambda this, that: this[0] - that[0], foot, other_foot)  # it scuffs as it passes
    release = mbd.When(f"{other} foot")
    model.connect(mbd.Revolute(f"{side} hip", hip.origin, legs[side].start))
    model.constrain(mbd.Unilateral(f"{side} foot", mbd.touchdown(foot), release=release, only_while=ahead))
model.constrain(mbd.Event("fall", mbd.measure(lambda y: y - 0.5, "trunk.y"), terminal=True, direction=-1))

start = mbd.assemble(
    model, closed="left foot", position={"left hip.angle": 0.27, "right hip.angle": -0.27},
    velocity={"left hip.angle": -1.1, "right hip.angle": -0.4},
)  # fmt: skip
gait = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"))
rates = {"left hip.rate": np.linspace(-1.8, -0.6, 25), "right hip.rate": np.linspace(-1.6, 0.8, 25)}
basin = mbd.basin(model, gait, rates, dt=0.05)
start, integrator, dt, until = gait.state, mbd.RungeKutta853(), 2e-3, 8.0

if __name__ == "__main__":
    print(basin)
    basin.plot("basin.png")
