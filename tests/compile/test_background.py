"""Large programs run at once and are optimized meanwhile; when that happens changes no bit of anything."""

import gc
import os
import subprocess
import sys
import threading
from pathlib import Path

import llvmlite.binding as binding
import numpy as np
import pytest
from hypothesis import given, settings

import mbd
from mbd.compile import backend, background, llvm, mechanisms
from mbd.compile.cache import ObjectCache
from mbd.compile.host import host
from mbd.compile.ir import Module
from mbd.compile.llvm import Library, Machine, call, emit_object
from mbd.kernel.entry import entry
from mbd.simulation.run.stepper import Stepper
from tests.compile.chains import chain
from tests.compile.graphs import by_llvm, graphs, run
from tests.compile.test_llvm import results
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start

LINKS = chain(12)
NONE = ObjectCache()


def hasty(cache=NONE, links=LINKS, name="r"):
    library = Library(links.layout, cache=cache, hasty=0)
    library.add({name: links.outputs})
    return library


@pytest.fixture
def jobs(monkeypatch):
    """The jobs that would be done in the background, which are done when the test says so."""
    monkeypatch.delenv(backend.LEVEL, raising=False)
    waiting = []
    monkeypatch.setattr(llvm, "submit", waiting.append)
    return waiting


def do(jobs):
    while jobs:
        job = jobs.pop()
        while background._Worker.step(job):
            pass


# pieces -----------------------------------------------------------------------------------------------------------


@given(graphs(size=80))
@settings(max_examples=25)
def test_pieces_together_give_the_same_bits(graph):
    whole = run(by_llvm({"f": graph.outputs})["f"], graph)
    texts = Module({"f": graph.outputs}, graph.layout, host().fused, large=0, part=7).pieces(20)
    for text in texts:
        binding.parse_assembly(text).verify()
    machine = Machine()
    code, *more = map(emit_object, texts)
    function = call(machine.load(code, ["mbd.f"], *more)[0])
    assert np.array_equal(whole, run(function, graph), equal_nan=True)


def test_large_texts_are_cut_and_every_function_is_in_one_piece():
    programs = {"r": LINKS.outputs, "energy": [LINKS.energy]}
    module = Module(programs, LINKS.layout)
    text = module.text()
    texts = module.pieces()
    assert len(texts) > 3 and max(len(piece) for piece in texts) < len(text) / 2
    for name in programs:
        assert sum(f"define void @mbd.{name}(" in piece for piece in texts) == 1
    assert module.pieces(10**6) == [text]


# functions --------------------------------------------------------------------------------------------------------


def test_a_large_function_runs_at_once_and_is_exchanged_for_one_with_the_same_bits(jobs):
    library, patient = hasty(), Library(LINKS.layout, cache=NONE)
    patient.add({"r": LINKS.outputs})
    function, expected = library["r"], results(patient["r"], LINKS)
    assert function.provisional and not patient["r"].provisional
    assert (library.builds[0].level, patient.builds[0].level) == (0, llvm.LEVEL)
    before = function.address
    assert np.array_equal(results(function, LINKS), expected)
    do(jobs)
    assert not function.provisional and function.address != before
    for version in (function, call(before)):  # whoever kept the first address may go on with it
        assert np.array_equal(results(version, LINKS), expected)


def test_what_is_called_rarely_stays_at_level_0_with_the_same_bits(jobs):
    library, patient = Library(LINKS.layout, cache=NONE, hasty=0), Library(LINKS.layout, cache=NONE)
    library.add({"r": LINKS.outputs}, rarely=True)
    patient.add({"r": LINKS.outputs})
    assert library.builds[0].level == 0 and not library["r"].provisional and not jobs
    assert np.array_equal(results(library["r"], LINKS), results(patient["r"], LINKS))


def test_what_was_made_in_the_background_is_found_again(jobs, tmp_path):
    cache = ObjectCache(tmp_path)
    first = hasty(cache)
    job = jobs.pop()
    job.step()
    again = hasty(cache)  # one piece is there
    assert first["r"].provisional and again["r"].provisional
    do(jobs)
    made = {path.name for path in tmp_path.iterdir()}
    third = hasty(cache, name="r")
    assert not third["r"].provisional and third.builds[0].cached and not jobs
    assert {path.name for path in tmp_path.iterdir()} == made
    assert np.array_equal(results(third["r"], LINKS), results(first["r"], LINKS))


def test_a_thread_does_it_while_functions_are_called():
    library = hasty()
    expected = results(library["r"], LINKS)
    background.finish()
    assert not library["r"].provisional and library.notes == []
    assert np.array_equal(results(library["r"], LINKS), expected)
    assert not any(thread.name == "mbd background" for thread in threading.enumerate())


@pytest.mark.usefixtures("older_objects_left_alone")
def test_nothing_is_made_for_a_library_that_is_gone(jobs, monkeypatch):
    hasty()
    gc.collect()  # library and functions know each other
    monkeypatch.setattr(llvm, "emit_object", lambda *_: pytest.fail("made for nobody"))
    assert not jobs.pop().step()


def test_an_error_in_the_background_leaves_a_note_and_working_code(jobs, monkeypatch):
    library = hasty()
    expected = results(library["r"], LINKS)

    def fails(*_):
        raise RuntimeError("LLVM is out of sorts")

    monkeypatch.setattr(llvm, "emit_object", fails)
    do(jobs)
    assert library.notes == ["r stay at level 0: LLVM is out of sorts"]
    assert not library["r"].provisional
    assert np.array_equal(results(library["r"], LINKS), expected)


def test_whoever_asks_for_a_level_gets_it_at_once(jobs):
    for level in (0, 2):
        functions = backend.backend("llvm", level, NONE).functions(LINKS.layout)
        functions.add({"r": LINKS.outputs})
        assert not functions["r"].provisional
    functions = backend.backend("llvm", cache=NONE).functions(LINKS.layout)
    functions.add({"r": LINKS.outputs})
    functions.add({"energy": [LINKS.energy]})
    assert functions["r"].provisional and not functions["energy"].provisional


@pytest.mark.parametrize("level", ["0", "2"])
def test_the_environment_asks_for_a_level_too(monkeypatch, jobs, level):
    monkeypatch.setenv(backend.LEVEL, level)
    functions = backend.backend("llvm", cache=NONE).functions(LINKS.layout)
    functions.add({"r": LINKS.outputs})
    assert not functions["r"].provisional and functions.builds[0].level == int(level)
    monkeypatch.setenv(backend.LEVEL, "fast")
    with pytest.raises(mbd.CapabilityError, match="0, 1, 2 or 3; 'fast' came"):
        backend.backend("llvm")


# runs -------------------------------------------------------------------------------------------------------------


def walk(monkeypatch, jobs, when, hasty=0):
    """A walk of 0.9 s in which level 2 comes before call number `when` of the kernel."""
    for kept in ("_KNOWN", "_BY_WORDS"):
        monkeypatch.setattr(mechanisms, kept, type(getattr(mechanisms, kept))())
    monkeypatch.setattr(llvm, "MAX_QUICK_LINES", hasty)
    walker = kneed_walker()
    start = kneed_walker_start(walker)
    calls, advance = [], Stepper.advance

    def counting(stepper, until):
        calls.append(stepper.provisional)
        if len(calls) >= when:
            do(jobs)
        return advance(stepper, until)

    with monkeypatch.context() as patched:
        patched.setattr(Stepper, "advance", counting)
        trajectory = mbd.simulate(walker, start, mbd.HHT(0.05), dt=1e-3, until=0.9)
    record = trajectory.record
    numbers = [record.time, record.q, record.v, record.a, record.lam]
    events = [(event.time, event.name, event.kind, event.impulse.tobytes()) for event in trajectory.events]
    jobs.clear()
    return ([array.tobytes() for array in numbers], events), calls, trajectory.stats


def test_a_run_is_the_same_to_the_bit_whenever_the_code_is_exchanged(monkeypatch, jobs):
    entry()  # from the cache of the user; the programs from none
    monkeypatch.setattr(llvm, "default_cache", ObjectCache)
    whole, _, stats = walk(monkeypatch, jobs, 10**9, hasty=None)
    assert len(whole[1]) >= 3 and stats["optimized"]
    never, calls, stats = walk(monkeypatch, jobs, 10**9)
    assert all(calls) and not stats["optimized"]
    for when in (1, len(calls) // 2, len(calls) - 1):
        exchanged, _, stats = walk(monkeypatch, jobs, when)
        assert exchanged == never == whole
        assert stats["optimized"]


# processes --------------------------------------------------------------------------------------------------------

BEGIN = """
import os, sys, warnings
warnings.simplefilter("ignore")
import numpy as np
from mbd.compile import background
from tests.compile.test_background import hasty
from tests.compile.test_llvm import results
from tests.compile.chains import chain
links = chain(20)
library = hasty(links=links)
expected = results(library["r"], links)
assert library["r"].provisional
"""

ENDS = {
    "in order": ("print('end')", 0),
    "with an exit code": ("print('end', flush=True)\nsys.exit(3)", 3),
    "with a thread of its own": ("import threading\nthreading.Thread(target=print, args=('end',)).start()", 0),
    "at once": ("print('end', flush=True)\nos._exit(0)", 0),
}


def process(script):
    return subprocess.run(
        [sys.executable, "-c", BEGIN + script], cwd=Path(__file__).parents[2], capture_output=True, text=True,
        timeout=120,
    )  # fmt: skip


@pytest.mark.sampled(4)
@pytest.mark.parametrize("end", ENDS)
def test_a_process_may_end_while_code_is_made(end):
    script, code = ENDS[end]
    ended = process(script)
    assert (ended.stdout, ended.stderr, ended.returncode) == ("end\n", "", code)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are not forked here")
def test_a_forked_process_goes_on_with_the_work():
    ended = process("""
child = os.fork()
if child == 0:
    assert library["r"].provisional
    background.finish()
    assert not library["r"].provisional
    assert np.array_equal(results(library["r"], links), expected)
    os._exit(0)
assert os.waitpid(child, 0)[1] == 0
print("end")
""")
    assert (ended.stdout, ended.stderr, ended.returncode) == ("end\n", "", 0)
