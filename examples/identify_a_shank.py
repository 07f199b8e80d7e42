"""Identify a prosthetic shank and its ankle from a filmed swing.

Shank and foot swing from a knee that is held; markers give both angles 100 times a second, with errors of 5 mrad. Least
squares with exact derivatives finds five unknowns and their standard errors: where the mass of the shank lies and how
far it spreads, the dampers of knee and ankle, the ankle's spring. The film is a simulation with noise.
"""

import numpy as np

import mbd

model = mbd.Model("shank and foot")
shank = mbd.Link("shank", mass=3.0, length=0.42, center=0.25, inertia=0.10)
foot = mbd.Link("foot", mass=0.85, length=0.12, center=0.06, inertia=0.00444)
ankle = mbd.Revolute("ankle", shank.end, foot.start, stiffness=2.5, rest=1.45, loss=mbd.Viscous(0.06))
model.connect(mbd.Revolute("knee", model.ground.origin, shank.start, loss=mbd.Viscous(0.2)), ankle)

start = mbd.assemble(model, position={"knee.angle": 1.0, "ankle.angle": 1.3})
integrator, dt, until = mbd.RungeKutta853(), 0.01, 2.0
truth = {
    "shank.center": 0.2067, "shank.inertia": 0.0619, "knee loss.coefficient": 0.12, "ankle spring.stiffness": 3.2,
    "ankle loss.coefficient": 0.035,
}  # fmt: skip
film = mbd.simulate(model, start, integrator, dt=dt, until=until, parameters=truth)
times, noise = np.arange(0.01, 2.0, 0.01), 0.005 * np.random.default_rng(7).standard_normal((2, 199))
seen = {name: film.at(times)[name] + errors for name, errors in zip(("knee.angle", "ankle.angle"), noise, strict=True)}

guess = {name: model.parameters[name] for name in truth}
sigma = {"knee.angle": 0.005, "ankle.angle": 0.005}
found = mbd.fit(model, start, {"time": times, **seen}, guess, integrator, dt, sigma=sigma)
print(found)
parameters = found.values
