"""Tune the knee damper of a prosthesis until both steps are equally long.

A walker with masses and lengths of a person goes down a slope of 3°; each knee locks as its leg is straight and lets go
when the other foot has struck. The right shank is a prosthesis, a fifth lighter than the left one. With a damper of
0.3 N m s in its knee that foot steps 7 mm farther; the damper of equal steps follows from derivatives of the gait.
"""

import math

import mbd

model = mbd.Model("kneed walker with a prosthesis", gravity=mbd.on_slope(math.radians(3.0)))
hip = mbd.PointMass("hip", mass=34.6)
model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
for side, other, shank_mass, loss in ("left", "right", 2.85, None), ("right", "left", 2.3, mbd.Viscous(0.3)):
    thigh = mbd.Link(f"{side} thigh", mass=6.1, length=0.4056, center=0.1756)
    shank = mbd.Link(f"{side} shank", mass=shank_mass, length=0.4236, center=0.1834)
    knee = mbd.Revolute(f"{side} knee", thigh.end, shank.start, loss=loss)
    model.connect(mbd.Revolute(f"{side} hip", hip.origin, thigh.start), knee)
    lock, release = f"{side} knee lock", mbd.When(f"{other} foot", after_impact=True)
    model.constrain(
        mbd.Unilateral(f"{side} foot", mbd.touchdown(shank.end), release=mbd.When(f"{other} foot"), only_while=lock),
        mbd.Unilateral(lock, mbd.flexion(knee), release=release),
    )

begin = mbd.assemble(
    model, closed=["left foot", "left knee lock"], position={"left hip.angle": 0.302, "right hip.angle": -0.302},
    velocity={"left hip.angle": -1.193, "right hip.angle": -0.451},
)  # fmt: skip
untuned = mbd.limit_cycle(model, begin, section="left foot")
left, right = "step length of left foot", "step length of right foot"
tuned = mbd.optimize(
    untuned, {"right knee loss.coefficient": (0.3, 0.01, 1.0)}, minimize=lambda n: (n[left] - n[right]) ** 2,
    constraints={"largest multiplier": (None, 0.5)},
)  # fmt: skip
print(tuned)
start, integrator, dt, until, parameters = tuned.gait.state, mbd.RungeKutta853(), 2e-3, 8.0, tuned.values
