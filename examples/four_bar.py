"""A crank-rocker: a motor turns the short crank all the way round, the rocker on the other side swings.

Grashof's condition, shortest + longest < sum of the other two (0.1 + 0.4 < 0.35 + 0.3), lets the crank turn. The rocker
is at its ends where crank and coupler lie in one line, so triangles with the sides 0.35 ± 0.1, 0.3 and 0.4 give its
swing. The loop is closed by the last joint, which becomes two constraints with multipliers.

J. J. Uicker, G. R. Pennock & J. E. Shigley, Theory of Machines and Mechanisms, chapters 1 and 2.
"""

import mbd

model = mbd.Model("four-bar")
crank = mbd.Link("crank", mass=4.0, length=0.1, center=0.0, inertia=0.02)  # with a flywheel
coupler = mbd.Link("coupler", length=0.35, **mbd.rod(mass=0.8, length=0.35).link)
rocker = mbd.Link("rocker", length=0.3, **mbd.rod(mass=0.7, length=0.3).link)
drive = mbd.Revolute("drive", model.ground.origin, crank.start)
model.connect(
    drive,
    mbd.Revolute("crank pin", crank.end, coupler.start),
    mbd.Revolute("coupler pin", coupler.end, rocker.end),
    mbd.Revolute("rocker pin", model.ground.point(0.4, 0.0, 0.0), rocker.start, loss=mbd.Viscous(1.0)),
)
model.apply(mbd.Motor("motor", drive, torque=1.0))

start = mbd.assemble(model, position={"drive.angle": 0.0})
integrator, dt, until = mbd.GeneralizedAlpha(rho_inf=0.9), 1e-3, 3.0
