"""Two point masses on two massless rods, the smallest mechanism whose large swings are chaotic.

Energy is kept, and the rods carry tension or compression: the reactions of the pins. The angle of the elbow is
measured from the upper rod, so the lower rod makes the angle pin.angle + elbow.angle with the vertical.

The equations are in every textbook: L. D. Landau & E. M. Lifshitz, Mechanics, section 5, problem 1.
"""

import mbd

model = mbd.Model("double pendulum")
upper = mbd.Link("upper rod", mass=1.0, length=1.0, center=1.0)
lower = mbd.Link("lower rod", mass=1.0, length=1.0, center=1.0)
model.connect(
    mbd.Revolute("pin", model.ground.origin, upper.start),
    mbd.Revolute("elbow", upper.end, lower.start),
)

start = mbd.assemble(model, position={"pin.angle": 2.0, "elbow.angle": -0.5})
integrator, dt, until = mbd.GeneralizedAlpha(rho_inf=0.9), 1e-3, 5.0
