"""Files that were damaged or made up are refused by one named error, or what they hold goes on and is reported."""

import io
import subprocess
import sys
import tracemalloc
import zipfile
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

import mbd
from mbd.results import archive
from mbd.simulation.run import remembered
from mbd.state import Mode
from tests.simulation.mutations import go_on, outcome_of_file, outcome_of_memory, scene


def test_a_changed_file_is_refused_or_gives_the_same_run(tmp_path):
    told = Counter(outcome_of_file(seed, tmp_path / "changed.mbd.npz") for seed in range(80))
    assert told["refused"] > 40 and told["the same"] > 8


def test_a_changed_memory_is_told_and_the_motion_goes_on_without_it():
    told = Counter(outcome_of_memory(seed) for seed in range(80))
    assert told["told"] > 32 and told["the same"] > 8


@pytest.mark.slow
@pytest.mark.parametrize("part", range(4))
def test_ten_thousand_changes_end_no_process(part):
    words = [sys.executable, "-X", "faulthandler", "-m", "tests.simulation.mutations", str(2500 * part)]
    ended = subprocess.run([*words, str(2500 * (part + 1))], capture_output=True, text=True, timeout=3000, check=False)
    assert ended.returncode == 0 and ended.stdout.endswith("done\n"), ended.stdout[-200:] + ended.stderr[-2000:]


def test_what_a_run_remembers_itself_is_never_called_damaged():
    for pause in (0.013, 0.1, 0.237, 0.41, 0.6):
        run = mbd.simulate(scene()[0], scene()[1].final, mbd.GeneralizedAlpha(0.8), dt=2e-3, until=0.6 + pause)
        on = go_on(run.final)
        assert not any("damaged" in note for note in on.stats["notes"])
        assert on.final.memory is not None and on.success


def test_an_index_beyond_the_rows_restarts_the_scheme_and_says_so():
    final = scene()[1].final
    integers = final.memory.integers.copy()
    integers[:] = 1 << 40
    for memory in (
        replace(final.memory, integers=integers),
        remembered.sealed(replace(final.memory, integers=integers)),
        remembered.sealed(replace(final.memory, integers=integers[:-1])),
    ):
        run = go_on(replace(final, memory=memory))
        assert run.success and any("is damaged" in note and "restarted" in note for note in run.stats["notes"])
        np.testing.assert_allclose(run.final.q, go_on(final).final.q, atol=1e-5)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"anchors": np.zeros(7)}, "7 anchors"),
        ({"anchors": np.array([np.nan, 0.0])}, "anchor 0"),
        ({"anchors": "none"}, "anchors of the start must be an array"),
        ({"q": [[0.0, 1.0]]}, "q of the start must be an array"),
        ({"v": np.array(["a", "b"])}, "v of the start must be an array"),
        ({"mode": "floor"}, "mode of the start must be a Mode"),
        ({"mode": Mode(frozenset([3]))}, "mode of the start must be a Mode"),
        ({"armed": "floor"}, "armed of the start must be None or a frozenset"),
        ({"memory": 3}, "memory of the start must be that of a run"),
        ({"parameters": {"box.mass": "heavy"}}, "'box.mass' must be a finite number"),
        ({"names": 4}, "names of the start must be a tuple"),
    ],
    ids=str,
)
def test_a_state_of_the_wrong_kind_is_refused_by_name(changes, said):
    with pytest.raises(mbd.ModelError, match=said):
        go_on(replace(scene()[1].final, **changes))


def bomb(path, name: str, megabytes: int) -> None:
    """The file of the scene with one member, old or new, that is small in the file and large when it is read."""
    with zipfile.ZipFile(io.BytesIO(scene()[2])) as source, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:
        for known in source.namelist():
            if known != f"{name}.npy":
                target.writestr(known, source.read(known))
        with target.open(f"{name}.npy", "w") as member:
            kind = "u1" if name == "meta" else "f8"
            head = {
                "descr": np.dtype(kind).str,
                "fortran_order": False,
                "shape": (megabytes << (20 if name == "meta" else 17),),
            }
            np.lib.format.write_array_header_1_0(member, head)
            for _ in range(megabytes):
                member.write(bytes(1 << 20))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", ["meta", "time", "lam", "kinetic", "value 0", "state", "hash", "nothing"])
def test_a_small_file_that_would_fill_the_memory_is_not_opened(tmp_path, name, monkeypatch):
    monkeypatch.setattr(archive, "available", lambda: 60e6)
    path = tmp_path / "bomb.npz"
    if name == "state":  # one of those that the final state is made of
        with zipfile.ZipFile(io.BytesIO(scene()[2])) as source:
            name = next(known for known in source.namelist() if known.startswith("state ")).removesuffix(".npy")
    bomb(path, name, 80)
    assert path.stat().st_size < 200_000
    tracemalloc.start()
    if name == "nothing":  # nobody asks for it
        assert mbd.load(path).names == scene()[1].names
    else:
        with pytest.raises(mbd.TrajectoryError, match="is not a run of mbd"):
            mbd.load(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6


def test_a_run_too_large_for_the_memory_is_refused_with_its_size(tmp_path, monkeypatch):
    path = tmp_path / "run.npz"
    path.write_bytes(scene()[2])
    monkeypatch.setattr(archive, "available", lambda: 1e5)
    with pytest.raises(mbd.TrajectoryError, match=r"needs 1 MB of memory, of which 1 MB are free"):
        mbd.load(path)
