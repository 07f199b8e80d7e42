"""A coin rolls in a circle, leaning inwards; upright it stays up only faster than √(g R/3).

A thin disk of radius R without slip. In a steady turn its lean θ, heading rate ψ̇ and spin φ̇ are in balance,
``6 R φ̇ ψ̇ cos θ = 5 R ψ̇² sin θ cos θ + 4 g sin θ``, and its edge draws a circle of radius R φ̇/ψ̇ (J. I. Neimark &
N. A. Fufaev, Dynamics of Nonholonomic Systems, 1972). The run begins beside it, and wobbles about it.
"""

import math

import mbd

m, R, g = 1.0, 0.5, 9.81  # kg, m, m/s²
model = mbd.Model("rolling coin", gravity=(0.0, -g, 0.0))
coin = mbd.RigidBody("coin", m, (m * R**2 / 4, m * R**2 / 4, m * R**2 / 2))
model.connect(mbd.Free("float", model.ground.origin, coin.origin))
model.constrain(mbd.Bilateral("edge", mbd.disk_touchdown(coin.origin, R, axis=(0, 0, 1))))
model.constrain(mbd.Rolling("grip", coin.origin, R, axis=(0, 0, 1)))


def rolling(lean, turn, spin, fall=0.0):
    """Along x, leaning to the side of z, which falls outwards at a rate [rad, rad/s]."""
    rates = (fall, turn * math.cos(lean), spin - turn * math.sin(lean))
    place = {"float.orientation": ((1, 0, 0), lean), "float.x": 0.0, "float.z": 0.0}
    return mbd.assemble(model, place, {"float.angular_velocity": rates})


lean, turn = 0.3, 1.2  # rad, rad/s
spin = math.sin(lean) * (5 * R * turn**2 * math.cos(lean) + 4 * g) / (6 * R * turn * math.cos(lean))
start, integrator, dt, until = rolling(lean, turn, spin, fall=0.2), mbd.RungeKutta853(), 5e-3, 2 * math.pi / turn
