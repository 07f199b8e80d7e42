"""A rimless wheel rolls on over level ground, pushed along its trailing spoke just before each strike.

From whatever speed, that before a strike tends to P/(m l tan α), with α half of the angle between spokes of length l.
Each strike leaves (I + m l² cos 2α)/(I + m l²) of what the speed differs by, cos 2α for a mass without inertia I.

A. D. Kuo, Energetics of actively powered locomotion using the simplest walking model, J. Biomech. Eng. 124 (2002) 113.
"""

import math

import mbd

SPOKES, PUSH = 8, 0.8  # [-], [N s]
model, hub = mbd.Model("push-off wheel"), mbd.RigidBody("hub", mass=1.0, inertia=0.3)
model.connect(mbd.Planar("wheel", model.ground.origin, hub.origin))
tips = [(math.sin(a), -math.cos(a)) for a in (2.0 * math.pi * k / SPOKES for k in range(SPOKES))]
for k, (x, y) in enumerate(tips):  # of length 1 m; spoke k strikes while spoke k − 1 trails
    x0, y0 = tips[k - 1]
    model.constrain(
        mbd.Unilateral(f"spoke {k}", mbd.touchdown(hub.point(x, y, name=f"tip {k}"))),
        mbd.Impulse(f"push {k}", hub.origin, PUSH, on=f"spoke {k}", direction=(-x0, -y0), axes=hub.origin),
    )
velocity = {"wheel.angle": -2.5, "wheel.x": 2.5, "wheel.y": 0.0}
start = mbd.assemble(model, {"wheel.y": 1.0}, velocity, closed="spoke 0")
integrator, dt, until = mbd.RungeKutta853(), 0.01, 5.0
