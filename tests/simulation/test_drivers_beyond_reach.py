"""Drivers that ask for positions which do not exist: no row is stored there, and the failure names them."""

from functools import cache
from typing import Any

import numpy as np
import pytest

import mbd

SCHEMES = [
    mbd.Newmark(), mbd.HHT(0.05), mbd.GeneralizedAlpha(0.6), mbd.HHT(0.1, formulation="index3"), mbd.RadauIIA(),
    mbd.RungeKutta853(),
]  # fmt: skip


@cache
def pulled(upper: float, lower: float, from_length: float, speed: float, cut: str) -> Any:
    """Two rods on the ground whose end a winch pulls away; when the rods are straight."""
    model = mbd.Model("arm", cut=cut)
    first = mbd.Link("upper", 1.0, upper, upper / 2, 0.1)
    second = mbd.Link("lower", 0.7, lower, lower / 2, 0.05)
    model.connect(
        mbd.Revolute("shoulder", model.ground.origin, first.start), mbd.Revolute("elbow", first.end, second.start)
    )
    reach = mbd.distance(model.ground.origin, second.end)
    model.constrain(mbd.Bilateral("winch", reach, value=lambda t: from_length + speed * t))
    return model, (upper + lower - from_length) / speed


@pytest.mark.covering
@pytest.mark.parametrize("cut", ["auto", "all"])
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_a_driver_beyond_reach_is_named_and_no_row_leaves_its_constraints(scheme: Any, cut: str) -> None:
    rng = np.random.default_rng(8)
    for dt in (1e-2, 1e-3):
        upper, lower = rng.uniform(0.5, 1.2, 2)
        model, straight = pulled(upper, lower, 0.85 * (upper + lower), float(rng.uniform(0.3, 1.0)), cut)
        start = mbd.assemble(model, project=True)
        run = mbd.simulate(model, start, scheme, dt=dt, until=2.0 * straight, on_failure="return")
        assert not run.success and run.time[-1] < straight + 1e-6, run.message
        assert run.time[-1] > straight - 4.0 * dt, run.message
        assert max(run.violation.length, run.violation.angle) < 1e-8, (run.violation, run.message)
        assert "constraints cannot be satisfied" in run.message and "'winch'" in run.message, run.message


@pytest.mark.slow
def test_long_steps_of_collocation_store_no_row_beyond_the_reach() -> None:
    """Newton's method ends with small corrections there, some microns off the constraints; the rows are asked again."""
    rng = np.random.default_rng(4)
    for cut in ("auto", "all"):
        upper, lower = rng.uniform(0.4, 1.2, 2)
        model, straight = pulled(upper, lower, 0.95 * (upper + lower), float(rng.uniform(0.3, 1.5)), cut)
        start = mbd.assemble(model, project=True)
        for dt in straight / rng.uniform(2.0, 15.0, 6):
            run = mbd.simulate(model, start, mbd.RadauIIA(), dt=dt, until=2.0 * straight, on_failure="return")
            assert not run.success and "'winch'" in run.message, run.message
            assert max(run.violation.length, run.violation.angle) < 1e-7, (dt, run.violation, run.message)


def test_a_driver_within_reach_is_not_blamed() -> None:
    """Another cause of failure stays what it is."""
    model, _ = pulled.__wrapped__(1.0, 0.7, 1.2, 0.1, "auto")  # one of its own, which is added to
    shoulder = next(joint for joint in model.joints if joint.name == "shoulder")
    model.apply(mbd.Motor("broken", shoulder, torque=lambda t: 1.0 / mbd.where(t < 0.095, 1.0, 0.0)))
    run = mbd.simulate(model, mbd.assemble(model, project=True), mbd.HHT(), dt=1e-2, until=1.0, on_failure="return")
    assert "'broken'" in run.message and "cannot be satisfied" not in run.message
