"""Parallelograms whose cranks lie flat, a singular configuration, and the one rod that they are on their branch."""

import functools

import numpy as np

import mbd
from tests.cases.linkages import four_bars, upright

T = 3.0
"""Length of most runs [s], in which cranks lie flat six times."""


def pendulum_like(count):
    """What `count` parallelograms are while cranks stay parallel: one rod with the sums of masses and inertias."""
    mass, static, inertia = 2.0 * count + 1.0, 0.5 * (count + 1) + count, (count + 1) / 3.0 + count
    model = mbd.Model("rod")
    center = static / mass
    body = mbd.Link("rod", mass=mass, length=1.0, center=center, inertia=inertia - mass * center**2)
    model.connect(mbd.Revolute("base 0", model.ground.origin, body.start))
    return model


@functools.cache
def wanted(count, angle=np.pi, speed=-3.0, until=T):
    model = pendulum_like(count)
    start = mbd.assemble(model, position={"base 0.angle": angle}, velocity={"base 0.angle": speed})
    return mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-3, until=until)


@functools.cache
def started(count):
    model = four_bars(count)
    return model, upright(model, count, speed=-3.0)


@functools.cache
def flat(count):
    """Instants at which cranks lie flat, from the single rod."""
    exact = wanted(count)
    times = np.linspace(0.0, T, 30001)
    halves = np.floor(exact.at(times)["base 0.angle"] / np.pi + 0.5)
    found = []
    for k in np.flatnonzero(np.diff(halves)):
        low, high = times[k], times[k + 1]
        for _ in range(50):
            middle = 0.5 * (low + high)
            same = np.floor(exact.at(middle)["base 0.angle"] / np.pi + 0.5) == halves[k]
            low, high = (middle, high) if same else (low, middle)
        found.append(0.5 * (low + high))
    return np.array(found)
