"""The graph: equal expressions are one node, and folding changes no value."""

import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given

from mbd.errors import TraceError
from mbd.tape.derivatives import substitute
from mbd.tape.evaluate import evaluate
from mbd.tape.functions import cos, sin, where
from mbd.tape.node import Tape
from tests.tape.counts import operations, total
from tests.tape.graphs import build, exact, programs


@given(programs)
def test_folding_changes_no_value(program):
    graph = build(program)
    for folded, value in zip(exact(graph.nodes, graph.point), graph.values, strict=True):
        assert abs(folded - value) <= 1e-30 * (1 + abs(value))


@given(programs)
def test_the_same_expressions_are_the_same_nodes(program):
    first = build(program)
    again = build(program, first.tape)
    assert all(a is b for a, b in zip(first.nodes, again.nodes, strict=True))


@given(programs)
def test_a_graph_moved_to_another_tape_keeps_its_values(program):
    graph = build(program)
    tape = Tape()
    moved = substitute(graph.nodes, {}, tape)
    point = {tape.input(*node.data): value for node, value in graph.point.items()}
    for one, other in zip(exact(moved, point), graph.values, strict=True):
        assert abs(one - other) <= 1e-30 * (1 + abs(other))


def test_zeros_ones_and_signs_leave_no_operation():
    tape = Tape()
    x, y = tape.input("q", 0), tape.input("q", 1)
    assert x * 0.0 is tape.zero
    assert x + 0.0 is x
    assert x * 1.0 is x
    assert x - x is tape.zero
    assert x / x is tape.one
    assert 0.0 / x is tape.zero
    assert tape.neg(-x) is x
    assert (-x) * (-y) is x * y
    assert -x - y is -(x + y)
    assert y - x is -(x - y)
    assert x + -3.0 is x - 3.0
    assert x - -3.0 is x + 3.0
    assert -3.0 - x is -(x + 3.0)
    assert -3.0 / x is -(3.0 / x)
    assert sin(-x) is -sin(x)
    assert cos(-x) is cos(x)
    assert abs(-x) is abs(x)
    assert (x * x) ** 0.5 is abs(x)
    assert where(x < y, -x, 0.0) is -where(x < y, x, 0.0)
    assert where(~(x < y), x, y) is where(x < y, y, x)
    assert 2.0 * (3.0 * x) is 6.0 * x
    assert x**3 is x * x * x
    assert x**0 is tape.one


def test_operations_are_recorded_once_and_in_one_order():
    tape = Tape()
    x, y = tape.input("q", 0), tape.input("q", 1)
    assert x + y is y + x
    assert x * y is y * x
    assert ((x < y) & (y < 1.0)) is ((y < 1.0) & (x < y))
    outputs = [x * y + sin(x * y), y * x]
    assert operations(outputs) == {"add": 1, "mul": 1, "sin": 1}
    assert total(outputs) == 3


def test_sums_are_never_reassociated():
    tape = Tape()
    x, y, z = (tape.input("q", k) for k in range(3))
    values = {x: 1e16, y: -1e16, z: 1.0}
    assert evaluate([(x + y) + z, x + (y + z)], values) == [1.0, 0.0]


def test_products_of_constants_that_would_underflow_are_left_to_run_time():
    tape = Tape()
    x = tape.input("q", 0)
    tiny = 1e-200 * (1e-200 * x)
    assert evaluate([tiny, x / 1e-310], {x: 1e300}) == [1e-200 * (1e-200 * 1e300), math.inf]
    assert evaluate([x / 1e-310], {x: 1e-310}) == [1.0]


@pytest.mark.parametrize("function", [lambda x: x == 1.0, lambda x: x != x * 2.0, lambda x: bool(x > 0), float, int])
def test_a_traced_value_has_no_number(function):
    with pytest.raises(TraceError):
        function(Tape().input("q", 0))


NUMBERS = [2, 2.0, True, np.int64(2), np.float32(2.0), np.bool_(True), np.array(2.0), Fraction(1, 2), Decimal(2), 2j]


@pytest.mark.parametrize("number", NUMBERS, ids=repr)
def test_a_traced_value_is_compared_with_no_number_of_any_kind(number):
    x = Tape().input("q", 0)
    for compared in (lambda: x == number, lambda: number == x, lambda: x != number, lambda: x in [number]):
        with pytest.raises(TraceError):
            compared()
    assert (x == x) is True and (x == None) is False  # noqa: E711


def test_an_exact_division_by_zero_is_an_error_but_not_in_a_branch_not_taken():
    tape = Tape()
    x, c = tape.input("q", 0), tape.input("p", 0)
    with pytest.raises(TraceError, match="exact zero"):
        x / 0.0
    guarded = where(c > 0.0, x / c, 7.0)
    assert substitute([guarded], {c: 0.0})[0].data == 7.0


def test_text_is_no_number():
    with pytest.raises(TraceError, match="'3'"):
        Tape().input("q", 0) + "3"


def test_values_of_two_tapes_do_not_mix():
    x, y = Tape().input("q", 0), Tape().input("q", 0)
    with pytest.raises(TraceError, match="two tapes"):
        x + y
    with pytest.raises(TraceError, match="another derivation"):
        Tape().lookup(Tape().table("t", [0.0], [[0.0] * 4]), 1.0)


def test_numpy_functions_and_arrays_of_traced_values_record_themselves():
    tape = Tape()
    x, y = tape.input("q", 0), tape.input("q", 1)
    assert np.sin(x) is sin(x)
    assert np.float64(2.0) * x is 2.0 * x
    assert np.maximum(x, 0.0) is tape.binary("max", x, 0.0)
    vector = np.array([x, y])
    assert (np.array([2.0, 3.0]) * vector)[1] is 3.0 * y
    assert (x - np.array([2.0, 3.0]))[1] is x - 3.0
    assert (x < np.array([2.0, 3.0]))[1] is (x < 3.0)
    assert sin(vector)[0] is sin(x)
    assert vector @ vector is x * x + y * y
    with pytest.raises(TraceError, match="numpy.cbrt is not recorded; known are"):
        np.cbrt(x)


def test_scalar_functions_work_on_floats_and_arrays_too():
    assert sin(0.5) == math.sin(0.5)
    assert np.array_equal(cos(np.array([0.0, 1.0])), np.cos([0.0, 1.0]))
    assert np.array_equal(where(np.array([True, False]), 1.0, 2.0), [1.0, 2.0])
