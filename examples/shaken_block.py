"""A block on a tilted table that shakes: it sticks, slips downhill a little with every stroke, and sticks again.

Dry friction carries the block while the table asks for less than μ g cos γ; where it asks for more, the block slides on
the table until their velocities meet. On a slope it gives way downhill first, so that shaking lets it creep: Newmark's
sliding block, by which slopes are judged in earthquakes.

N. M. Newmark, Effects of earthquakes on dams and embankments, Géotechnique 15 (1965) 139.
"""

import math

import mbd

g, slope, mu = 9.81, 0.1, 0.4
stroke, frequency = 0.02, 3.0  # of the table [m, 1/s]
turning = 2 * math.pi * frequency

model = mbd.Model("shaken block", gravity=mbd.on_slope(slope, g=g))
table = mbd.PointMass("table", mass=10.0)
block = mbd.PointMass("block", mass=1.0)
model.connect(
    mbd.Prismatic("rail", model.ground.origin, table.origin),
    mbd.Translation("path", model.ground.origin, block.origin),
)
model.constrain(
    mbd.Bilateral("shaker", model.joints[0], value=lambda t: stroke * mbd.sin(turning * t)),
    mbd.Unilateral("sole", mbd.touchdown(block.origin, ground=mbd.Plane(frame=table.origin)), friction=mu),
)

start = mbd.assemble(model, velocity={"path.x": stroke * turning}, closed="sole")
integrator, dt, until = mbd.HHT(alpha=0.05), 1e-3, 3.0
