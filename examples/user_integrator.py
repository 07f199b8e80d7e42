"""An integrator of one's own, the implicit midpoint rule, drives a pendulum that bounces off a wall.

The rule asks for the balance M a + f = 0 half-way through the step, where v = v₀ + ½ dt a and q = q₀ + ½ dt v:

    v₁ = v₀ + dt a,    q₁ = q₀ + dt (v₀ + ½ dt a)

It is of second order and symplectic (E. Hairer, C. Lubich & G. Wanner, Geometric Numerical Integration). `start` and
`step` are all that moves it, `order` is its promise: events are located, impacts applied and the scheme restarted
around it. It serves mechanisms whose contacts do not stay closed; their rows would join the Newton matrix below. The
wall stands at the lowest point, so from hit to hit the speed falls by the restitution e and the energy by e².
"""

from dataclasses import dataclass, replace

import numpy as np

import mbd
from mbd.integrators import Integrator, Point, StepReport, StepResult


@dataclass(frozen=True)
class ImplicitMidpoint(Integrator):
    """The implicit midpoint rule; its memory is the last acceleration, from which Newton's method starts."""

    tolerance: float = 1e-12

    def order(self, system=None):
        return 2

    def start(self, system, state, mode, dt):
        return np.zeros(len(state.v))

    def step(self, system, state, dt, mode, memory):
        a, half = memory, 0.5 * dt
        for iteration in range(20):
            v = state.v + half * a
            middle = Point(state.time + half, state.q, half * v, v, a, np.zeros(0))
            terms = system.evaluate(middle, mode, tangent=(half, half * half))  # ∂v/∂a and ∂q/∂a
            change = np.linalg.solve(terms.S, -terms.r)
            a = a + change
            if np.max(np.abs(change)) < self.tolerance * (1.0 + np.max(np.abs(a))):
                after = replace(state, time=state.time + dt, q=state.q + dt * (state.v + half * a), v=state.v + dt * a)
                return StepResult(after, a, StepReport(True, iteration))
        return StepResult(state, memory, StepReport(False, 20, message="the midpoint rule did not converge"))


model = mbd.Model("pendulum at a wall")
rod = mbd.Link("rod", mass=1.0, length=0.5, center=0.5)
pin = mbd.Revolute("pin", model.ground.origin, rod.start)
model.connect(pin)
model.constrain(mbd.Unilateral("wall", mbd.extension(pin), restitution=0.8))

start = mbd.assemble(model, position={"pin.angle": 0.5})
integrator, dt, until = ImplicitMidpoint(), 2e-3, 4.0
