"""Contacts without a load: what nothing presses slides on at its speed, and no round-off opens it."""

import random

import numpy as np
import pytest

import mbd

SCHEMES = [mbd.RungeKutta853(), mbd.RadauIIA(), mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8)]


def glider(seed: int) -> tuple[mbd.Model, mbd.State]:
    """A body, here two that are welded, each with absolute coordinates; weightless, it strikes a straight slope."""
    rng = random.Random(seed)
    slope = rng.choice([0.1, 0.3, 0.6, -0.2])
    model = mbd.Model("glider", gravity=(0.0, 0.0, 0.0), cut="all")
    shift, arm = np.array([rng.uniform(-0.1, 0.1), rng.uniform(-0.05, 0.05), 0.0]), np.array([0.1, 0.0, 0.0])
    first, second = rng.uniform(0.2, 1.0), rng.uniform(0.2, 2.0)
    body = mbd.RigidBody("body", first, 0.05, center=tuple(shift * second / (first + second)))
    other = mbd.RigidBody("other", second, 0.05, center=tuple(-shift * first / (first + second) - arm))
    model.connect(
        mbd.Planar("place", model.ground.origin, body.origin), mbd.Weld("weld", body.point(*arm), other.origin)
    )
    foot = mbd.touchdown(other.point(*-arm), lambda x: slope * x)  # at the common mass center: it does not turn
    model.constrain(mbd.Unilateral("foot", foot, friction=rng.choice([0.0, 0.3])))
    pose = {"place.x": 1.0, "place.y": slope + rng.uniform(0.05, 0.2), "place.angle": 0.0}
    return model, mbd.assemble(model, pose, {"place.x": 1.0, "place.y": -rng.uniform(0.5, 1.5), "place.angle": 0.0})


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_what_nothing_presses_slides_on(scheme):
    """After its one impact the body keeps its velocity, along the slope."""
    compared = 0
    for seed in range(16):
        run = mbd.simulate(*glider(seed), scheme, dt=5e-3, until=0.6)
        struck = run.events[0]
        assert [event.name for event in run.events if event.kind == "closed"] == ["foot"], seed
        for name in ("place.x.rate", "place.y.rate"):
            np.testing.assert_allclose(run[name][struck.row :], run[name][struck.row], atol=1e-9)
        compared += len(run) - struck.row
    assert compared > 1000
