"""A slider-crank whose crank turns at a prescribed constant speed: h(q, t) = crank angle − ω t.

The motion is known in advance, so the simulation does inverse dynamics: the multiplier of the prescribed motion is the
torque that the drive must give, run["drive.torque"]. With crank r at the angle θ and rod L, the slider is at
r cos θ + √(L² − r² sin² θ).

Dimensions of the slider-crank of the Test Set for IVP Solvers (Simeon 1996), here with a rigid rod and no gravity.
"""

import math

import mbd

speed = 150.0  # rad/s
model = mbd.Model("slider-crank", gravity=(0.0, 0.0, 0.0))
crank = mbd.Link("crank", mass=0.36, length=0.15, center=0.0, inertia=0.002)
rod = mbd.Link("rod", length=0.3, **mbd.rod(mass=0.151104, length=0.3).link)
slider = mbd.PointMass("slider", mass=0.075552)
main_bearing = mbd.Revolute("main bearing", model.ground.origin, crank.start)
model.connect(
    main_bearing,
    mbd.Revolute("crank pin", crank.end, rod.start),
    mbd.Revolute("wrist pin", rod.end, slider.origin),
    mbd.Prismatic("guide", model.ground.origin, slider.origin),
)
# A link hangs at angle zero; the crank points along the guide at π/2.
model.constrain(mbd.Bilateral("drive", main_bearing, value=lambda t: math.pi / 2 + speed * t))

start = mbd.assemble(model, position={"main bearing.angle": math.pi / 2, "guide.displacement": 0.45})
integrator, dt, until = mbd.GeneralizedAlpha(rho_inf=0.9), 2e-5, 4 * math.pi / speed
