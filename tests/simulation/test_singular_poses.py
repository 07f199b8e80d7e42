"""Poses in which constraint rows lose rank for an instant are stepped over on the branch continuous in velocity."""

from __future__ import annotations

import numpy as np
import pytest

import mbd


def four_bars(count):
    """`count` parallelograms side by side: cranks upright on one base, couplers of the same length (IFToMM A02)."""
    model = mbd.Model("four-bars")
    cranks = [mbd.Link(f"crank {k}", mass=1.0, length=1.0, center=0.5, inertia=1 / 12) for k in range(count + 1)]
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"base {k}", model.ground.point(float(k), 0.0, name=f"base {k}"), crank.start))
    for k in range(count):
        coupler = mbd.Link(f"coupler {k}", mass=1.0, length=1.0, center=0.5, inertia=1 / 12)
        model.connect(mbd.Revolute(f"left {k}", cranks[k].end, coupler.start))
        model.connect(mbd.Revolute(f"right {k}", coupler.end, cranks[k + 1].end))
    upright = {f"base {k}.angle": np.pi for k in range(count + 1)} | {
        f"left {k}.angle": -np.pi / 2 for k in range(count)
    }
    return model, mbd.assemble(model, position=upright, velocity={"base 0.angle": -1.0})


TEN_SECONDS = 31.750597186986102
"""Crank angle from upright of two parallelograms after 10 s and ten flat poses [rad] (case b2)."""
SCHEMES = [
    mbd.GeneralizedAlpha(0.9), mbd.HHT(0.05), mbd.GeneralizedAlpha(0.9, formulation="index3"),
    mbd.HHT(0.05, formulation="index3"),
]  # fmt: skip


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_ten_flat_poses_are_passed_on_the_parallelogram_branch_with_order_two(scheme):
    model, start = four_bars(2)
    errors = []
    for dt in (2e-3, 1e-3):
        run = mbd.simulate(model, start, scheme, dt=dt, until=10.0, store=20)
        errors.append(abs(np.pi - run["base 0.angle"][-1] - TEN_SECONDS))
        assert run.energy.drift < 2e-5
    assert errors[0] < 1e-5
    assert 2.8 < errors[0] / errors[1] < 4.4


@pytest.mark.parametrize("count", [1, 5])
def test_every_crank_stays_parallel(count):
    model, start = four_bars(count)
    run = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), dt=1e-3, until=6.0, store=20)
    for k in range(1, count + 1):
        assert np.max(np.abs(run[f"base {k}.angle"] - run["base 0.angle"])) < 1e-9


def test_a_motion_that_cannot_stay_on_its_branch_ends_with_an_error_instead_of_another_motion():
    model, start = four_bars(1)
    for dt in (2.5e-4, 3.7e-4, 1e-3, 3e-3):
        run = mbd.simulate(model, start, mbd.GeneralizedAlpha(1.0), dt=dt, until=5.0, on_failure="return", store=5)
        parallel = np.max(np.abs(run["base 1.angle"] - run["base 0.angle"]))
        assert parallel < 1e-6, (dt, run.message)
        assert run.success or "rank" in run.message or "tolerance" in run.message
