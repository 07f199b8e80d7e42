"""Forward and reverse derivatives agree with each other and with differences."""

import math

import pytest
from hypothesis import given, strategies as st

from mbd.tape.derivatives import Sweeps, gradient, jvp, jvps, vjp
from mbd.tape.evaluate import evaluate
from mbd.tape.functions import atan2, log, maximum, minimum, sign, sqrt, where
from mbd.tape.node import Tape
from tests.tape.counts import total
from tests.tape.graphs import FUNCTIONS, build, exact, mp, programs

directions = st.lists(st.sampled_from([0.0, 1.0, -1.0, 0.5, 2.0]), min_size=3, max_size=3)


@given(programs, directions)
def test_the_forward_derivative_is_the_limit_of_differences(program, direction):
    graph = build(program)
    step = mp.mpf(10) ** -20
    ahead = {node: x + step * d for (node, x), d in zip(graph.point.items(), direction, strict=True)}
    behind = {node: x - step * d for (node, x), d in zip(graph.point.items(), direction, strict=True)}
    outputs = graph.nodes[-8:]
    rates = exact(jvp(outputs, dict(zip(graph.inputs, direction, strict=True))), graph.point)
    for rate, plus, minus in zip(rates, exact(outputs, ahead), exact(outputs, behind), strict=True):
        assert abs(rate - (plus - minus) / (2 * step)) <= 1e-12 * (1 + abs(rate))


@given(programs, directions)
def test_forward_and_reverse_derivatives_agree(program, direction):
    graph = build(program)
    outputs = graph.nodes[-6:]
    adjoints = [1.0, -2.0, 0.5, 3.0, 0.25, -1.0]
    forward = exact(jvp(outputs, dict(zip(graph.inputs, direction, strict=True))), graph.point)
    reverse = exact(vjp(outputs, adjoints, graph.inputs), graph.point)
    work = sum(w * rate for w, rate in zip(adjoints, forward, strict=True))
    power = sum(bar * d for bar, d in zip(reverse, direction, strict=True))
    scale = sum(abs(w * rate) for w, rate in zip(adjoints, forward, strict=True))
    assert abs(work - power) <= 1e-12 * (1 + scale)  # logarithms of constant bases are folded in double precision


@given(programs)
def test_second_derivatives_commute(program):
    graph = build(program)
    x, y, _ = graph.inputs
    output = graph.nodes[-1]
    one = exact(jvp(jvp([output], {x: 1.0}), {y: 1.0}), graph.point)[0]
    other = exact(gradient(gradient(output, [y])[0], [x]), graph.point)[0]
    assert abs(one - other) <= 1e-10 * (1 + abs(one))


@pytest.mark.parametrize(
    "op", ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt"]
)
def test_smooth_functions_against_the_complex_step(op):
    tape = Tape()
    x = tape.input("q", 0)
    step = mp.mpf(10) ** -40
    expected = FUNCTIONS[op](mp.mpc(0.4, step)).imag / step
    assert evaluate(jvp([tape.unary(op, x)], {x: 1.0}), {x: 0.4})[0] == pytest.approx(float(expected), rel=1e-14)


def test_several_directions_at_once_are_those_one_by_one():
    tape = Tape()
    x, y = tape.input("q", 0), tape.input("q", 1)
    outputs = [x * y, atan2(y, x), x / y]
    both = jvps(outputs, [{x: 1.0}, {y: x, x: 2.0}])
    assert all(a is b for a, b in zip(both[0], jvp(outputs, {x: 1.0}), strict=True))
    assert all(a is b for a, b in zip(both[1], jvp(outputs, {y: x, x: 2.0}), strict=True))


@given(programs, directions)
def test_derivatives_of_more_and_more_outputs_are_those_of_all_at_once(program, direction):
    """The same nodes, as long as what was asked before has not been named since."""
    graph, sweeps = build(program), Sweeps()
    seeds = [dict(zip(graph.inputs, direction, strict=True)), {graph.inputs[0]: 1.0}]
    for first, last in ((2, 3), (4, 8), (0, 8), (0, 2)):
        outputs = graph.nodes[-8:][first:last]
        for found, known in zip(sweeps(outputs, seeds), jvps(outputs, seeds), strict=True):
            assert all(one is other for one, other in zip(found, known, strict=True))
    named = [node for node in graph.nodes if node.args][:1]
    more = [{**seeds[0], **dict.fromkeys(named, 0.5)}, seeds[1]]
    for found, known in zip(sweeps(graph.nodes[-8:], more), jvps(graph.nodes[-8:], more), strict=True):
        assert all(one is other for one, other in zip(found, known, strict=True))


def test_a_node_without_a_derivative_that_is_named_later_counts():
    tape = Tape()
    x, y = tape.input("q", 0), tape.input("q", 1)
    for named in (sign(y), y):
        sweeps = Sweeps()
        assert sweeps([x + named], [{x: 1.0}])[0] == [tape.lift(1.0)]
        assert sweeps([x + named], [{x: 1.0, named: 0.5}])[0] == jvps([x + named], [{x: 1.0, named: 0.5}])[0]


def test_a_seeded_node_is_independent_of_the_others():
    tape = Tape()
    x = tape.input("q", 0)
    square = x * x
    assert jvp([square * x], {x: 0.0, square: 1.0})[0] is x


@pytest.mark.parametrize(
    ("function", "at", "slope"),
    [
        (lambda x: abs(x), 0.0, 0.0),
        (lambda x: x**1.5, 0.0, 0.0),
        (lambda x: maximum(0.0, x) ** 1.5, -1.0, 0.0),
        (lambda x: maximum(0.0, x) ** 2.2, 0.0, 0.0),
        (lambda x: minimum(x, 1.0), 1.0, 1.0),
        (lambda x: maximum(0.0, x), 0.0, 0.0),
        (lambda x: maximum(x, 0.0), 0.0, 1.0),
        (lambda x: x**3, -2.0, 12.0),
        (lambda x: x**70, -1.0, -70.0),
        (lambda x: x**-2, -2.0, 0.25),
        (lambda x: x**0.5, 0.0, math.inf),
        (lambda x: where(x > 0.0, sqrt(x), 0.0), 0.0, 0.0),
        (lambda x: where(x > 0.0, x * log(x), 0.0), 0.0, 0.0),
        (lambda x: where(x > 0.0, 1.0 / x, -x), 0.0, -1.0),
        (lambda x: where(x > 0.0, sqrt(x) + 3.0 * sqrt(x) * x, 2.0 * x), 0.0, 2.0),
        (lambda x: where(x < 1.0, 0.0, where(x > 2.0, log(x - 2.0) + sqrt(x - 1.0), 1.0 / (x - 1.0))), 1.0, -math.inf),
        (lambda x: where(x < 1.5, 2.0 * x, where(x > 2.0, log(x - 1.0), 1.0 / (x - 1.0))), 1.0, 2.0),
        (lambda x: minimum(x, sqrt(x - 1.0)), 1.0, math.inf),
        (lambda x: maximum(x, sqrt(x - 1.0)), 1.0, 1.0),
    ],
)
def test_both_directions_at_kinks_and_ends_of_domains(function, at, slope):
    tape = Tape()
    x = tape.input("q", 0)
    output = function(x)
    forward, reverse = evaluate([*jvp([output], {x: 1.0}), *gradient(output, [x])], {x: at})
    assert forward == pytest.approx(slope)
    assert reverse == pytest.approx(slope)


def test_a_variable_exponent_has_a_slope_at_zero_base():
    tape = Tape()
    x, n = tape.input("q", 0), tape.input("p", 0)
    assert evaluate(jvp([x**n], {x: 1.0, n: 1.0}), {x: 0.0, n: 1.5}) == [0.0]
    assert evaluate(gradient(x**n, [x, n]), {x: -2.0, n: 3.0})[0] == 12.0


def test_conditions_and_signs_have_no_derivative():
    tape = Tape()
    x = tape.input("q", 0)
    assert jvp([tape.unary("sign", x)], {x: 1.0})[0] is tape.zero
    assert gradient(where(x > 0.0, 1.0, 2.0), [x])[0] is tape.zero


def test_tables_differentiate_piece_by_piece():
    tape = Tape()
    x = tape.input("q", 0)
    table = tape.table("t", [0.0, 1.0], [[1.0, 2.0, 3.0, 4.0], [10.0, 0.5, 0.0, 0.0]])
    slope = gradient(tape.lookup(table, 2.0 * x), [x])[0]
    assert evaluate([slope], {x: 0.25}) == [2.0 * (2.0 + 3.0 + 3.0)]


def test_outputs_without_the_inputs_cost_nothing():
    tape = Tape()
    x, y = tape.input("q", 0), tape.input("q", 1)
    assert jvp([sqrt(y)], {x: 1.0})[0] is tape.zero
    assert total(vjp([x * y, sqrt(y)], [2.0, 1.0], [x])) == 1
    assert vjp([], [], [x])[0] is tape.zero
    assert jvp([], {x: 1.0}) == []


def test_the_generalized_force_is_the_virtual_work_of_a_force():
    tape = Tape()
    angle, length, weight = tape.input("q", 0), tape.input("p", 0), tape.input("p", 1)
    height = -length * tape.unary("cos", angle)
    torque = vjp([height], [-weight], [angle])[0]
    assert evaluate([torque], {angle: 0.3, length: 2.0, weight: 5.0})[0] == pytest.approx(-10.0 * math.sin(0.3))
