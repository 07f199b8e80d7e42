"""A compass gait carries a torso, which the hip of the leg that stands holds upright.

Which leg stands is a discrete state: each strike exchanges it, and with it the leg on which the torque of the torso
acts back. The legs are those of the compass gait (`mbd run compass-gait`). The gait is found, and is stable.
"""

import math

import mbd

model = mbd.Model("torso walker", gravity=mbd.on_slope(math.radians(3.0)))
hip = mbd.PointMass("hip", mass=10.0)
torso = mbd.Link("torso", mass=2.0, length=0.5, center=0.25, inertia=0.1)
waist = mbd.Revolute("waist", hip.origin, torso.start)
model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin), waist)
legs = {side: mbd.Link(f"{side} leg", mass=5.0, length=1.0, center=0.5) for side in ("left", "right")}
state = ["waist.angle", "waist.rate"]


def hold(angle, rate):  # [N m] on the leg, and back on the torso
    return 100.0 * (angle - math.pi) + 20.0 * rate


for side, other in ("left", "right"), ("right", "left"):
    joint = mbd.Revolute(f"{side} hip", hip.origin, legs[side].start)
    ahead = mbd.measure(lambda a, b: a[0] - b[0] - 0.1, legs[side].end, legs[other].end)
    release = mbd.When(f"{other} foot", may_pull=True)
    model.connect(joint)
    model.constrain(mbd.Unilateral(f"{side} foot", mbd.touchdown(legs[side].end), release=release, only_while=ahead))
    model.apply(mbd.Motor(f"{side} drive", joint, torque={side: hold}, by="stance", arguments=state))
model.apply(
    mbd.Motor("waist drive", waist, torque=lambda q, v: -hold(q, v), arguments=state),
    mbd.Mode("stance", ("left", "right"), transitions=[
        mbd.Transition("left", "right", on="right foot"), mbd.Transition("right", "left", on="left foot"),
    ]),
)  # fmt: skip
position = {"left hip.angle": 0.271, "right hip.angle": -0.271, "waist.angle": math.pi}
velocity = {"left hip.angle": -1.0924, "right hip.angle": -0.3774, "waist.angle": 0.0}
near = mbd.assemble(model, position, velocity, closed="left foot")
gait = mbd.limit_cycle(model, near, section="right foot", mirror=("left", "right"))
start, integrator, dt, until = gait.state, mbd.RungeKutta853(), 0.01, 6.0
