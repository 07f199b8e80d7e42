"""A pendulum swings a hundred thousand times: does its scheme keep the energy, and by how much is its period off?

No reference run reaches that far, and none is needed: the period and the energy of a point mass on a massless rod are
known exactly. ``mbd accuracy long-pendulum`` judges schemes by these `known` values.

The period is 4 K(k) √(L/g) with k = sin(θ₀/2), by the complete elliptic integral K and by Gauss's arithmetic-geometric
mean; a phase that runs uniformly in time is F(φ, k)/K(k), with sin(θ/2) = k sin φ (Landau & Lifshitz, Mechanics, §11).
"""

import numpy as np

import mbd

L, g, m, theta0 = 1.0, 9.81, 1.0, 1.0
count, steps = 100_000, 100
period = 213913.7600558689 / count

model = mbd.Model("long pendulum", gravity=(0.0, -g, 0.0))
rod = mbd.Link("rod", mass=m, length=L, center=L)
model.connect(mbd.Revolute("pivot", model.ground.origin, rod.start))
start = mbd.assemble(model, position={"pivot.angle": theta0})


def mean_period(run):
    """The time over the periods that it took, the last one counted in parts [s]."""
    from scipy.special import ellipk, ellipkinc

    sine, cosine = np.sin(run["pivot.angle"] / 2.0), run["pivot.angle.rate"] / (2.0 * np.sqrt(g / L))
    square = sine**2 + cosine**2  # k², of each instant by its energy
    phase = ellipkinc(np.arctan2(sine, cosine), square) / ellipk(square) / 4.0
    late = np.unwrap(phase - run.time / period, period=1.0)
    return run.time[-1] / (run.time[-1] / period + late[-1] - late[0])


def energy(run):
    """At every row, above that of the pendulum at rest [J]."""
    return run.energy.total + m * g * L


integrator, dt, until, store = mbd.Newmark(), period / steps, count * period, steps
known = {
    "period": mbd.Known(period, accuracy=1e-14, of=mean_period),
    "energy": mbd.Known(4.50963437943355, accuracy=1e-14, of=energy),
}
integrators = [mbd.Newmark(), mbd.HHT(alpha=0.05), mbd.RungeKutta853()]
dts = [period / steps for steps in (25, 50, 100)]
