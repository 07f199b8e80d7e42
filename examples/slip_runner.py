"""A runner is a mass on a spring: it touches down at 68° and runs 5 m/s.

The leg has no mass and loses nothing, so that such gaits form a family, one for each energy; the one of 5 m/s is found.
It is stable: the angle alone, held in flight, brings the runner back after a push.

A. Seyfarth, H. Geyer, M. Günther & R. Blickhan, A movement criterion for running, J. Biomech. 35 (2002) 649.
"""

import math

import mbd

model, body = mbd.Model("SLIP runner"), mbd.PointMass("body", mass=80.0)
model.connect(mbd.Translation("place", model.ground.origin, body.origin))
leg = mbd.SpringLeg("leg", body.origin, stiffness=20e3, length=1.0, touchdown_angle=math.radians(68.0))
model.constrain(leg, mbd.Event("apex", "place.y.rate", direction=-1))
near = mbd.assemble(model, {"place.y": 1.0}, {"place.x": 5.0, "place.y": 0.0})
gait = mbd.limit_cycle(model, near, section="apex", speed=5.0)
start, integrator, dt, until = gait.state, mbd.RungeKutta853(), 2e-3, 3.0
