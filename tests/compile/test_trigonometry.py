"""Sines and cosines in vector registers are as good as those of a C library."""

import math

import mpmath
import numpy as np
import pytest

from mbd.compile.host import host
from mbd.compile.ir import Module
from mbd.compile.layout import Layout
from mbd.compile.llvm import Machine, call, emit_object
from mbd.tape.functions import cos, sin
from mbd.tape.node import Tape
from mbd.trees.trigonometry import HALF_PI, LIMIT, WIDTHS

mp = mpmath.MPContext()
mp.prec = 240

WORST = 0.78
"""Units in the last place; measured 0.76."""


def sines_and_cosines(width, fused):
    """A function of `width` angles in the places of q."""
    tape = Tape()
    angles = [tape.input("q", k) for k in range(width)]
    layout = Layout(width, width, 0, 0, 0, 0, 0)
    text = Module({"f": [f(angle) for angle in angles for f in (sin, cos)]}, layout, fused).text()
    machine = Machine()
    run = call(machine.load(emit_object(text, 1), ["mbd.f"])[0])

    def function(values):
        block, out = np.zeros(layout.size), np.empty(2 * width)
        block[3 : 3 + width] = values
        run(block, np.zeros(0), out)
        return out.reshape(width, 2)

    function.machine = machine
    return function


def error(x, results):
    """The larger error of sine and cosine, in units in the last place."""
    exact = mp.sin(mp.mpf(x)), mp.cos(mp.mpf(x))
    return max(abs(float((mp.mpf(y) - e) / mp.mpf(math.ulp(float(e))))) for y, e in zip(results, exact, strict=True))


RNG = np.random.default_rng(20)
MULTIPLES = [float(mp.pi * k / 4) for k in (*range(-60, 61), *RNG.integers(-1_300_000, 1_300_000, 200).tolist())]
ANGLES = np.array(
    [
        *RNG.uniform(-1.0, 1.0, 600), *RNG.uniform(-7.0, 7.0, 600), *RNG.uniform(-LIMIT, LIMIT, 600), *MULTIPLES,
        *np.nextafter(MULTIPLES, np.inf), *np.nextafter(MULTIPLES, -np.inf), *(10.0 ** RNG.uniform(-320, -1, 100)),
    ]
)  # fmt: skip


@pytest.mark.parametrize("fused", sorted({False, host().fused}))
def test_the_error_stays_below_a_unit_in_the_last_place(fused):
    function = sines_and_cosines(4, fused)
    angles = ANGLES[: len(ANGLES) // 4 * 4].reshape(-1, 4)
    assert max(error(x, pair) for row in angles for x, pair in zip(row, function(row), strict=True)) < WORST


@pytest.mark.parametrize("fused", sorted({False, host().fused}))
def test_an_angle_has_the_same_bits_in_every_width_and_lane(fused):
    functions = {width: sines_and_cosines(width, fused) for width in (*WIDTHS, 3, 7)}
    for x in (*ANGLES[::40], 1e7, math.nan, math.inf, -0.0):
        alone = functions[1]([x])[0]
        for width, function in functions.items():
            for lane in range(width):
                values = RNG.uniform(-3.0, 3.0, width)
                values[lane] = x
                assert np.array_equal(function(values)[lane], alone, equal_nan=True)


def test_a_far_angle_is_left_to_the_library_and_disturbs_no_other():
    function = sines_and_cosines(4, host().fused)
    near = function([0.5, -1.0, 2.0, 3.0])
    mixed = function([0.5, 1e9, math.nan, 3.0])
    assert np.array_equal(near[[0, 3]], mixed[[0, 3]])
    assert mixed[1] == pytest.approx([math.sin(1e9), math.cos(1e9)], abs=0.0, rel=2.3e-16)
    assert np.isnan(mixed[2]).all()
    assert np.isnan(function([math.inf] * 4)).all()
    assert error(LIMIT, function([LIMIT] * 4)[2]) < WORST


def test_the_sine_of_negative_zero_is_negative_zero():
    sine, cosine = sines_and_cosines(1, host().fused)([-0.0])[0]
    assert (math.copysign(1.0, sine), cosine) == (-1.0, 1.0)


def test_half_pi_is_split_so_that_products_are_exact():
    for part in HALF_PI[:2]:
        assert int(math.frexp(part)[0] * 2**53) % 2**20 == 0
    assert abs(sum(map(mp.mpf, HALF_PI)) - mp.pi / 2) < mp.mpf(2) ** -119
