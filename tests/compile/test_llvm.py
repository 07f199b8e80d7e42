"""Machine code: cut functions, levels, threads, libraries."""

import gc
import threading

import llvmlite.binding as llvm
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from mbd.compile.cache import ObjectCache
from mbd.compile.host import host
from mbd.compile.ir import Module
from mbd.compile.layout import Layout
from mbd.compile.llvm import Library, call, emit_object, load_object
from mbd.compile.lowering import MAX_OPERATIONS, MIN_RUNS, MIN_ZEROS, PART_OPERATIONS
from mbd.errors import ModelError, UnknownNameError
from mbd.tape.functions import cos, sin
from mbd.tape.node import Tape
from tests.compile.chains import chain, compile_functions
from tests.compile.graphs import Graph, by_llvm, graphs, run

NONE = ObjectCache()


def state(links, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(-2.0, 2.0, links.layout.size), rng.uniform(0.5, 2.0, links.layout.n_parameters)


def results(function, links, seed=0):
    out = np.empty(len(links.outputs))
    function(*state(links, seed), out)
    return out


@given(graphs(size=80))
@settings(max_examples=25)
def test_a_function_cut_into_parts_gives_the_same_bits(graph):
    whole = run(by_llvm({"f": graph.outputs})["f"], graph)
    for part in (1, 7, 25):
        cut = run(by_llvm({"f": graph.outputs}, large=0, part=part)["f"], graph)
        assert np.array_equal(whole, cut, equal_nan=True)


def test_big_functions_are_cut_and_small_ones_are_not():
    small, big = chain(3), chain(10)
    assert "@mbd.r.1" not in Module({"r": small.outputs}, small.layout).text()
    text = Module({"r": big.outputs}, big.layout).text()
    assert "@mbd.r.1(" in text
    whole = by_llvm({"r": big.outputs}, big.layout, large=10 * MAX_OPERATIONS)["r"]
    cut = by_llvm({"r": big.outputs}, big.layout)["r"]
    assert np.array_equal(results(whole, big), results(cut, big))


def test_no_function_has_many_stores_whatever_is_asked_for_how_often():
    """LLVM takes quadratic time to order them."""
    links, rng = chain(5), np.random.default_rng(0)
    values = [*links.outputs, *(links.tape.input("p", k) for k in range(3))]
    asked = rng.integers(len(values), size=3000).tolist() + [len(values) - 1] * 600
    few, many = ({"f": outputs} for outputs in (values, [values[k] for k in asked]))
    most = max(sum("store " in line for line in body.lines) for body in Module(many, links.layout).bodies)
    assert most <= 2 * PART_OPERATIONS
    alone, out = np.empty(len(values)), np.empty(len(asked))
    by_llvm(few, links.layout)["f"](*state(links), alone)
    by_llvm(many, links.layout)["f"](*state(links), out)
    assert np.array_equal(out, alone[asked])


@given(graphs(size=60))
@settings(max_examples=20)
def test_values_among_many_runs_of_zeros_keep_their_bits(graph):
    """Zeros are then cleared at the beginning, in one piece and in parts."""
    alone, zero = run(by_llvm({"f": graph.outputs})["f"], graph), graph.outputs[0].tape.zero
    for runs in (MIN_RUNS - 1, MIN_RUNS, 3 * MIN_RUNS):
        gaps = [(graph.outputs[k % len(graph.outputs)], MIN_ZEROS * (k > 2) + k % 3) for k in range(runs + 6)]
        outputs = [node for output, gap in gaps for node in (output, *[zero] * gap)]
        expected = np.concatenate([[alone[k % len(alone)], *[0.0] * gap] for k, (_, gap) in enumerate(gaps)])
        mixed = Graph(tuple(outputs), graph.block, graph.parameters)
        for cut in ({}, {"large": 0, "part": 9}):
            assert np.array_equal(run(by_llvm({"f": outputs}, **cut)["f"], mixed), expected, equal_nan=True)


@given(seed=st.integers(0, 2**32 - 1), share=st.sampled_from([0.0, 0.01, 0.1, 0.5]), large=st.booleans())
@settings(max_examples=25)
def test_what_is_to_be_left_is_left_among_many_runs_of_zeros(seed, share, large):
    rng, tape = np.random.default_rng(seed), Tape()
    nodes = tape.input("t") + 1.0, tape.zero, tape.untouched
    kinds = [kind for _ in range(4 * MIN_RUNS) for kind in (0, *[1] * rng.integers(MIN_ZEROS - 2, MIN_ZEROS + 9))]
    kinds = [2 if rng.random() < share / MIN_ZEROS and kind == 1 else kind for kind in kinds]
    kinds = [k for kind in kinds for k in ([kind] if kind < 2 else [2] * rng.integers(1, 20))]
    cut = {"large": 0, "part": 9} if large else {}
    library = by_llvm({"f": [nodes[kind] for kind in kinds]}, **cut)
    out = np.full(len(kinds), np.nan)
    library["f"](np.array([2.0, *[0.0] * 20]), np.zeros(20), out)
    np.testing.assert_array_equal(out, np.array([3.0, 0.0, np.nan])[kinds])


@pytest.mark.parametrize("level", [0, 2])
@pytest.mark.parametrize("between", [3, MIN_ZEROS, MIN_ZEROS + 1, MIN_ZEROS + 2, MIN_ZEROS + 3, 100])
def test_zeros_side_by_side_are_all_written_and_nothing_else_is(between, level):
    tape = Tape()
    one = tape.input("t") + 1.0
    outputs = [one, *[tape.zero] * between, one, *[tape.lift(-0.0)] * between, tape.zero]
    library = compile_functions({"f": outputs}, Layout(0, 0, 0, 0, 0, 0, 0), level, NONE)
    out = np.full(len(outputs) + 8, np.nan)
    library["f"](np.array([2.0, 0.0, 0.0]), np.zeros(0), out)
    expected = np.zeros(len(outputs))
    expected[[0, between + 1]] = 3.0
    np.testing.assert_array_equal(out[: len(outputs)], expected)
    assert np.all(np.isnan(out[len(outputs) :]))


def test_sines_and_cosines_of_four_angles_are_one_call():
    links = chain(4)
    text = Module({"r": links.outputs}, links.layout).text()
    assert text.count("call fastcc") == 1
    tape = Tape()
    x = tape.input("q", 0)
    text = Module({"f": [sin(x), cos(x), sin(cos(x))]}, Layout(1, 1, 0, 0, 0, 0, 0)).text()
    assert text.count("call fastcc") == 2  # the second needs the first


@given(graphs())
@settings(max_examples=15)
def test_the_text_is_valid_whatever_the_graph(graph):
    for fused in (False, True):
        llvm.parse_assembly(Module({"f": graph.outputs}, graph.layout, fused, large=0, part=9).text()).verify()


def test_the_same_program_has_the_same_text_and_the_same_bytes():
    first, second = chain(3), chain(3)
    other = Tape()
    other.input("lam", 0) * other.input("lam", 1)  # an index further than usual
    texts = [Module({"r": links.outputs}, links.layout).text() for links in (first, second)]
    assert texts[0] == texts[1]
    assert emit_object(texts[0]) == emit_object(texts[1])


def test_what_else_the_tape_holds_does_not_change_the_text():
    layout = Layout(2, 2, 0, 0, 0, 0, 0)

    def text(tape):
        x, y = tape.input("q", 0), tape.input("q", 1)
        return Module({"f": [sin(x) * y + cos(x)]}, layout).text()

    used = Tape()
    _ = used.input("t") * used.input("v", 1)
    assert text(Tape()) == text(used)


@pytest.mark.parametrize("links", [3, 10])
def test_all_levels_give_the_same_bits(links):
    links = chain(links)
    libraries = [compile_functions({"r": links.outputs}, links.layout, level, NONE) for level in range(4)]
    reference = results(libraries[2]["r"], links)
    for library in libraries:
        assert np.array_equal(reference, results(library["r"], links))


def test_threads_call_one_function_with_buffers_of_their_own():
    links = chain(5)
    library = compile_functions({"r": links.outputs}, links.layout, cache=NONE)
    function = library["r"]
    alone = [results(function, links, seed) for seed in range(4)]
    wrong: list[int] = []

    def work(seed):
        (block, parameters), out = state(links, seed), np.empty(len(links.outputs))
        for _ in range(3000):
            out[:] = 0.0
            function(block, parameters, out)
            if not np.array_equal(out, alone[seed]):
                wrong.append(seed)
                return

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_a_library_takes_further_functions_and_knows_them_by_name():
    links = chain(2)
    library = Library(links.layout, cache=NONE)
    library.add({"balance": links.balance, "tangent": links.tangent})
    first = library.address("balance")
    library.add({"energy": [links.energy]})
    assert list(library) == ["balance", "tangent", "energy"]
    assert "energy" in library
    assert library.address("balance") == first != library.address("tangent")
    assert [build.names for build in library.builds] == [("balance", "tangent"), ("energy",)]
    with pytest.raises(UnknownNameError, match="did you mean 'energy'"):
        library["enregy"]
    with pytest.raises(ModelError, match="already"):
        library.add({"energy": [links.energy]})
    with pytest.raises(ModelError, match="letters"):
        library.add({"left foot": [links.energy]})


@pytest.mark.usefixtures("older_objects_left_alone")
def test_a_function_outlives_the_variable_that_held_its_library():
    links = chain(2)
    function = compile_functions({"r": links.outputs}, links.layout, cache=NONE)["r"]
    expected = results(function, links)
    gc.collect()
    for _ in range(3):
        compile_functions({"r": links.outputs}, links.layout, cache=NONE)
        gc.collect()
    assert np.array_equal(results(function, links), expected)


def test_arrays_that_do_not_fit_are_refused():
    links = chain(2)
    function = compile_functions({"r": links.outputs}, links.layout, cache=NONE)["r"]
    block, parameters = state(links)
    out = np.empty(function.size)
    for arrays in ((block, parameters, out[:-1]), (block, parameters[:-1], out), (block[:-1], parameters, out)):
        with pytest.raises(ValueError, match=r"need \(13, 7, 6\) numbers, these arrays have"):
            function(*arrays)
    fixed = out.copy()
    fixed.flags.writeable = False
    with pytest.raises(ValueError, match="read-only"):
        function(block, parameters, fixed)
    parameters.flags.writeable = False
    function(block, parameters, out)
    with pytest.raises(TypeError, match="float32"):
        function(block.astype(np.float32), parameters, out)
    with pytest.raises(TypeError, match="contiguous"):
        function(np.repeat(block, 2)[::2], parameters, out)


def test_an_address_can_be_called_from_python():
    links = chain(2)
    library = compile_functions({"r": links.outputs}, links.layout, cache=NONE)
    assert np.array_equal(results(call(library.address("r")), links), results(library["r"], links))


def test_an_object_can_stay_for_the_whole_process():
    text = """
define void @resident_square(ptr %block, ptr %parameters, ptr %out) {
%x = load double, ptr %block
%y = fmul double %x, %x
store double %y, ptr %out
ret void
}"""
    out = np.empty(1)
    call(load_object(emit_object(text), "resident_square"))(np.array([3.0]), np.empty(0), out)
    assert out == [9.0]


def test_the_host_is_described_completely():
    this = host()
    assert this.triple
    assert this.cpu
    assert this.llvm.split(".")[0].isdigit()
