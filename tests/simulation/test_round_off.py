"""A step that stagnates at round-off says what is left and what is attainable."""

from __future__ import annotations

import re

import mbd
from mbd.hardcases.mass_ratios import heavy_below_light


def test_a_stagnated_step_tells_its_residual_and_what_round_off_allows() -> None:
    """Accelerations of 1e10 m/s² that hang on the last digit of an angle: a residual of 1e-9 cannot be met."""
    model, start = heavy_below_light()
    run = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.8), dt=1e-3, until=1.0, on_failure="return")
    found = re.search(r"stagnated at round-off: residual (\S+), attainable (\S+) of the forces", run.message)
    assert found is not None, run.message
    residual, attainable = map(float, found.groups())
    assert 1e-10 < attainable < 1e-7
    assert 0.01 * attainable < residual < 100.0 * attainable
