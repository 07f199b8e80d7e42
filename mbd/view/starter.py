"""The script that ``mbd new NAME`` writes."""

STARTER = '''"""{title}: a leg that swings, bends its knee and meets the ground.

Run it with   mbd run {file}   : numbers, plots and a page with the motion.
Units: m, kg, s, N, rad. The plane is x (forward) and y (up); gravity points down y.
"""

import mbd

model = mbd.Model({title!r})

# Bodies: links run from .start down to .end; center is measured from the start.
thigh = mbd.Link("thigh", mass=7.0, length=0.43, center=0.19, inertia=0.13)
shank = mbd.Link("shank", mass=3.5, length=0.45, center=0.19, inertia=0.05)

# Joints connect two points. Angles are right-handed about z; a loss takes energy out of the joint.
hip = mbd.Revolute("hip", model.ground.point(0.0, 0.87), thigh.start, loss=mbd.Viscous(1.0))
knee = mbd.Revolute("knee", thigh.end, shank.start, loss=mbd.Viscous(0.5))
model.connect(hip, knee)

# Contacts open and close: a stop of rubber that keeps the knee from bending forward, and the ground under the foot.
model.constrain(
    mbd.Penalty("knee stop", mbd.flexion(knee), stiffness=1300.0, damping=10.0),
    mbd.Unilateral("foot", mbd.height(shank.end), restitution=0.0),
)

# A force law is a function of what `arguments` names; use mbd.sin, mbd.where, … inside it.
model.apply(mbd.Motor("hip drive", hip, lambda t: 20.0 * mbd.sin(2.0 * mbd.pi * t)))

# The start: what is not named is found so that all constraints hold.
start = mbd.assemble(model, position={{"hip.angle": 0.5, "knee.angle": -0.6}})

# The scheme, its step and the end; tol = 1e-6 in the place of dt lets the steps follow an error.
integrator, dt, until = mbd.HHT(alpha=0.05), 1e-3, 2.0

if __name__ == "__main__":
    run = mbd.simulate(model, start, integrator, dt=dt, until=until)
    print(run)
    print("largest force under the foot:", run["foot.force"].max(), "N")
    run.page({page!r})
'''
