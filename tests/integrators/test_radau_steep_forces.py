"""Forces that are steep within a step: friction on stiff mats that slides at one stage and holds at another."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd


def spinning(seed: int, box: bool) -> tuple[mbd.Model, mbd.State, dict[str, float]]:
    """A ball or a box that falls onto a mat, spinning and sliding; its mass, radius and μ."""
    rng = np.random.default_rng(seed)
    mass, radius, mu = rng.uniform(0.1, 10.0), rng.uniform(0.03, 0.3), rng.uniform(0.1, 1.0)
    stiffness = 10.0 ** rng.uniform(3.0, 7.0)
    damping = 2.0 * np.sqrt(stiffness * mass) * rng.uniform(0.0, 1.0)
    how = {"friction": mu, "creep": 10.0 ** rng.uniform(-4.0, -2.0)}
    model, sides = mbd.Model("spinning"), rng.uniform(0.05, 0.3, 3)
    inertia = mass / 12.0 * (sides @ sides - sides**2) if box else np.full(3, 0.4 * mass * radius**2)
    body = mbd.RigidBody("body", mass, tuple(inertia))
    model.connect(mbd.Free("free", model.ground.origin, body.origin))
    points = [body.point(*(0.5 * sides * signs)) for signs in itertools.product((-1, 1), repeat=3)]
    for k, measure in enumerate(map(mbd.touchdown, points) if box else [mbd.sphere_touchdown(body.origin, radius)]):
        share = 0.25 if box else 1.0
        model.constrain(mbd.Penalty(f"mat {k}", measure, share * stiffness, damping=share * damping, **how))
    height = rng.uniform(0.6, 1.0) * np.linalg.norm(sides) if box else radius + rng.uniform(0.0, 0.1)
    spin, speed = rng.normal(size=3) * 10.0 ** rng.uniform(0.0, 2.0), rng.normal(size=2)
    rates = {f"free.angular_velocity.{axis}": float(w) for axis, w in zip("xyz", spin, strict=True)}
    start = mbd.assemble(model, {"free.y": height}, {"free.x": speed[0], "free.z": speed[1]} | rates)
    return model, start, {"mass": mass, "radius": radius, "mu": mu, "spin": float(np.linalg.norm(spin))}


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6), box=st.booleans(), dt=st.floats(1e-3, 1e-2))
def test_what_spins_on_a_stiff_mat_comes_to_the_end_of_its_run(seed, box, dt):
    """With one pair of matrices for all stages every sixth run ended as friction began to hold."""
    model, start, given = spinning(seed, box)
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=dt, until=0.5, progress=False)
    if not box and given["spin"] * dt < 0.5:  # friction at a point keeps the moment of momentum about it
        spin, arm = (run[f"free.angular_velocity.ground.{axis}"] for axis in "zx"), 2.5 / given["radius"]
        speeds = arm * run["free.x.rate"], -arm * run["free.z.rate"]
        for kept in [w - v for w, v in zip(spin, speeds, strict=True)]:
            assert np.ptp(kept) < 1e-4 * given["spin"]


@pytest.mark.parametrize(("seed", "box", "dt"), [
    (12, False, 5e-3), (73, False, 5e-3), (90, False, 5e-3), (115, False, 1e-3), (189, False, 2.3e-3),
    (71, True, 1e-3), (189, True, 5e-3), (196, True, 3e-3), (240, True, 5e-3),
])  # fmt: skip
def test_corrections_of_steep_forces_are_shortened_as_far_as_their_residual_asks(seed, box, dt):
    """A part of a correction must reduce the residual by a share of that part: by a tenth it never did."""
    model, start, _ = spinning(seed, box)
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=dt, until=0.5, progress=False)
    assert run.stats["shortened"] < 5


@pytest.mark.parametrize(
    ("seed", "dt"), [(16, 2.3e-3), (25, 5e-3), (38, 1e-3), (53, 1e-3), (59, 1e-2), (64, 2.3e-3), (73, 5e-3)]
)
def test_residuals_that_fall_slowly_are_no_round_off(seed, dt):
    """HHT said 'stagnated' of corrections that were still shortened."""
    model, start, _ = spinning(seed, False)
    assert mbd.simulate(model, start, mbd.HHT(0.05), dt=dt, until=0.5, progress=False).success


@pytest.mark.parametrize(("seed", "dt"), [(12, 5e-3), (20, 5e-3), (90, 5e-3)])
def test_derivatives_follow_steps_in_which_friction_begins_to_hold(seed, dt):
    """Corrections by one pair of matrices grew, which passed for round-off: up to 1e54 in place of 0.05."""
    model, start, given = spinning(seed, False)
    found = mbd.sensitivities(model, start, mbd.RadauIIA(), dt=dt, until=0.4, wrt=["mat 0.mu"])
    ends = [
        mbd.simulate(model, start, mbd.RadauIIA(), dt=dt, until=0.4, parameters={"mat 0.mu": given["mu"] + change})
        for change in (1e-5, -1e-5)
    ]
    for name in ("free.x", "free.z"):
        expected = (ends[0][name][-1] - ends[1][name][-1]) / 2e-5
        assert found[name, "mat 0.mu"] == pytest.approx(expected, rel=1e-4, abs=1e-6)
