"""Settings of every test: seeded random examples, no window, interrupts that arrive, and what keeps the suite quick."""

import gc
import os
import re
import signal
import sys
from collections import Counter
from pathlib import Path

os.environ.setdefault("MPLBACKEND", "Agg")
# one worker a core: threads of BLAS, of each worker on every core, wait for each other in loops that keep cores busy
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# many mechanisms, short runs: what takes least to compile; all levels give the same bits (kernel/test_levels.py)
os.environ.setdefault("MBD_OPTIMIZATION_LEVEL", "0")

import pytest

rewriting, sys.meta_path[:] = sys.meta_path[:], [finder for finder in sys.meta_path if not hasattr(finder, "session")]
from hypothesis import HealthCheck, settings  # noqa: E402  (its assertions are not rewritten: 5 s in every process)

sys.meta_path[:] = rewriting

# where SIGINT is ignored (nohup, jobs in the background), it is not so for the tests and the processes they start
signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile(
    "ci",
    derandomize=True,
    deadline=None,
    max_examples=16,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much],
)
settings.register_profile("thorough", parent=settings.get_profile("ci"), derandomize=False, max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))


WITHOUT_KERNEL = ("test_layers.py", "tape", "topology", "bodies", "equations", "forces")
"""Parts of the tests that call no compiled kernel, or seldom, those last."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Files in one piece to the workers, which share what they derive and compile; the idle takes from the busy."""
    from xdist.scheduler import WorkStealingScheduling

    return WorkStealingScheduling(config, log) if config.option.dist == "load" else None


@pytest.hookimpl(tryfirst=True, specname="pytest_collection_modifyitems")
def pytest_thin_out(items):
    """Leave some cases of tests marked `covering` or `sampled`; the others are slow."""
    covering = [item for item in items if item.get_closest_marker("covering")]
    named = {item: item.nodeid.split("[")[0] for item in items}
    values = {item: {(named[item], *each) for each in _parameters(item)} for item in covering}
    seen, chosen = set(), set()
    for enough in (set.isdisjoint, lambda these, known: not these <= known):  # diagonals of the table, then the rest
        for item in covering:
            if enough(values[item], seen):
                chosen.add(item)
                seen |= values[item]
    counts = Counter()
    for item in items:
        if sampled := item.get_closest_marker("sampled"):
            if counts[named[item]] % sampled.args[0] == 0:
                chosen.add(item)
            counts[named[item]] += 1
        if item not in chosen and (sampled or item in values):
            item.add_marker("slow")


def _parameters(item):
    return [(name, id(value)) for name, value in item.callspec.params.items()]


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    """Put what needs no kernel in the middle: there the second of two workers begins, while the first builds it."""
    if moving := [item.nodeid for item in items if re.search(r"0x[0-9a-f]{8}", item.nodeid)]:
        raise pytest.UsageError(f"no two workers would agree on names with addresses; give ids to {moving[0]}")
    if len(items) < 1000:
        return
    tests = Path(__file__).parent
    parts = {tests / part: place for place, part in enumerate(WITHOUT_KERNEL)}
    place = {item: min(parts.get(item.path, 99), parts.get(item.path.parent, 99)) for item in items}
    free = sorted([item for item in items if place[item] < 99], key=place.__getitem__)
    others = [item for item in items if place[item] == 99]
    half = len(items) // 2
    items[:] = others[:half] + free + others[half:]


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Collect without the garbage collector, which then leaves alone what lives as long as the tests do anyway.

    Thousands of collected items would else be gone through again and again: a quarter of the time of collecting them
    and a twentieth of that of the tests.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.fixture
def older_objects_left_alone():
    """Garbage collections do not search what earlier tests left, which takes seconds."""
    gc.freeze()


MECHANISMS_KEPT = 32
"""How many mechanisms of a file wait for its next test; most are small."""
LAST_FILE = [None]
"""Whose test came last."""


@pytest.fixture(autouse=True)
def _no_mechanisms_of_other_files(request):
    """Tests of a file share what they derive, but those that replace parts of the library itself derive their own."""
    replaces = "monkeypatch" in request.fixturenames
    known = sys.modules.get("mbd.compile.mechanisms")
    if known and (replaces or request.node.path != LAST_FILE[0]):
        known._BY_WORDS.clear()
        known.MAX_KEPT_BY_WORDS = MECHANISMS_KEPT
    LAST_FILE[0] = request.node.path
    yield
    if replaces and (known := sys.modules.get("mbd.compile.mechanisms")):
        known._BY_WORDS.clear()


@pytest.fixture
def made_afresh(monkeypatch):
    """Programs are made from their equations, whatever is remembered: for tests that change how they are made."""
    monkeypatch.setattr("mbd.compile.remembered.ENABLED", False)
