"""All backends compute the same numbers, operation by operation."""

import math
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from mbd.compile.c import c_source
from mbd.compile.layout import Layout
from mbd.compile.python import array_function, scalar_function
from mbd.errors import ModelError, UnknownNameError
from mbd.tape.node import CONDITIONS, Tape
from tests.compile.chains import chain
from tests.compile.graphs import COMPILER, LAYOUT, Graph, against, by_c, by_llvm, graphs, inputs_of, run


@given(graphs())
@settings(max_examples=80)
def test_plain_python_does_each_operation(graph):
    against(graph, run(scalar_function(graph.outputs, LAYOUT), graph))


@given(graphs())
@settings(max_examples=50)
def test_machine_code_does_each_operation(graph):
    against(graph, run(by_llvm({"f": graph.outputs})["f"], graph))


@given(graphs())
@settings(max_examples=80)
def test_columns_do_each_operation_in_every_row(graph):
    results = array_function(graph.outputs)(inputs_of(graph, 3), graph.parameters)
    assert all(result.shape == (3,) for result in results)
    for row in range(3):
        against(graph, [result[row] for result in results], ulps=8.0)


@pytest.mark.skipif(COMPILER is None, reason="no C compiler found")
@given(graphs(size=120))
@settings(max_examples=8)
def test_c_gives_the_bits_of_machine_code_in_one_piece_and_in_parts(graph):
    expected = run(by_llvm({"f": graph.outputs}, fused=False)["f"], graph)
    for options in ({}, {"large": 0, "part": 30}):
        with tempfile.TemporaryDirectory() as folder:
            found = run(by_c({"f": graph.outputs}, Path(folder), **options)["f"], graph)
        assert np.array_equal(found, expected, equal_nan=True)


@given(graphs())
@settings(max_examples=25)
def test_an_output_has_the_same_bits_whatever_else_is_asked_for(graph):
    few = Graph(graph.outputs[-3:], graph.block, graph.parameters)
    for compiled in (lambda outputs: scalar_function(outputs, LAYOUT), lambda outputs: by_llvm({"f": outputs})["f"]):
        everything, alone = run(compiled(graph.outputs), graph), run(compiled(few.outputs), few)
        assert np.array_equal(alone, everything[-3:], equal_nan=True)


BORDERS = [
    (lambda x, y: x / y, 1.0, 0.0, math.inf),
    (lambda x, y: x / y, -1.0, 0.0, -math.inf),
    (lambda x, y: x / y, 1.0, -0.0, -math.inf),
    (lambda x, y: x / y, 0.0, 0.0, math.nan),
    (lambda x, y: x.tape.unary("log", x), -1.0, 0.0, math.nan),
    (lambda x, y: x.tape.unary("log", x), 0.0, 0.0, -math.inf),
    (lambda x, y: x.tape.unary("sqrt", x), -1.0, 0.0, math.nan),
    (lambda x, y: x.tape.unary("exp", x), 1000.0, 0.0, math.inf),
    (lambda x, y: x.tape.unary("sinh", x), -1000.0, 0.0, -math.inf),
    (lambda x, y: x.tape.unary("sin", x), math.inf, 0.0, math.nan),
    (lambda x, y: x.tape.unary("asin", x), 2.0, 0.0, math.nan),
    (lambda x, y: x**y, 0.0, -1.0, math.inf),
    (lambda x, y: x**y, -8.0, 0.5, math.nan),
    (lambda x, y: x**y, -10.0, 333.0, -math.inf),
    (lambda x, y: x.tape.binary("min", x, y), math.nan, 1.0, math.nan),
    (lambda x, y: x.tape.binary("min", x, y), 1.0, math.nan, math.nan),
    (lambda x, y: x.tape.binary("max", x, y), math.nan, 1.0, math.nan),
    (lambda x, y: x.tape.binary("max", x, y), 1.0, math.nan, math.nan),
    (lambda x, y: x.tape.unary("sign", x), math.nan, 0.0, math.nan),
    (lambda x, y: x.tape.unary("sign", x), -0.0, 0.0, 0.0),
    (lambda x, y: x.tape.where(x < y, 1.0, 2.0), math.nan, 1.0, 2.0),
    (lambda x, y: x.tape.where(~(x < y), 1.0, 2.0), math.nan, 1.0, 1.0),
    (lambda x, y: x * y, math.inf, 0.0, math.nan),
]


@pytest.mark.parametrize("number", range(len(BORDERS)))
def test_impossible_values_are_infinite_or_nan_and_never_raise(number):
    expression, x, y, expected = BORDERS[number]
    tape = Tape()
    output = [expression(tape.input("t"), tape.input("c", 0)), tape.input("c", 1)]
    block = np.array([x, y, 7.0])
    layout = Layout(0, 0, 0, 0, 0, 0, 0)
    graph = Graph(tuple(output), block, np.zeros(0), layout)
    results = [
        run(scalar_function(output, layout), graph),
        run(by_llvm({"f": output}, layout)["f"], graph),
        [column[0] for column in array_function(output)({"t": np.array([x]), "c": np.array([[y, 7.0]])}, np.zeros(0))],
    ]
    for result, other in results:
        assert other == 7.0
        assert math.isnan(result) if math.isnan(expected) else result == expected


def test_the_energy_of_a_chain_is_the_same_in_all_backends():
    links = chain(4)
    layout, rng = links.layout, np.random.default_rng(3)
    rows = 5000
    block, parameters = rng.uniform(-2.0, 2.0, (rows, layout.size)), rng.uniform(0.5, 2.0, layout.n_parameters)
    inputs = {"q": block[:, layout.q : layout.x], "v": block[:, layout.v : layout.a], "t": block[:, 0]}
    outputs = [links.energy, *links.balance]
    columns = array_function(outputs)(inputs | {"a": block[:, layout.a : layout.lam]}, parameters)
    block[:, layout.x : layout.v] = 0.0  # an absent increment is zero
    plain, machine = scalar_function(outputs, layout), by_llvm({"f": outputs}, layout)["f"]
    for row in (0, 17, 4095, 4096, 4999):
        x, y = np.empty(5), np.empty(5)
        plain(block[row], parameters, x)
        machine(block[row], parameters, y)
        assert np.allclose(x, y, rtol=1e-13, atol=1e-13)
        assert np.allclose(x, [column[row] for column in columns], rtol=1e-13, atol=1e-13)


def test_parameters_may_change_from_row_to_row():
    tape = Tape()
    outputs = [tape.input("p", 1) * tape.input("t"), tape.input("p", 0), tape.constant(2.5)]
    time, parameters = np.arange(3.0), np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    results = array_function(outputs)({"t": time}, parameters)
    assert np.array_equal(results, [[0.0, 4.0, 12.0], [1.0, 3.0, 5.0], [2.5, 2.5, 2.5]])
    results = array_function(outputs)({"t": time}, parameters[0])
    assert np.array_equal(results, [[0.0, 2.0, 4.0], [1.0, 1.0, 1.0], [2.5, 2.5, 2.5]])


def test_an_input_that_is_missing_is_named():
    tape = Tape()
    with pytest.raises(UnknownNameError, match="no input named 'lam'"):
        array_function([tape.input("lam", 0)])({"t": np.zeros(2)}, np.zeros(0))


def test_no_outputs_are_no_work():
    layout = Layout(1, 1, 0, 0, 0, 0, 0)
    assert array_function([])({"t": np.zeros(2)}, np.zeros(0)) == []
    for function in (scalar_function([], layout), by_llvm({"f": []}, layout)["f"]):
        function(np.zeros(layout.size), np.zeros(0), np.zeros(0))


def test_constants_survive_every_text_exactly():
    tape = Tape()
    numbers = [0.1, -1e-308, 5e-324, 1.7976931348623157e308, math.pi, -math.inf, math.inf, math.nan, 2.0**-1074 * 3]
    outputs = [tape.constant(number) for number in numbers]
    layout = Layout(0, 0, 0, 0, 0, 0, 0)
    graph = Graph(tuple(outputs), np.zeros(3), np.zeros(0), layout)
    functions = [scalar_function(outputs, layout), by_llvm({"f": outputs}, layout)["f"]]
    with tempfile.TemporaryDirectory() as folder:
        if COMPILER:
            functions.append(by_c({"f": outputs}, Path(folder), layout)["f"])
        for function in functions:
            assert np.array_equal(run(function, graph), numbers, equal_nan=True)


def test_a_function_needs_a_name_that_targets_allow():
    with pytest.raises(ModelError, match="letters, digits"):
        c_source({"left foot": []}, Layout(0, 0, 0, 0, 0, 0, 0))


def test_a_table_takes_the_piece_that_begins_at_a_break():
    tape = Tape()
    rows = [[float(piece), 10.0, 100.0, 1000.0] for piece in range(5)]
    table = tape.table("steps", [0.0, 1.0, 2.0, 3.0, 4.0], rows)
    outputs = [tape.lookup(table, tape.input("t"), order) for order in range(4)]
    layout = Layout(0, 0, 0, 0, 0, 0, 0, (0,))
    functions = [scalar_function(outputs, layout), by_llvm({"f": outputs}, layout)["f"]]
    with tempfile.TemporaryDirectory() as folder:
        if COMPILER:
            functions.append(by_c({"f": outputs}, Path(folder), layout)["f"])
        for t in (-0.5, 0.0, 0.5, 1.0, 2.0, 3.0, 3.5, 4.0, 5.0, math.nan):
            graph = Graph(tuple(outputs), np.array([t, 0.0, 0.0]), np.array(table.flat), layout)
            expected = [table.value(t, order) for order in range(4)]
            columns = array_function(outputs)({"t": np.array([t])}, graph.parameters)
            assert np.array_equal(np.ravel(columns), expected, equal_nan=True)
            for function in functions:
                assert np.array_equal(run(function, graph), expected, equal_nan=True)


def test_tables_are_read_from_the_parameters():
    tape = Tape()
    table = tape.table("flat", [0.0], [[1.0, 0.0, 0.0, 0.0]])
    layout = Layout(0, 0, 0, 0, 0, 0, 1, (1,))
    outputs = [tape.lookup(table, tape.input("t"))]
    graph = Graph(tuple(outputs), np.zeros(3), np.array([9.0, 0.0, 5.0, 0.0, 0.0, 0.0]), layout)
    for function in (scalar_function(outputs, layout), by_llvm({"f": outputs}, layout)["f"]):
        assert run(function, graph) == [5.0]


def test_a_number_is_a_true_condition_unless_it_is_zero():
    tape = Tape()
    t = tape.input("t")
    outputs = [tape.where(tape.binary("and", t, tape.input("c", 0) < 1.0), 1.0, 2.0)]
    layout = Layout(0, 0, 0, 0, 0, 0, 0)
    for function in (scalar_function(outputs, layout), by_llvm({"f": outputs}, layout)["f"]):
        for value, expected in ((0.0, 2.0), (-0.0, 2.0), (0.5, 1.0), (math.nan, 1.0)):
            assert run(function, Graph(tuple(outputs), np.array([value, 0.0, 0.0]), np.zeros(0), layout)) == [expected]


def test_conditions_are_stored_as_one_and_zero():
    tape = Tape()
    t = tape.input("t")
    outputs = [t < 1.0, ~(t < 1.0), (t < 1.0) & (t < 3.0), (t < 1.0) | (t < 3.0)]
    assert all(node.op in CONDITIONS for node in outputs)
    layout = Layout(0, 0, 0, 0, 0, 0, 0)
    graph = Graph(tuple(outputs), np.array([2.0, 0.0, 0.0]), np.zeros(0), layout)
    for function in (scalar_function(outputs, layout), by_llvm({"f": outputs}, layout)["f"]):
        assert np.array_equal(run(function, graph), [0.0, 1.0, 0.0, 1.0])
