"""Whatever happens in a step, there is room for its lines in the event log and its rows in the store."""

import numpy as np
import pytest

import mbd
from mbd.kernel.stepping import advance
from mbd.simulation.run import stepper


def sliders(count: int) -> mbd.Model:
    """Equal masses on rails with dry friction, all driven alike: they stick and slip at the same instants."""
    model = mbd.Model("sliders")
    for i in range(count):
        body = mbd.PointMass(f"body {i}", mass=1.0)
        rail = mbd.Prismatic(f"slider {i}", model.ground.origin, body.origin, axis=(1, 0, 0), loss=mbd.Coulomb(1.0))
        model.connect(rail)
        model.apply(mbd.Motor(f"motor {i}", rail, lambda t: 3.0 * mbd.sin(200.0 * t)))
    return model


def run(model: mbd.Model, until: float, **options) -> mbd.Trajectory:
    return mbd.simulate(model, mbd.assemble(model), mbd.GeneralizedAlpha(0.9), dt=1e-3, until=until, **options)


def test_frictions_that_stick_and_slip_together_are_all_logged(monkeypatch):
    monkeypatch.setattr(stepper, "EVENT_CAPACITY", 1)  # twice what a step needs, and no more
    single, together = run(sliders(1), 0.3), run(sliders(20), 0.3)
    assert len(single.events) > 10
    assert len(together.events) == 20 * len(single.events)
    for i in range(20):
        np.testing.assert_allclose(together[f"slider {i}.displacement"][-1], single["slider 0.displacement"][-1], 1e-9)


def test_a_log_that_overflows_ends_the_run_and_is_never_written_beyond_its_end(monkeypatch):
    monkeypatch.setattr(stepper, "EVENT_CAPACITY", 30)
    for module in (stepper, advance):
        monkeypatch.setattr(module, "room_to_log", lambda K: 0)
    with pytest.raises(mbd.SimulationError, match="more rows or events came in one step than there was room for"):
        run(sliders(20), 0.05, backend="python")
