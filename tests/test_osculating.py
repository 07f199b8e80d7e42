"""Polynomials through the rows around, with the derivatives that rows hold."""

import numpy as np
import pytest

from mbd.results.interpolation import Grid
from mbd.results.osculating import osculating


def read(time, known, instants):
    return osculating(time, Grid(time).places(instants), known)


def test_a_polynomial_of_degree_8_is_met_with_its_derivatives():
    random = np.random.default_rng(3)
    time = np.cumsum(random.uniform(0.3, 0.9, 9))
    instants = np.linspace(time[0], time[-1], 101)
    shape = np.polynomial.Polynomial(random.standard_normal(9), domain=[time[0], time[-1]])
    parts = [shape.deriv(k) if k else shape for k in range(3)]
    found = read(time, [part(time)[:, None] for part in parts], instants)
    for value, part in zip(found.values, parts, strict=True):
        np.testing.assert_allclose(value[:, 0], part(instants), rtol=0, atol=1e-10 * np.max(np.abs(part(time))))


@pytest.mark.parametrize(("derivatives", "order"), [(3, 9), (2, 6)])
def test_the_error_of_an_oscillation_falls_with_its_order(derivatives, order):
    instants = np.linspace(0.0, 6.0, 601)
    errors = []
    for rows in (13, 25):
        time = np.linspace(0.0, 6.0, rows)
        known = [np.sin(time)[:, None], np.cos(time)[:, None], -np.sin(time)[:, None]][:derivatives]
        found = read(time, known, instants)
        errors.append(np.max(np.abs(found.values[0][:, 0] - np.sin(instants))))
        assert errors[-1] < 20.0 * np.max(found.doubt)
    assert np.log2(errors[0] / errors[1]) > order - 0.3


def test_rows_beyond_a_kink_do_not_count():
    """x = t² before t = 1 and 2 t − 1 + 5 (t − 1)² after it: within the intervals both parabolas are met."""
    time = np.linspace(0.0, 2.0, 11)
    before, after = (time, time**2, 2.0 * time, 2.0 + 0.0 * time), 5.0
    late = time > 1.0 + 1e-9
    value = before[1] + np.where(late, after * (time - 1.0) ** 2, 0.0)
    rate = before[2] + np.where(late, 2.0 * after * (time - 1.0), 0.0)
    change = before[3] + np.where(late, 2.0 * after, 0.0)
    instants = np.linspace(0.0, 0.79, 60)  # the row at the kink has the change of its left side
    found = read(time, [value[:, None], rate[:, None], change[:, None]], instants)
    np.testing.assert_allclose(found.values[0][:, 0], instants**2, rtol=0, atol=1e-12)


def test_nothing_is_read_across_a_switch():
    time = np.array([0.0, 0.5, 1.0, 1.0, 1.5, 2.0])
    side = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    found = read(time, [side[:, None], 0.0 * side[:, None], 0.0 * side[:, None]], np.array([0.2, 0.9, 1.1, 1.9]))
    np.testing.assert_array_equal(found.values[0][:, 0], [0.0, 0.0, 1.0, 1.0])


def test_rows_without_columns_or_steps_give_nothing():
    empty = read(np.array([0.0, 1.0]), [np.zeros((2, 0))] * 2, np.array([0.5]))
    assert empty.values[0].shape == (1, 0)
    single = read(np.array([1.0]), [np.ones((1, 2))] * 3, np.array([1.0]))
    np.testing.assert_array_equal(single.values[0], [[1.0, 1.0]])
