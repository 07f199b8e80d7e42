"""Legs that swing by reflex carry a walker over level ground.

As one foot strikes, the other leg is thrown forward: after a delay of 30 ms, as of nerves, its hip flexes with 8 N m
for 0.15 s, and the leg that stands takes the reaction. Nothing else drives the walker and nothing knows of the gait,
which follows from the mechanism and is stable. In this way reflexes, each of its own, make a gait in:

H. Geyer & H. Herr, A muscle-reflex model that encodes principles of legged mechanics produces human walking dynamics
and muscle activities, IEEE Trans. Neural Syst. Rehabil. Eng. 18 (2010) 263.
"""

import mbd

SIDES = ("left", "right")
model = mbd.Model("reflex walker")
hip = mbd.PointMass("hip", mass=10.0)
model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
legs = {side: mbd.Link(f"{side} leg", mass=5.0, length=1.0, center=0.5) for side in SIDES}
joints = {side: mbd.Revolute(f"{side} hip", hip.origin, legs[side].start) for side in SIDES}
model.connect(*joints.values())
for side, other in SIDES, SIDES[::-1]:
    ahead = mbd.measure(lambda a, b: a[0] - b[0] - 0.1, legs[side].end, legs[other].end)
    foot, release = mbd.touchdown(legs[side].end), mbd.When(f"{other} foot")
    reflex = mbd.Mode(
        f"{side} reflex", ("quiet", "delay", "burst"),
        transitions=[
            mbd.Transition(("quiet", "burst"), "delay", on=f"{other} foot"),
            mbd.Transition("delay", "burst", after=0.03),
            mbd.Transition("burst", "quiet", after=0.15),
        ],
    )  # fmt: skip
    model.constrain(mbd.Unilateral(f"{side} foot", foot, release=release, only_while=ahead), reflex)
    model.apply(
        mbd.Motor(f"{side} flexor", joints[side], torque={"burst": 8.0}, by=reflex.name),
        mbd.Motor(f"{side} flexor on {other} leg", joints[other], torque={"burst": -8.0}, by=reflex.name),
    )
position = {"left hip.angle": 0.135, "right hip.angle": -0.135}
near = mbd.assemble(model, position, {"left hip.angle": -0.6, "right hip.angle": 0.0}, closed="left foot")
gait = mbd.limit_cycle(model, near, section="right foot", mirror=SIDES)
start, integrator, dt, until = gait.state, mbd.RungeKutta853(), 0.01, 4.0
