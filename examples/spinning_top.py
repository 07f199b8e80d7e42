"""A top on a point, released with nothing but its spin, nods and goes round instead of falling.

Its axis leaves the release angle θ₀ downwards, comes to rest there again and again, and goes round faster where it is
lower. Energy and two components of angular momentum bound it: cos θ lies between the roots of a cubic, and with spin
ω₃ the time between two cusps tends to 2π A/(C ω₃), the mean rate round to m g l/(C ω₃), as ω₃ grows.

H. Goldstein, C. Poole & J. Safko, Classical Mechanics, §5.7; L. D. Landau & E. M. Lifshitz, Mechanics, §35.
"""

import math

import mbd

model = mbd.Model("spinning top")
body = mbd.RigidBody("body", 0.2, (1.4e-4, 2.5e-4, 1.4e-4), center=(0.0, 0.06, 0.0))
body.point(0.0, 0.12, 0.0, name="tip")
model.connect(mbd.Spherical("point", model.ground.origin, body.origin))

start = mbd.assemble(
    model,
    position={"point.orientation": ((1, 0, 0), 0.4)},
    velocity={"point.angular_velocity": (0.0, 2.0 * math.pi * 30.0, 0.0)},
)
integrator, dt, until = mbd.GeneralizedAlpha(rho_inf=0.9), 2e-4, 1.0
