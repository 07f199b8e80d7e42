"""A step that stagnates at round-off says what is left and what is attainable."""

import re
from typing import Any

import pytest

import mbd
from mbd.hardcases.tiny_steps import circle


@pytest.mark.parametrize("scheme", [mbd.HHT(tolerance=1e-17), mbd.RadauIIA(tolerance=1e-17)], ids=repr)
@pytest.mark.parametrize("dt", [1e-3, 1e-6])
def test_a_stagnated_step_tells_its_residual_and_what_round_off_allows(scheme: Any, dt: float) -> None:
    """No forces cancel to seventeen digits; of RadauIIA the residual is that of the worst stage, 0 at another one."""
    model, start = circle()
    run = mbd.simulate(model, start, scheme, dt=dt, until=1.0, on_failure="return")
    found = re.search(r"stagnated at round-off: residual (\S+), attainable (\S+) of the forces", run.message)
    assert found is not None, run.message
    residual, attainable = map(float, found.groups())
    assert 1e-17 < attainable < 1e-14
    assert 1e-17 < residual < 100.0 * attainable
