"""A mass walks on two springs, with the ground forces of human walking.

Legs of 14 kN/m touch down at 69°; of the gaits, one for each energy, that of 816 J is found. It is highest over the
foot that stands and lowest while both do, and the force of each leg has two humps. It is stable at this energy.

H. Geyer, A. Seyfarth & R. Blickhan, Compliant leg behaviour explains basic dynamics of walking and running, Proc. R.
Soc. B 273 (2006) 2861.
"""

import math

import mbd

model, body = mbd.Model("spring-mass walker"), mbd.PointMass("body", mass=80.0)
model.connect(mbd.Translation("place", model.ground.origin, body.origin))
for side in ("left", "right"):
    model.constrain(mbd.SpringLeg(f"{side} leg", body.origin, 14e3, 1.0, math.radians(69.0)))
model.constrain(mbd.Event("highest", "place.y.rate", direction=-1))
near = mbd.assemble(
    model,
    {"place.x": 0.0, "place.y": 0.97},
    {"place.x": 1.1, "place.y": 0.0},
    closed="left leg",
    anchors={"left leg": (0.0, 0.0)},
)
gait = mbd.limit_cycle(model, near, section="highest", mirror=("left", "right"), energy=816.0)
start, integrator, dt, until = gait.state, mbd.RungeKutta853(), 5e-3, 4.0
