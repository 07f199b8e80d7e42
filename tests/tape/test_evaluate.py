"""Plain evaluation follows IEEE 754 and never raises on numbers."""

import math

import pytest

from mbd.errors import UnknownNameError
from mbd.tape.evaluate import evaluate, values
from mbd.tape.node import BINARY, UNARY, Tape
from mbd.tape.operations import value


@pytest.mark.parametrize("op", sorted(UNARY))
@pytest.mark.parametrize("x", [0.0, 0.3, -0.7, 1.0, 2.5, 800.0, math.inf, math.nan])
def test_every_function_of_one_argument_gives_a_float(op, x):
    tape = Tape()
    node = tape.input("q", 0)
    result = evaluate([tape.unary(op, node)], {node: x})[0]
    try:
        expected = float(UNARY[op](x))
    except (ValueError, OverflowError):
        expected = result
        assert not math.isfinite(result)
    assert result == expected or (math.isnan(result) and math.isnan(expected))


@pytest.mark.parametrize("op", sorted(BINARY))
@pytest.mark.parametrize(("x", "y"), [(0.0, -1.0), (2.0, 3.0), (-2.0, 3.0), (-2.0, 0.5), (1e300, 2.0), (1.0, 1.0)])
def test_every_function_of_two_arguments_gives_a_float(op, x, y):
    tape = Tape()
    a, b = tape.input("q", 0), tape.input("q", 1)
    result = evaluate([tape.binary(op, a, b)], {a: x, b: y})[0]
    folded = tape.binary(op, x, y)
    assert result == folded.data or (math.isnan(result) and math.isnan(folded.data))


def test_impossible_operations_give_infinity_or_nan():
    assert value("div", -1.0, 0.0) == -math.inf
    assert math.isnan(value("div", 0.0, 0.0))
    assert value("log", 0.0) == -math.inf
    assert math.isnan(value("pow", -2.0, 0.5))
    assert value("pow", 0.0, -1.0) == math.inf
    assert value("exp", 1e4) == math.inf
    assert math.isnan(value("sign", math.nan))


def test_the_birth_of_a_nan_can_be_found():
    tape = Tape()
    x = tape.input("q", 0)
    root = tape.unary("sqrt", x - 1.0)
    all_values = values([2.0 * root + x], {x: 0.0})
    first = next(node for node, number in all_values.items() if math.isnan(number))
    assert first is root


def test_values_are_given_by_node_or_key_and_a_missing_one_is_named():
    tape = Tape()
    x, v = tape.input("q", 0), tape.input("v", 1)
    assert evaluate([x + v], {("q", 0): 1.0, v: 2.0}) == [3.0]
    assert evaluate([(x + v) * 2.0], {x + v: 5.0}) == [10.0]
    with pytest.raises(UnknownNameError, match="'v1'.*'q0'"):
        evaluate([x + v], {("q", 0): 1.0})


def test_a_table_is_looked_up_with_its_derivatives_and_goes_on_outside():
    tape = Tape()
    x = tape.input("q", 0)
    table = tape.table("t", [0.0, 1.0], [[1.0, 2.0, 3.0, 4.0], [10.0, 0.5, 0.0, 0.0]])
    outputs = [tape.lookup(table, x, order) for order in range(5)]
    assert evaluate(outputs, {x: 0.5}) == [1 + 1 + 0.75 + 0.5, 2 + 3 + 3, 6 + 12, 24, 0]
    assert evaluate(outputs[:2], {x: 3.0}) == [11.0, 0.5]
    assert evaluate(outputs[:1], {x: -1.0}) == [1 - 2 + 3 - 4]
    assert tape.lookup(table, 3.0).data == 11.0
