"""Samples become piecewise cubics."""

import math

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from mbd.errors import ModelError
from mbd.tape.evaluate import evaluate
from mbd.tape.interpolation import linear, monotone
from mbd.tape.node import Tape

XS, YS = [-1.0, 0.0, 0.5, 2.0], [-3.0, 0.0, 0.5, 0.6]


def curve(pieces, points):
    tape = Tape()
    x = tape.input("q", 0)
    node = tape.lookup(tape.table("t", *pieces), x)
    return [evaluate([node], {x: point})[0] for point in points]


def test_linear_interpolation_is_numpys_and_stays_constant_outside():
    points = np.linspace(-3.0, 4.0, 57)
    assert np.allclose(curve(linear(XS, YS), points), np.interp(points, XS, YS), atol=1e-14)


def test_monotone_interpolation_is_scipys_and_goes_on_straight():
    inside = np.linspace(-1.0, 2.0, 57)
    assert np.allclose(curve(monotone(XS, YS), inside), PchipInterpolator(XS, YS)(inside), atol=1e-14)
    left, right = PchipInterpolator(XS, YS).derivative()([-1.0, 2.0])
    assert np.allclose(curve(monotone(XS, YS), [-5.0, 6.0]), [-3.0 - 4.0 * left, 0.6 + 4.0 * right], atol=1e-13)


@pytest.mark.parametrize("make", [linear, monotone])
@pytest.mark.parametrize("beyond", ["constant", "linear"])
def test_the_samples_are_met_and_the_curve_is_continuous(make, beyond):
    pieces = make(XS, YS, beyond)
    assert np.allclose(curve(pieces, XS), YS, atol=1e-14)
    for x in XS:
        before, after = curve(pieces, [x - 1e-9, x + 1e-9])
        assert abs(before - after) < 1e-7


@pytest.mark.parametrize(
    ("xs", "ys", "said"),
    [
        ([0.0, 1.0], [1.0], "2 abscissae and 1 ordinates"),
        ([0.0], [1.0], "at least two samples"),
        ([0.0, 0.0], [1.0, 2.0], "must increase, but number 0 is 0 and number 1 is 0"),
        ([1.0, 0.0], [1.0, 2.0], "sort them"),
        ([0.0, 1.0, 2.0], [1.0, math.nan, math.nan], "ordinate number 1 is nan and 1 more"),
        ([0.0, math.inf], [1.0, 2.0], "abscissa number 1 is inf"),
    ],
)
@pytest.mark.parametrize("make", [linear, monotone])
def test_impossible_samples_are_named(make, xs, ys, said):
    with pytest.raises(ModelError, match=f"ankle table: .*{said}"):
        make(xs, ys, what="ankle table")


def test_an_unknown_continuation_is_an_error():
    with pytest.raises(ModelError, match="use 'constant' or 'linear'"):
        linear(XS, YS, "periodic")


@pytest.mark.parametrize("through", [linear, monotone])
def test_samples_too_steep_for_numbers_are_refused(through):
    for x, y in ([0.0, 1e-300], [0.0, 1.0]), ([0.0, 1e-110], [0.0, 1.0]), ([0.0, 1.0], [-1.7e308, 1.7e308]):
        with pytest.raises(ModelError, match="from number 0 to number 1 the ordinate changes by .* too steep"):
            through(x, y)
    assert np.isfinite(through([0.0, 1e-300], [2.0, 2.0]).coefficients).all()
