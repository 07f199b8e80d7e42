"""Runs whose rows would not fit into memory."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import mbd
from mbd.simulation import room
from tests.simulation.mechanisms import falling


def stiff():
    """A mass on a spring of 10⁹ N/m, which shakes 5000 times a second."""
    model, body = falling(mass=1.0)
    model.apply(mbd.Spring("spring", model.ground.origin, body.origin, stiffness=1e9, length=1.0))
    return model, mbd.assemble(model, {"fall.displacement": 1.001})


@pytest.mark.parametrize("how", [{"dt": 1e-6}, {"tol": 1e-9}], ids=str)
def test_a_run_that_fills_the_memory_is_foretold_and_ends_with_its_rows(how, monkeypatch):
    monkeypatch.setattr(room, "available", lambda: 4.0 * 8 * 5 * 150_000)  # 150 000 rows of 5 numbers are a quarter
    model, start = stiff()
    with (
        pytest.warns(UserWarning, match=r"at this rate the run will have about .* rows|which take .*will be ended"),
        pytest.raises(mbd.MemoryLimitError, match=r"a quarter of the free memory; the whole run needs about") as told,
    ):
        mbd.simulate(model, start, mbd.HHT(0.05), until=5.0, **how)
    found = told.value.run
    assert 100_000 < len(found) < 250_000 and 0.0 < found.time[-1] < 5.0 and not found.success
    assert np.all(np.isfinite(found["fall.displacement"]))
    assert any("at this rate" in note for note in found.stats["notes"])


def test_a_finer_trial_run_that_has_no_room_is_not_begun(monkeypatch):
    """The pilot fits; what it tells of the next run is enough to stop there, with the pilot's rows."""
    monkeypatch.setattr(room, "available", lambda: 4.0 * 8 * 5 * 2_000)
    model, start = stiff()
    with pytest.raises(mbd.MemoryLimitError, match=r"about .* steps would be needed, whose rows take") as told:
        mbd.simulate(model, start, mbd.HHT(0.05), tol=1e-6, until=1.5e-3)
    assert told.value.run.time[-1] == pytest.approx(1.5e-3)


def test_a_run_that_fits_says_nothing():
    model, start = stiff()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-6, until=0.2)
    assert len(found) == 200_001 and not any("at this rate" in note for note in found.stats["notes"])
    assert room.available() > 1e6 and room.memory(3.21e9) == "3.2 GB" and room.memory(4.5e7) == "45 MB"
