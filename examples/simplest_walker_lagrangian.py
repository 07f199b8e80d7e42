"""The simplest walker as its paper writes it: two angles, two energies, one event.

A point mass at the hip, point feet whose mass β goes to zero, straight legs; lengths over the leg, times over √(L/g).
θ is the angle of the stance leg from the normal of the slope γ, φ that of the swing leg from the stance leg. As the
swing foot comes down, φ = 2θ on its way up (it passes the ground at θ ≈ 0 too, where the paper lets it), the hip's
velocity turns by the impact and the legs change their names.

M. Garcia, A. Chatterjee, A. Ruina & M. Coleman, The simplest walking model, J. Biomech. Eng. 120 (1998) 281–288.
"""

from sympy import cos, sin, symbols

import mbd

theta, phi = mbd.Coordinate("theta"), mbd.Coordinate("phi")
gamma, beta = symbols("gamma beta")
foot_x, foot_y = sin(phi.q - theta.q) + sin(theta.q), cos(theta.q) - cos(phi.q - theta.q)  # against the stance foot
rates = {theta: theta.v, phi: phi.v}
speed_x, speed_y = (sum(place.diff(c.q) * v for c, v in rates.items()) for place in (foot_x, foot_y))
model = mbd.Lagrangian(
    "simplest walker",
    [theta, phi],
    kinetic=theta.v**2 / 2 + beta * (speed_x**2 + speed_y**2) / 2,
    potential=cos(theta.q - gamma) + beta * (foot_y * cos(gamma) + foot_x * sin(gamma)),
    parameters={gamma: 0.009, beta: 1e-9},
)
turn = cos(2 * theta.q)
legs = {theta.q: -theta.q, phi.q: -2 * theta.q, theta.v: turn * theta.v, phi.v: turn * (1 - turn) * theta.v}
model.constrain(mbd.Event("heel strike", phi.q - 2 * theta.q, direction=+1, reset=legs))

start = mbd.assemble(
    model,
    position={"theta": 0.20031090054424708, "phi": 0.40062180108849416},
    velocity={"theta": -0.19983247300495235, "phi": -0.01582299994830938},
)
integrator, dt, until = mbd.RungeKutta853(), 0.01, 20.0
