"""Lowering sympy expressions and raising nodes back."""

import math

import pytest
import sympy as sp
from hypothesis import given, settings

from mbd.tape.derivatives import gradient
from mbd.tape.evaluate import evaluate
from mbd.tape.functions import where
from mbd.tape.node import Tape
from mbd.tape.sympy import lower, raise_to_sympy
from tests.tape.counts import operations
from tests.tape.graphs import build, exact, programs

x, y = sp.symbols("x y", real=True)

EXPRESSIONS = [
    x**2 / y - sp.Rational(1, 3), sp.sqrt(x) / y ** sp.Rational(3, 2), x**y, x**-3, sp.exp(-x) * sp.pi, sp.E**2 - x,
    sp.sin(x) * sp.cos(y) + sp.tan(x), sp.asin(x / 4) + sp.acos(y / 9) + sp.atan(x), sp.sinh(x) + sp.cosh(y),
    sp.tanh(x) - y, sp.log(x + y), sp.Abs(x - y), sp.sign(x - y), sp.Min(x, y, 1), sp.Max(x, y, x * y), sp.atan2(x, y),
    sp.sec(x) + sp.csc(x) + sp.cot(x), sp.asinh(x) + sp.acosh(y) + sp.atanh(x), sp.GoldenRatio * x, sp.Float("0.1") * x,
    (x + y) / (x - y) / sp.exp(y), sp.diff(sp.sqrt(x**2 + y**2), x), sp.Heaviside(x - 1), sp.Heaviside(x - y, 0),
    sp.Piecewise((x, x > y), (y, x > 0), (0, True)), sp.Piecewise((x, x <= y), (y, True)),
    sp.Piecewise((1, sp.And(x > 0, y > 5)), (2, sp.Or(x < 0, y > 1)), (3, True)),
    sp.Piecewise((1, sp.Not(sp.Eq(x, y))), (2, True)), sp.Piecewise((1, sp.Eq(x, 0.7)), (2, True)),
    sp.Piecewise((1, sp.Ne(x, 0.7)), (2, True)),
]  # fmt: skip


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_a_lowered_expression_has_its_value(expression):
    tape = Tape()
    a, b = tape.input("q", 0), tape.input("q", 1)
    node = lower(expression, {x: a, y: b}, tape)
    expected = float(expression.subs({x: sp.Float(0.7, 30), y: sp.Float(1.9, 30)}).evalf(20))
    assert evaluate([node], {a: 0.7, b: 1.9})[0] == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("function", [sp.asinh, sp.atanh, sp.acosh])
def test_inverse_hyperbolic_functions_keep_their_digits_and_slopes_at_every_size(function):
    tape = Tape()
    a = tape.input("q", 0)
    node = lower(function(x), {x: a}, tape)
    for size in (0.0, 1e-9, 0.3, 0.9, 1.1, 40.0, 1e5, 1e9, 1e100):
        for at in (size, -size):
            known = [each.subs(x, sp.Float(at, 60)).evalf(30) for each in (function(x), function(x).diff(x))]
            if all(each.is_real and each.is_finite for each in known):
                found = evaluate([node, *gradient(node, [a])], {a: at})
                assert found == pytest.approx([float(each) for each in known], rel=1e-13, abs=1e-15)


def test_shared_subexpressions_are_lowered_once():
    tape = Tape()
    a = tape.input("q", 0)
    node = lower(sp.sin(x) ** 2 + sp.exp(sp.sin(x)), {x: a}, tape)
    assert operations([node]) == {"add": 1, "exp": 1, "mul": 1, "sin": 1}


def test_deep_expressions_lower():
    tape = Tape()
    deep = x
    for _ in range(300):
        deep = sp.sin(deep, evaluate=False) + 1
    node = lower(deep, {x: tape.input("q", 0)}, tape)
    assert operations([node])["sin"] == 300


def test_any_sympy_expression_may_stand_for_a_scalar():
    tape = Tape()
    t = sp.Symbol("t")
    theta = sp.Function("theta")(t)
    angle, rate = tape.input("q", 0), tape.input("v", 0)
    kinetic = theta.diff(t) ** 2 / 2 + theta
    assert lower(kinetic, {theta: angle, theta.diff(t): rate}, tape) is 0.5 * (rate * rate) + angle


def test_where_no_piece_holds_the_value_is_nan():
    tape = Tape()
    a = tape.input("q", 0)
    assert math.isnan(evaluate([lower(sp.Piecewise((x, x > 0)), {x: a}, tape)], {a: -1.0})[0])


@settings(max_examples=25)
@given(programs)
def test_lowering_what_was_raised_gives_the_same_values(program):
    graph = build((program[0][:7], program[1]))
    raised = raise_to_sympy(graph.nodes, dict(zip(graph.inputs, "abc", strict=True)))
    symbols = {sp.Symbol(name, real=True): node for name, node in zip("abc", graph.inputs, strict=True)}
    lowered = [lower(expression, symbols, graph.tape) for expression in raised]
    for value, expected in zip(exact(lowered, graph.point), graph.values, strict=True):
        assert abs(value - expected) <= 1e-12 * (1 + abs(expected))


def test_raised_nodes_read_as_mechanics():
    tape = Tape()
    m, v, q = tape.input("p", 0), tape.input("v", 0), tape.input("q", 0)
    kinetic, choice = raise_to_sympy(
        [0.5 * m * v * v, where(q < 0.0, q, tape.constant(0.1))], {m: "m", q: sp.Symbol("theta")}
    )
    assert str(kinetic) == "m*v0**2/2"
    assert str(choice) == "Piecewise((theta, theta < 0), (0.1, True))"


def test_a_table_is_raised_as_a_function_of_its_name():
    tape = Tape()
    table = tape.table("ankle", [0.0], [[1.0, 2.0, 0.0, 0.0]])
    assert str(raise_to_sympy([tape.lookup(table, tape.input("q", 0))])[0]) == "ankle(q0)"
