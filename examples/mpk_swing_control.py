"""A microprocessor knee lets the shank swing freely, stops it near 60° of flexion and brakes it before it is straight.

Every 10 ms the knee reads its angle and rate and sets its valve: stiffer the farther it is beyond 45° as it bends, and
within the last 25° as it straightens. The valve answers 5 ms later. The hip is moved as in walking; a stop ends the
extension.

H. Herr & A. Wilkenfeld, User-adaptive control of a magnetorheological prosthetic knee, Industrial Robot 30 (2003) 42.
The numbers are of that order, not those of a product.
"""

import math

import mbd

DEG = math.pi / 180.0
model = mbd.Model("MPK swing control")
thigh = mbd.Link("thigh", mass=7.0, length=0.42, center=0.18, inertia=0.12)
shank = mbd.Link("shank", mass=3.5, length=0.45, center=0.2, inertia=0.06)
hip = mbd.Revolute("hip", model.ground.origin, thigh.start)
knee = mbd.Revolute("knee", thigh.end, shank.start, loss=mbd.Viscous(0.2))
model.connect(hip, knee)
model.constrain(
    mbd.Bilateral("hip drive", hip, lambda t: (7.5 - 17.5 * mbd.cos(math.pi * t / 0.45)) * DEG),
    mbd.Unilateral("extension stop", mbd.flexion(knee)),
)


def valve(angle, rate):  # [N m s/rad], from the angle and rate of the knee, negative as it bends
    bending = 0.2 + 20.0 * mbd.maximum(-angle - 45.0 * DEG, 0.0)
    straightening = 0.2 + 6.0 * mbd.maximum(angle + 25.0 * DEG, 0.0)
    return mbd.where(rate < 0.0, bending, straightening)


reads = ["knee.angle", "knee.rate"]
model.apply(mbd.SampledLaw("valve", 0.01, {"knee loss.coefficient": valve}, arguments=reads, delay=0.005))
start = mbd.assemble(model, {"knee.angle": -25.0 * DEG}, {"knee.rate": -360.0 * DEG})
integrator, dt, until = mbd.RungeKutta853(), 2e-3, 0.7
