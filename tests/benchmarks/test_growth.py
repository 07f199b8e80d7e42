"""How cost grows: the page says what was measured, and its scenes are mechanisms that run."""

import pytest

pytest.importorskip("benchmarks")

import mbd
from benchmarks.growth import SCENES, Growth, page, slope


@pytest.mark.parametrize("power", [1.0, 3.0])
def test_the_power_is_that_of_the_last_factor_of_four(power):
    grown = [Growth("", n, 1e-7 * n + (n > 4) * 1e-6 * n**power, 0.1, 1e-3, 1e-4) for n in (2, 4, 8, 64, 256)]
    assert slope([Growth("", n, 1e-6 * n**power, 0.1, 1e-3, 1e-4) for n in (2, 4, 8, 16)]) == pytest.approx(power)
    assert slope(grown) == pytest.approx(power, abs=0.1)


def test_the_page_has_a_line_for_each_number_of_bodies():
    name = next(iter(SCENES))
    text = page([Growth(name, n, 1e-6 * n, 0.1, 1e-3, 1e-4) for n in (2, 4)])
    assert "| 2 | 2 | 1 | 1 | 0.1 | 1 | 0.1 |" in text and "| 4 | 4 | 1 | 2 | 0.1 | 1 | 0.1 |" in text


@pytest.mark.parametrize("name", SCENES)
def test_scenes_of_any_size_run(name):
    scene = SCENES[name]
    for bodies in (1, 3):
        assert mbd.simulate(*scene.make(bodies), scene.scheme, dt=1e-3, until=2e-3, contact="events").success
