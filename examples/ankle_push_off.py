"""Push-off drives a walker over level ground, and a spring between its legs makes its steps short and fast.

Just before the leading foot strikes, the trailing leg pushes along itself by an impulse, as an ankle does. What it
gives is what the strike then takes. The gait is found, and is stable.

A. D. Kuo, Energetics of actively powered locomotion using the simplest walking model, J. Biomech. Eng. 124 (2002) 113.
"""

import mbd

SIDES = ("left", "right")
model = mbd.Model("ankle push-off")
hip = mbd.PointMass("hip", mass=10.0)
model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
legs = {side: mbd.Link(f"{side} leg", mass=5.0, length=1.0, center=0.5) for side in SIDES}
for side, other in SIDES, SIDES[::-1]:
    foot, up = mbd.touchdown(legs[side].end), (0.0, 1.0)
    ahead = mbd.measure(lambda a, b: a[0] - b[0] - 0.1, legs[side].end, legs[other].end)
    model.connect(mbd.Revolute(f"{side} hip", hip.origin, legs[side].start))
    model.constrain(
        mbd.Unilateral(f"{side} foot", foot, release=mbd.When(f"{other} foot"), only_while=ahead),
        mbd.Impulse(f"{side} push-off", hip.origin, 4.0, on=f"{other} foot", direction=up, axes=legs[side].start),
    )  # [N s], along the leg


def between(left, right):  # [J]
    return 10.0 * (left - right) ** 2


model.apply(mbd.Potential("hip spring", between, arguments=["left hip.angle", "right hip.angle"]))
position = {"left hip.angle": 0.186, "right hip.angle": -0.186}
near = mbd.assemble(model, position, {"left hip.angle": -1.08, "right hip.angle": -0.93}, closed="left foot")
gait = mbd.limit_cycle(model, near, section="right foot", mirror=SIDES)
start, integrator, dt, until = gait.state, mbd.RungeKutta853(), 0.01, 3.0
