"""A run that fails before its first step ends has its start as its first row, whatever the scheme."""

import numpy as np
import pytest

import mbd

SCHEMES = [mbd.HHT(), mbd.GeneralizedAlpha(0.8), mbd.Newmark(), mbd.RadauIIA(), mbd.RungeKutta853()]
MANNERS = [{"dt": 1e-3}, {"dt": 1e-3, "contact": "nonsmooth"}, {"tol": 1e-4}]


def refusing(friction: float | None = 0.5) -> mbd.Model:
    """A block on a rough floor, pushed by a controller that raises at its first call."""

    def law(t, read, memory):
        raise ValueError("no signal")

    model = mbd.Model("block")
    mass = mbd.PointMass("mass", mass=2.0)
    model.connect(mbd.Translation("place", model.ground.origin, mass.origin, axes="xy"))
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(mass.origin), friction=friction))
    model.apply(mbd.Applied("push", mass.origin, force=(3.0, 0.5)))
    model.apply(mbd.Controller("law", law, period=0.1, writes=["push.force.x"]))
    return model


@pytest.mark.covering
@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda scheme: type(scheme).__name__)
@pytest.mark.parametrize("manner", MANNERS, ids=["events", "nonsmooth", "tol"])
def test_the_start_is_the_first_row(scheme, manner, tmp_path):
    model = refusing()
    start = mbd.assemble(model, closed=["floor"], velocity={"place.x.rate": 1.0})
    run = mbd.simulate(model, start, scheme, until=0.3, on_failure="return", backend="python", **manner)
    assert not run.success and "no signal" in run.message
    assert len(run) == 1 and run.time[0] == run.final.time == 0.0
    np.testing.assert_array_equal(run.record.q[0], start.q)
    np.testing.assert_array_equal(run.record.v[0], start.v)
    assert run["floor.gap"][0] == 0.0 and run.at(0.0)["place.x.rate"] == 1.0
    assert mbd.load(run.save(tmp_path / "run")).to_dataframe().shape[0] == 1
    assert "failure" in repr(run)


def test_its_forces_are_those_of_the_balance_there_and_none_where_it_is_not_known_what_sticks():
    runs = []
    for friction in (None, 0.5):
        model = refusing(friction)
        start = mbd.assemble(model, closed=["floor"])
        runs.append(mbd.simulate(model, start, dt=1e-3, until=0.3, on_failure="return", backend="python"))
    np.testing.assert_allclose(runs[0]["floor.force"], 2.0 * 9.81 - 0.5, rtol=1e-12)
    assert np.isnan(runs[1]["floor.force"]).all()
