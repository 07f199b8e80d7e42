"""The double pendulum again, as a textbook writes it: kinetic and potential energy in sympy, no bodies.

T = ½ (m₁ + m₂) L₁² θ̇₁² + ½ m₂ L₂² θ̇₂² + m₂ L₁ L₂ θ̇₁ θ̇₂ cos(θ₁ − θ₂)
V = −(m₁ + m₂) g L₁ cos θ₁ − m₂ g L₂ cos θ₂

with both angles from the vertical. L. D. Landau & E. M. Lifshitz, Mechanics, section 5, problem 1. Lagrange's equations
follow from these two lines, and run under the same integrators as a mechanism made of bodies.
"""

import sympy

import mbd

upper, lower = mbd.Coordinate("upper"), mbd.Coordinate("lower")
m1, m2, L1, L2, g = sympy.symbols("m1 m2 L1 L2 g")
rotation = (m1 + m2) * L1**2 * upper.v**2 / 2 + m2 * L2**2 * lower.v**2 / 2
coupling = m2 * L1 * L2 * upper.v * lower.v * sympy.cos(upper.q - lower.q)
model = mbd.Lagrangian(
    "double pendulum",
    [upper, lower],
    kinetic=rotation + coupling,
    potential=-(m1 + m2) * g * L1 * sympy.cos(upper.q) - m2 * g * L2 * sympy.cos(lower.q),
    parameters={m1: 1.0, m2: 1.0, L1: 1.0, L2: 1.0, g: 9.81},
)

start = mbd.assemble(model, position={"upper": 2.0, "lower": 1.5})
integrator, dt, until = mbd.GeneralizedAlpha(rho_inf=0.9), 1e-3, 5.0
