"""Runs whose rows would not fit into memory."""

import subprocess
import sys
import warnings

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd import free_memory as free
from mbd.simulation.run import data as running, room
from mbd.simulation.tolerance import calibrate as tolerance
from tests.simulation.mechanisms import falling


def stiff():
    """A mass on a spring of 10⁹ N/m, which shakes 5000 times a second."""
    model, body = falling(mass=1.0)
    model.apply(mbd.Spring("spring", model.ground.origin, body.origin, stiffness=1e9, length=1.0))
    return model, mbd.assemble(model, {"fall.displacement": 1.001})


def test_a_run_that_fills_the_memory_is_predicted_and_ends_with_its_rows(monkeypatch):
    monkeypatch.setattr(room, "available", lambda: 4.0 * 8 * 5 * 150_000)  # 150 000 rows of 5 numbers are a quarter
    model, start = stiff()
    with (
        pytest.warns(UserWarning, match=r"at this rate the run will have about .* rows|which take .*will be ended"),
        pytest.raises(mbd.MemoryLimitError, match=r"a quarter of the free memory; the whole run needs about") as told,
    ):
        mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-6, until=5.0)
    found = told.value.run
    assert 100_000 < len(found) < 250_000 and 0.0 < found.time[-1] < 5.0 and not found.success
    assert np.all(np.isfinite(found["fall.displacement"]))
    assert any("at this rate" in note for note in found.stats["notes"])


def test_a_finer_trial_run_that_has_no_room_is_not_begun(monkeypatch):
    """The pilot fits; what it tells of the next run is enough to stop there, with the pilot's rows."""
    monkeypatch.setattr(room, "available", lambda: 4.0 * 8 * 5 * 2_000)
    model, start = stiff()
    with pytest.raises(
        mbd.MemoryLimitError, match=r"about .* steps would be needed, which take .* whose rows take"
    ) as told:
        mbd.simulate(model, start, mbd.HHT(0.05), tol=1e-6, until=1.5e-3)
    assert told.value.run.time[-1] == pytest.approx(1.5e-3)


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.Newmark()], ids=str)
def test_a_tolerance_that_needs_too_many_steps_is_refused_after_a_small_part_of_them(scheme, monkeypatch):
    monkeypatch.setattr(room, "available", lambda: 4.0 * 8 * 5 * 2e6)
    model, start = stiff()
    with pytest.raises(mbd.MemoryLimitError, match="steps would be needed, which take about") as told:
        mbd.simulate(model, start, scheme, tol=1e-7, until=2.0)
    needed = float(str(told.value).split("about ")[1].split(" ")[0])
    taken = sum(trial["steps"] for trial in told.value.run.stats["tolerance"]["runs"])
    assert needed > 4e6 and taken < 0.1 * needed and "RungeKutta853" in str(told.value)


@settings(max_examples=3, deadline=None)
@given(
    stiffness=st.floats(1e3, 1e5),
    tol=st.sampled_from([1e-5, 1e-6]),
    scheme=st.sampled_from([mbd.HHT(0.05), mbd.Newmark()]),
)
def test_a_tolerance_takes_the_steps_that_loose_runs_foresee_or_more(stiffness, tol, scheme):
    model, body = falling(mass=1.0)
    model.apply(mbd.Spring("spring", model.ground.origin, body.origin, stiffness=stiffness, length=1.0))
    start = mbd.assemble(model, {"fall.displacement": 1.001})

    def refused():
        with pytest.raises(mbd.MemoryLimitError) as told:
            mbd.simulate(model, start, scheme, tol=tol, until=1.0)
        return float(str(told.value).split("about ")[1].split(" ")[0])

    taken = mbd.simulate(model, start, scheme, tol=tol, until=1.0).stats
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(room, "available", lambda: 4.0 * 8 * 5 * 200.0)
        patch.setattr(room, "EARLIEST", 64)
        patch.setattr(tolerance, "MANY_ROWS", 100)
        needed = refused()
    reached = taken["steps"] * (taken["tolerance"]["estimated"] / tol) ** 0.5
    assert 0.05 < needed / reached < 2.0  # less where errors of loose runs have the size of the motion


def test_a_run_that_fits_says_nothing():
    model, start = stiff()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-6, until=0.2)
    assert len(found) == 200_001 and not any("at this rate" in note for note in found.stats["notes"])
    assert room.available() > 1e6 and room.memory(3.21e9) == "3.2 GB" and room.memory(4.5e7) == "45 MB"


# memory that is refused ----------------------------------------------------------------------------------------------
SHORT = """
import resource, sys
import numpy as np
import mbd
from mbd import free_memory as free
from mbd.simulation.run import room, data as running
from tests.simulation.mechanisms import falling

model, _ = falling(mass=1.0)
mbd.simulate(model, mbd.assemble(model), dt=1e-3, until=0.1)  # all is loaded
running.FIRST_TABLE = 1 << 20
room.available = lambda: 1e12  # nobody foresees it
def pages():
    return int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (pages() + (int(sys.argv[1]) << 20),) * 2)
try:
    mbd.simulate(model, mbd.assemble(model), dt=1e-6, until=10.0)
except mbd.MemoryLimitError as error:
    rows = len(error.run)
    assert "no memory left" in str(error) and "use store=" in str(error), error
    assert rows > 30_000 and not error.run.success
    assert np.isfinite(error.run.time[-1]) and error.run.time[-1] == error.run.final.time
    print("kept")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="limits of the address space are those of Linux")
@pytest.mark.parametrize("megabytes", [24, 80])
def test_a_run_that_is_refused_memory_keeps_its_rows(megabytes):
    ended = subprocess.run([sys.executable, "-c", SHORT, str(megabytes)], capture_output=True, text=True, timeout=300)
    assert ended.stdout == "kept\n", ended.stderr[-2000:]


def test_an_exhausted_memory_in_a_users_function_ends_the_run_with_its_rows():
    model, start = stiff()

    def observer(time, state):
        if time > 0.0:
            raise MemoryError

    with pytest.raises(mbd.SimulationError) as told:
        mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-4, until=50.0, observers=[observer])
    assert len(told.value.run) > 1


def test_a_long_run_lays_out_no_more_than_it_fills(monkeypatch):
    model, start = stiff()
    seen = []
    run = mbd.simulate(
        model, start, mbd.HHT(0.05), dt=1e-6, until=1e3, on_failure="return",
        observers=[lambda time, state: seen.append(time) or (_ for _ in ()).throw(KeyboardInterrupt)],
    )  # fmt: skip
    assert seen and run.record.q.base.nbytes <= running.FIRST_TABLE
    one = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-5, until=1.0)
    monkeypatch.setattr(running, "FIRST_TABLE", 1 << 10)
    other = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-5, until=1.0)
    assert one["fall.displacement"].tobytes() == other["fall.displacement"].tobytes()


@pytest.mark.parametrize("leave", [KeyboardInterrupt, SystemExit(3)], ids=["interrupt", "exit"])
def test_whoever_ends_the_process_from_a_run_gets_its_rows_first(leave):
    model, start = stiff()

    def observer(time, state):
        if time > 0.0:
            raise leave

    with pytest.raises(mbd.SimulationError, match="interrupted at t = .*everything until then is kept") as told:
        mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-5, until=50.0, observers=[observer])
    assert len(told.value.run) > 1 and told.value.run.final.time == told.value.run.time[-1]
    assert told.value.__cause__ is (leave if isinstance(leave, SystemExit) else None)


# what the system tells ---------------------------------------------------------------------------------------------
def files(folder, **contents):
    for name, text in contents.items():
        folder.mkdir(parents=True, exist_ok=True)
        (folder / name.replace("__", ".")).write_text(f"{text}\n")


@pytest.fixture
def system(tmp_path, monkeypatch):
    """A machine with 8 GB free, in files of a test."""
    monkeypatch.setattr(free, "PROC", tmp_path / "proc")
    monkeypatch.setattr(free, "CGROUPS", tmp_path / "groups")
    files(tmp_path / "proc", meminfo="MemTotal: 1 kB\nMemAvailable: 8000000 kB")
    files(tmp_path / "proc" / "self", cgroup="0::/box/inner", statm="1000 500 100 1 0 600 0")
    return tmp_path


def test_limits_of_control_groups_count(system):
    assert free.available() == pytest.approx(8.192e9)
    files(system / "groups", memory__max="max", memory__current="77")
    files(system / "groups" / "box", memory__max="3000000000", memory__current="1000000000")
    assert free.available() == pytest.approx(2e9), "of the group around"
    files(system / "groups" / "box", memory__stat="anon 5\ninactive_file 400000000\nactive_file 7")
    assert free.available() == pytest.approx(2.4e9), "files in memory are given back"
    files(system / "groups" / "box" / "inner", memory__max="500000000", memory__current="600000000")
    assert free.available() == 0.0


def test_limits_of_older_control_groups_count(system):
    files(system / "proc" / "self", cgroup="5:cpu:/x\n4:memory,hugetlb:/box\n0::/")
    files(system / "groups" / "memory" / "box", memory__limit_in_bytes="700000000", memory__usage_in_bytes="100000000")
    assert free.available() == pytest.approx(6e8)
    files(system / "groups" / "memory" / "box", memory__limit_in_bytes=str((1 << 63) - 4096))
    assert free.available() == pytest.approx(8.192e9)


def test_a_limit_of_the_address_space_counts(system, monkeypatch):
    resource = pytest.importorskip("resource")
    limits = {resource.RLIMIT_AS: (1_000_000_000, -1), resource.RLIMIT_DATA: (resource.RLIM_INFINITY,) * 2}
    monkeypatch.setattr(resource, "getrlimit", limits.get)
    page = resource.getpagesize()
    assert free.available() == pytest.approx(1e9 - 1000 * page)


def test_a_system_that_tells_nothing_is_taken_to_have_some(system):
    for file in (system / "proc" / "meminfo", system / "proc" / "self" / "cgroup", system / "proc" / "self" / "statm"):
        file.unlink()
    assert free.available() == free.ASSUMED_BYTES
