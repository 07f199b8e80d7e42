"""Does it walk? A walker of two straight legs, its gait found from rough starts, and how it changes with the slope.

Legs of 5 kg and 1 m, 10 kg at the hip (A. Goswami, B. Thuilot & B. Espiau, INRIA research report 2996, 1996). Starts
are drawn at random around a posture with both feet on the ground; most fall. Newton's method on the return map finds a
stable gait and an unstable one. Followed up the slope, the stable one begins to limp at 4.39°, in steps of two lengths.
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
    foot, other_foot = legs[side].end, legs[other].end
    ahead = mbd.measure(lambda this, that: this[0] - that[0], foot, other_foot)  # it scuffs as it passes
    release = mbd.When(f"{other} foot")
    model.connect(mbd.Revolute(f"{side} hip", hip.origin, legs[side].start))
    model.constrain(mbd.Unilateral(f"{side} foot", mbd.touchdown(foot), release=release, only_while=ahead))

found = mbd.find_gait(
    model, {"left hip.angle": (0.22, 0.32), "right hip.angle": -0.27},
    {"left hip.angle": (-1.5, -0.9), "right hip.angle": (-0.6, 0.2)}, closed="left foot", open="right foot",
    section="right foot", mirror=("left", "right"), tries=8, parameters={"slope": math.radians(3.0)},
    functions={"slope": gravity},
)  # fmt: skip
gait = found.gait
start, integrator, dt, until = gait.state, mbd.RungeKutta853(), 2e-3, 8.0
