"""Mechanisms whose small motions are looked at: pendulums, a four-bar, a slider."""

import numpy as np

import mbd

PLAIN = "python"
"""The backend here: models are looked at once."""


def pendulums(masses, lengths, cut="auto", loss=None, names=("first", "second", "third")):
    """Point masses on rods without mass, one below the other."""
    model, frame = mbd.Model("pendulums", cut=cut), None
    frame = model.ground.origin
    for name, mass, length in zip(names, masses, lengths, strict=False):
        rod = mbd.Link(name, mass=mass, length=length, center=length)
        model.connect(mbd.Revolute(f"{name} pin", frame, rod.start, loss=loss))
        frame = rod.end
    return model


def four_bar(cut="auto", order=(0, 1, 2, 3), loss=None):
    """A crank, a coupler with a spring and a rocker, none alike."""
    model = mbd.Model("four-bar", cut=cut)
    crank, coupler, rocker = (
        mbd.Link(name, mass=mass, length=length, center=0.4 * length, inertia=0.1 * mass)
        for name, mass, length in (("crank", 1.0, 0.6), ("coupler", 0.7, 1.1), ("rocker", 1.3, 0.9))
    )
    far = model.ground.point(1.2, 0.1, name="far")
    joints = [
        mbd.Revolute("a", model.ground.origin, crank.start, loss=loss),
        mbd.Revolute("b", crank.end, coupler.start, stiffness=2.0),
        mbd.Revolute("c", coupler.end, rocker.end),
        mbd.Revolute("d", far, rocker.start, loss=mbd.Viscous(0.05)),
    ]
    model.connect(*(joints[k] for k in order))
    model.apply(mbd.Spring("spring", model.ground.point(0.3, -1.5, name="low"), coupler.center, 30.0, 0.4))
    return model


def at_rest(model, state):
    """An equilibrium, by Newton's method on the independent coordinates."""
    for _ in range(12):
        found = mbd.linearize(model, state, backend=PLAIN)
        count = len(found.states) // 2
        change = np.linalg.solve(found.A[count:, :count], -found.drift[list(found.picked)][count:])
        places = {name: state[name] + step for name, step in zip(found.states[:count], change, strict=True)}
        guess = {name: state[name] for name in state.names} | places
        state = mbd.assemble(model, position=guess, project=True, backend=PLAIN)
        if np.max(np.abs(change)) < 1e-8:
            return state
    raise AssertionError("no equilibrium")


def moving(cut="auto"):
    """A four-bar somewhere in its motion."""
    model = four_bar(cut, loss=mbd.Quadratic(0.3))
    return model, mbd.assemble(model, position={"a.angle": 0.4}, velocity={"a.angle": 1.7})


def on_spring(loss=None, stiffness=40.0):
    model = mbd.Model("slider", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("body", 2.0)
    model.connect(mbd.Prismatic("rail", model.ground.origin, body.origin, loss=loss, stiffness=stiffness))
    return model
