"""A passive walker with knees walks down a slope: the swing knee bends, swings out, and locks before the foot strikes.

A knee locks by a plastic impact as shank and thigh come into line; the lock carries its leg through stance and lets go
after the next strike, as the other foot takes over (the one-foot rule).

V. F. Hsu Chen, Passive dynamic walking with knees: a point foot model, M.Eng. thesis, MIT (2007): hip, thigh and shank
masses of 0.5, 0.5 and 0.05 kg, legs of 1 m, slope 0.0504 rad. The start is just after a strike of the steady gait;
angles are from the slope's normal. A walker that falls ends its run with the event 'fall'.
"""

import mbd

model = mbd.Model("kneed walker", gravity=mbd.on_slope(0.0504))
hip = mbd.PointMass("hip", mass=0.5)
model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
for side, other in ("left", "right"), ("right", "left"):
    thigh = mbd.Link(f"{side} thigh", mass=0.5, length=0.5, center=0.325)
    shank = mbd.Link(f"{side} shank", mass=0.05, length=0.5, center=0.125)
    knee = mbd.Revolute(f"{side} knee", thigh.end, shank.start)
    model.connect(mbd.Revolute(f"{side} hip", hip.origin, thigh.start), knee)
    model.constrain(
        mbd.Unilateral(f"{side} foot", mbd.touchdown(shank.end), release=mbd.When(f"{other} foot")),
        mbd.Unilateral(f"{side} knee lock", mbd.flexion(knee), release=mbd.When(f"{other} foot", after_impact=True)),
    )
model.constrain(mbd.Event("fall", mbd.measure(lambda p: p[1] - 0.5, hip.origin), terminal=True))

start = mbd.assemble(
    model,
    closed=["left foot", "left knee lock"],
    position={"left hip.angle": 0.2386, "right hip.angle": -0.2386},
    velocity={"left hip.angle": -1.1096, "right hip.angle": -0.0571},
)
integrator, dt, until = mbd.HHT(alpha=0.05), 1e-3, 6.0
