"""A powered prosthetic knee swings through: bent by one spring and damper of its motor, straightened by another.

The motor acts as a spring and a damper whose stiffness, damping and rest angle depend on the phase: as the knee is
bent by 50° and hardly moves, late swing follows. Impedances and these thresholds are those of the walking controller
that the Open Source Leg publishes (package opensourceleg). Here the hip is moved as in walking and nothing loads the
foot, so that stance begins as the knee is nearly straight.

A. F. Azocar et al., Design and clinical implementation of an open-source bionic leg, Nature Biomedical Engineering 4
(2020) 941.
"""

import math

import mbd

DEG = math.pi / 180.0
model = mbd.Model("powered knee")
thigh = mbd.Link("thigh", mass=7.0, length=0.42, center=0.18, inertia=0.12)
shank = mbd.Link("shank", mass=3.5, length=0.45, center=0.2, inertia=0.06)
hip = mbd.Revolute("hip", model.ground.origin, thigh.start)
knee = mbd.Revolute("knee", thigh.end, shank.start)
model.connect(hip, knee)
model.constrain(mbd.Bilateral("hip drive", hip, lambda t: (7.5 - 17.5 * mbd.cos(math.pi * t / 0.45)) * DEG))


def impedance(stiffness, damping, rest):
    return lambda angle, rate: -stiffness * (angle + rest * DEG) - damping * rate


late = mbd.Transition(
    "early swing", "late swing", when=mbd.measure(lambda v: v + 3 * DEG, "knee.rate"), direction=1,
    only_while=mbd.measure(lambda q: -q - 50 * DEG, "knee.angle"),
)  # fmt: skip
landing = mbd.Transition("late swing", "early stance", when=mbd.measure(lambda q: q + 10 * DEG, "knee.angle"))
torques = {
    "early swing": impedance(39.749, 0.063, 60.0),
    "late swing": impedance(15.899, 3.816, 5.0),
    "early stance": impedance(99.372, 3.18, 5.0),
}  # stiffness [N m/rad], damping [N m s/rad], flexion at rest [°]
model.apply(
    mbd.Mode("phase", tuple(torques), transitions=[late, landing], remembers={"most": {"late swing": "knee.angle"}}),
    mbd.Motor("motor", knee, torque=torques, by="phase", arguments=["knee.angle", "knee.rate"]),
)
start = mbd.assemble(model, {"knee.angle": -40 * DEG}, {"knee.rate": -150 * DEG})
integrator, dt, until = mbd.RungeKutta853(), 0.002, 0.6
