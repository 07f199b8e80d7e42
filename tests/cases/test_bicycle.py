"""Case l5: the bicycle of Meijaard et al. (2007), its eigenvalues over speed by linearizing rolling rows."""

import numpy as np
import pytest
from scipy.optimize import brentq

import mbd
from mbd.cli import Script
from tests.problems import case

L5 = case("l5-whipple-bicycle")
NAMES = Script.load("bicycle").names


def ordered(values):
    return np.array(sorted(values, key=lambda s: (round(s.real, 9), s.imag)))


@pytest.mark.parametrize("speed", [0, 2, 4, 5, 6, 8, 10])
def test_the_eigenvalues_of_a_bicycle_are_those_of_its_canonical_equations(speed):
    known = L5[f"eigenvalues of the upright linearised bicycle at v = {speed} m/s"].value
    wanted = ordered(np.array(known[0]) + 1j * np.array(known[1]))
    assert ordered(NAMES["motions"](float(speed))) == pytest.approx(wanted, abs=1e-9)


def test_weave_and_capsize_speed_are_the_published_ones():
    """Between them it rides by itself."""
    weave, capsize = L5["weave speed and capsize speed"].value

    def weaving(speed):
        found = NAMES["motions"](speed)
        return max(s.real for s in found if s.imag > 0.1)

    def falling(speed):
        return float(max(s.real for s in NAMES["motions"](speed) if abs(s.imag) < 0.1))

    assert brentq(weaving, 4.0, 4.6, xtol=1e-12) == pytest.approx(weave, abs=1e-9)
    assert brentq(falling, 5.8, 6.2, xtol=1e-12) == pytest.approx(capsize, abs=1e-9)


def test_six_motions_of_a_bicycle_are_indifferent():
    """Place and heading on the road, speed, and the angles of the wheels."""
    found = mbd.linearize(NAMES["model"], NAMES["riding"](4.0)).eigenvalues
    assert np.sum(np.abs(found) < 1e-6) == 6


def test_what_a_bicycle_does_after_a_push_is_what_its_eigenvalues_say():
    """At 5 m/s weave dies out at 0.775/s; of a small push capsize alone is left, exp(−0.3229 t)."""
    model, start = NAMES["model"], NAMES["riding"](5.0, lean_rate=1e-4)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-11, until=20.0)
    lean = run.at([16.0, 20.0])["ride.rotation_vector.x"]
    assert np.log(lean[1] / lean[0]) / 4.0 == pytest.approx(-0.32286642900409, abs=2e-3)
    assert np.ptp(run.energy.total) < 1e-8
