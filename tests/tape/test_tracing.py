"""Users' functions on the tape: what they may be, and what is said when they cannot be recorded."""

import math

import numpy as np
import pytest
import sympy

from mbd.errors import TraceError
from mbd.tape.evaluate import evaluate
from mbd.tape.functions import sin, where
from mbd.tape.node import Tape
from mbd.tape.tracing import traced, traced_scalar


@pytest.fixture
def scene():
    tape = Tape()
    t, angle = tape.input("t"), tape.input("q", 0)
    point = (tape.input("q", 1), tape.input("q", 2), 0.0)
    return tape, [("t", t), ("left hip.angle", angle), ("p", point)]


def test_a_function_of_scalars_and_triples_is_recorded(scene):
    tape, arguments = scene
    node = traced(lambda t, angle, p: 3.0 * sin(t) * angle + p[1] - p[2], arguments, "force of 'push'", tape)
    assert evaluate([node], {("t", 0): 0.5, ("q", 0): 2.0, ("q", 1): 9.0, ("q", 2): 1.0}) == [6.0 * math.sin(0.5) + 1.0]


@pytest.mark.parametrize(
    "function",
    [
        lambda t, angle, p: (t, 2.0, p[0]),
        lambda t, angle, p: [t, 2, p[0]],
        lambda t, angle, p: np.array([t, 2.0, p[0]]),
        sympy.Matrix([sympy.Symbol("t"), 2, sympy.Symbol("p.x")]),
        (sympy.Symbol("t"), 2.0, sympy.Symbol("p.x")),
        lambda t, angle, p: (t, sympy.Integer(2), p[0]),
    ],
)
def test_several_results_become_a_tuple(scene, function):
    tape, arguments = scene
    t, point = arguments[0][1], arguments[2][1]
    result = traced(function, arguments, "f", tape)
    assert result[0] is t and result[1].data == 2.0 and result[2] is point[0]
    with pytest.raises(TraceError, match="f: one number is expected, a sequence of 3 came"):
        traced_scalar(function, arguments, "f", tape)


def test_a_number_is_a_constant_or_a_parameter(scene):
    tape, arguments = scene
    assert traced(3, arguments, "f", tape).data == 3.0
    assert traced(np.float64(3.0), arguments, "f", tape, lambda value: tape.input("p", 7)).data == ("p", 7)


def test_sympy_symbols_are_matched_by_name_and_by_mapping(scene):
    tape, arguments = scene
    t, angle, k = sympy.Symbol("t"), sympy.Symbol("left hip.angle", real=True), sympy.Symbol("k")
    node = traced(k * angle + t, arguments, "f", tape, symbols={k: 4.0})
    assert evaluate([node], {("t", 0): 1.0, ("q", 0): 2.0}) == [9.0]
    theta = sympy.Function("left hip.angle")(t)
    assert traced(theta, arguments, "f", tape) is arguments[1][1]


def test_a_sympy_lambda_takes_the_arguments_in_order():
    tape = Tape()
    x, y, t = *sympy.symbols("x y"), tape.input("t")
    square = traced(sympy.Lambda((x, y), x**2 - y), [("t", t), ("u", 3.0)], "f", tape)
    assert evaluate([square], {t: 2.0}) == [1.0]
    with pytest.raises(TraceError, match=r"takes 1 arguments; given are 't', 'u'"):
        traced(sympy.Lambda(x, x), [("t", t), ("u", 3.0)], "f", tape)


def with_if(t, angle, p):
    if t > 0.5:
        return 1.0
    return 0.0


def with_math(t, angle, p):
    return math.sin(t)


def with_bug(t, angle, p):
    return t.nothing


FAILURES = [
    (with_if, [r"mbd\.where", "mbd.Controller", "'with_if'", r"test_tracing\.py:\d+", "'left hip.angle'"]),
    (with_math, [r"mbd\.sin", "instead of those of math"]),
    (with_bug, ["AttributeError", "nothing", r"mbd\.where"]),
    (lambda t, angle, p: 1.0 / 0.0, ["ZeroDivisionError"]),
    (lambda t, angle, p: t / 0.0, ["exact zero"]),
    (lambda t: t, ["3 arguments, in order 't', 'left hip.angle', 'p'", "too many positional"]),
    (lambda a, b, c, d: a, ["missing a required argument: 'd'"]),
    (lambda t, angle, p: None, ["None", "'return'"]),
    (lambda t, angle, p: t > 1.0, ["condition", r"mbd\.where"]),
    (lambda t, angle, p: math.nan, ["nan", "not a finite number"]),
    (lambda t, angle, p: (1.0, math.inf), ["component 1", "inf"]),
    (lambda t, angle, p: "abc", ["'abc'"]),
    (lambda t, angle, p: True, ["True"]),
    (lambda t, angle, p: 1j, ["1j"]),
    (lambda t, angle, p: np.complex64(2 + 1j), ["2.*1j.* where a number is expected"]),
    (lambda t, angle, p: np.complex128(2 + 1j) * t, ["of a complex number"]),
    (lambda t, angle, p: t * np.complex128(2 + 1j), ["the complex number .*2.*1j"]),
    (lambda t, angle, p: Tape().input("q", 0), ["earlier derivation"]),
    (lambda t, angle, p: np.cbrt(t), [r"numpy\.cbrt is not recorded; known are absolute"]),
    (math.nan, ["nan"]),
    (None, ["None"]),
    ("3", ["'3'"]),
    (sympy.Symbol("left hop.angle"), ["did you mean 'left hip.angle'", "'p.x'"]),
    (sympy.gamma(sympy.Symbol("t")), ["'gamma'", "Piecewise"]),
    (sympy.I * sympy.Symbol("t"), ["not a real number"]),
    (sympy.Abs(sympy.Symbol("t")).diff(), ["real=True"]),
    (sympy.nan, ["nan"]),
]


@pytest.mark.parametrize(("function", "said"), FAILURES)
def test_what_cannot_be_recorded_is_one_clear_error(scene, function, said):
    tape, arguments = scene
    with pytest.raises(TraceError, match="force of 'push'") as caught:
        traced(function, arguments, "force of 'push'", tape)
    for part in said:
        caught.match(part)


def test_the_cause_of_an_error_is_kept(scene):
    tape, arguments = scene
    with pytest.raises(TraceError) as caught:
        traced(with_bug, arguments, "f", tape)
    assert isinstance(caught.value.__cause__, AttributeError)


def test_a_nan_in_a_branch_is_left_for_the_run(scene):
    tape, arguments = scene
    node = traced(lambda t, angle, p: where(t < 0.5, 1.0, math.nan), arguments, "f", tape)
    assert evaluate([node], {("t", 0): 0.25}) == [1.0]
    assert math.isnan(evaluate([node], {("t", 0): 0.75})[0])


@pytest.mark.parametrize("value", [10**400, -(10**5000)], ids=["large", "larger"])
def test_an_integer_beyond_every_float_is_refused(scene, value):
    tape, arguments = scene
    with pytest.raises(TraceError, match="gives inf, which is not a finite number"):
        traced_scalar(lambda t: value, arguments[:1], "the torque", tape)
