"""Lengths in other units: a start that is accepted is closed in the mechanism's own lengths."""

import random
from dataclasses import replace

import numpy as np
import pytest

import mbd


def linkage(number: int, m: float) -> tuple[mbd.Model, str]:
    """A chain of links whose end a hinge or a slider holds, some joints cut, in units of which a metre has `m`."""
    rng = random.Random(f"units {number}")
    model = mbd.Model("linkage", gravity=(0.0, -9.81 * m, 0.0))
    frame = model.ground.origin
    for k in range(rng.randint(2, 3)):
        size, mass = rng.uniform(0.5, 1.0), rng.uniform(0.5, 2.0)
        link = mbd.Link(f"link {k}", mass, size * m, 0.5 * size * m, mass * size**2 / 12.0 * m**2)
        model.connect(mbd.Revolute(f"pin {k}", frame, link.start))
        frame = link.end
    if rng.random() < 0.5:
        model.connect(mbd.Revolute("closer", model.ground.point(rng.uniform(0.6, 1.0) * m, 0.1 * m), frame))
    else:
        slider = mbd.PointMass("slider", rng.uniform(0.5, 2.0))
        rail = mbd.Prismatic("rail", model.ground.point(0.0, rng.uniform(-0.2, 0.2) * m), slider.origin)
        model.connect(rail, mbd.Revolute("closer", slider.origin, frame))
    names = [joint.name for joint in model.joints]
    model.cut = rng.choice(["auto", "all", (rng.choice(names),), tuple(rng.sample(names, 2))])
    return model, rng.choice(["pin 0.angle", "pin 1.angle", "closer.angle"])


def accepted(number: int, m: float) -> mbd.State | None:
    """The start with an angle and a rate named; None where it is refused."""
    model, name = linkage(number, m)
    try:
        return mbd.assemble(model, {name: 0.3}, {name: 1.0})
    except mbd.AssemblyError:
        return None


@pytest.mark.filterwarnings("ignore:.*lengths are in metres")
@pytest.mark.parametrize("number", [*range(6), *(pytest.param(k, marks=pytest.mark.slow) for k in range(6, 20))])
def test_a_start_in_small_lengths_that_is_accepted_is_closed_in_these_lengths(number: int) -> None:
    here = linkage(number, 1.0)[0]
    for m in (1e-8, 1e-9, 1e-10):
        far = accepted(number, m)
        if far is None:
            continue
        q, v = (np.where(["angle" in name for name in far.names], values, values / m) for values in (far.q, far.v))
        start = mbd.project(here, replace(far, q=q, v=v))
        np.testing.assert_allclose(start.q, q, atol=1e-5)
        np.testing.assert_allclose(start.v, v, atol=1e-5 * (1.0 + float(np.max(np.abs(v)))))
