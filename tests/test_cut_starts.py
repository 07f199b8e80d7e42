"""What a start does not name is the same whatever joints are cut."""

import random

import numpy as np
import pytest

import mbd
from mbd.testing.mechanisms import random_tree


def driven(seed, spatial, cut):
    """A random tree whose first joint is driven, with a row between a far body and the ground on every other seed."""
    rng = random.Random(seed)
    model = random_tree(seed, bodies=4, spatial=spatial, most=7)
    model.cut = cut if isinstance(cut, str) else tuple(model.joints[k].name for k in cut if k < len(model.joints))
    first, last = model.joints[0], [body for body in model.bodies.values() if body is not model.ground][-1]
    rate = rng.uniform(0.5, 1.0)
    where = first.coordinate_names[0]
    model.constrain(mbd.Bilateral("drive", mbd.measure(where), value=lambda t: 0.2 + rate * mbd.sin(t)))
    if seed % 2:
        model.constrain(mbd.Nonholonomic("belt", lambda v: v - 0.3, arguments=[f"{last.name}.center.vx"]))
    return model


def places(model, start):
    return np.array(
        [
            [start[f"{name}.center.{part}"] for part in ("x", "y", "z", "vx", "vy", "vz")]
            for name in list(model.bodies)[1:]
        ]
    )


@pytest.mark.parametrize("spatial", [False, True])
@pytest.mark.parametrize("seeds", [range(2), pytest.param(range(2, 8), marks=pytest.mark.slow)])
def test_what_is_not_named_starts_alike_whatever_joints_are_cut(spatial, seeds):
    compared = 0
    for seed in seeds:
        model = driven(seed, spatial, "auto")
        free = model.joints[-1].coordinate_names
        named = {free[0]: 0.3} if len(model.joints) > 1 and model.joints[-1].is_vector else {}
        expected = places(model, mbd.assemble(model, named, backend="python"))
        for cut in ("all", (0, 2), (1,)):
            other = driven(seed, spatial, cut)
            found = places(other, mbd.assemble(other, named, backend="python"))
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-8, err_msg=f"{seed} {cut}")
            compared += found.size
    assert compared > 60 * len(seeds)


def test_a_loss_that_needs_a_reaction_leaves_the_start_as_it_is():
    rates = []
    for loss in (None, mbd.Viscous(0.01), mbd.PinFriction(0.2, radius=0.01)):
        model = mbd.Model("arm")
        upper, lower = (mbd.Link(name, mass=1.0, length=0.4, center=0.2, inertia=0.02) for name in ("upper", "lower"))
        shoulder = mbd.Revolute("shoulder", model.ground.origin, upper.start)
        model.connect(shoulder, mbd.Revolute("elbow", upper.end, lower.start, loss=loss))
        model.constrain(mbd.Bilateral("drive", mbd.measure("shoulder.angle"), value=lambda t: 0.3 + mbd.sin(3.0 * t)))
        start = mbd.assemble(model, backend="python")
        rates.append([start["elbow.angle"], start["elbow.rate"], start["shoulder.angle"], start["shoulder.rate"]])
    np.testing.assert_allclose(rates, [[0.0, 0.0, 0.3, 3.0]] * 3, rtol=0.0, atol=1e-12)
