"""Sound side against prosthetic side, with two knees beside each other.

A walker goes down a slope. Its left leg is sound; the right shank is a prosthesis, a fifth lighter, with a viscous
damper in its knee, or an orifice, whose torque grows with the square of the rate. Loads are per kilogram of body mass.
"""

import math

import mbd


def walker(knee_loss):
    """The gait of a walker whose right knee has this loss."""
    model = mbd.Model("walker with a prosthesis", gravity=mbd.on_slope(math.radians(3.0)))
    hip = mbd.PointMass("hip", mass=34.6)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    for side, other, shank_mass, loss in ("left", "right", 2.85, None), ("right", "left", 2.3, knee_loss):
        thigh = mbd.Link(f"{side} thigh", mass=6.1, length=0.4056, center=0.1756)
        shank = mbd.Link(f"{side} shank", mass=shank_mass, length=0.4236, center=0.1834)
        knee = mbd.Revolute(f"{side} knee", thigh.end, shank.start, loss=loss)
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, thigh.start), knee)
        lock, strike = f"{side} knee lock", f"{other} foot"
        model.constrain(
            mbd.Unilateral(f"{side} foot", mbd.touchdown(shank.end), release=mbd.When(strike), only_while=lock),
            mbd.Unilateral(lock, mbd.flexion(knee), release=mbd.When(strike, after_impact=True)),
        )
    angles = {"left hip.angle": 0.302, "right hip.angle": -0.302}
    rates = {"left hip.angle": -1.193, "right hip.angle": -0.451}
    start = mbd.assemble(model, angles, rates, closed=["left foot", "left knee lock"])
    return mbd.limit_cycle(model, start, section="left foot")


damped = walker(mbd.Viscous(0.3))
several = damped, walker(mbd.Quadratic(0.1))
report = mbd.gait_report(*several, names=("viscous", "hydraulic"), symmetry="STA", mass=52.0, strides=3)
print(report)
model, start, integrator, dt, until = damped.map.model, damped.state, mbd.RungeKutta853(), 2e-3, 6.0
