"""Files of studies: a file is taken for the study that wrote it alone, and only as that wrote it."""

import json
import random
import re
import subprocess
import sys
import threading
import types
from collections import OrderedDict
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import mbd
from mbd.results.identity import identity
from tests.gait.test_families import runner

STRENGTH = 1.0


def pendulum(torque=lambda t: 0.3 * mbd.sin(9.0 * t), words=(), loss=0.3):
    """A rod on a pin under a motor."""
    model, rod = mbd.Model("pendulum"), mbd.Link("rod", 1.0, 1.0, 0.5, 0.1)
    pin = mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Viscous(loss))
    model.connect(pin)
    model.apply(mbd.Motor("drive", pin, torque))
    for word in words:
        (model.apply if isinstance(word, mbd.Controller) else model.constrain)(word)
    return model


def swing(amount, power=1.0):
    """A result of a run."""
    return lambda run: amount * float(np.max(np.abs(run["pin.angle"]))) ** power


def stop(limit=0.9, **more):
    return mbd.Event("stop", mbd.measure(lambda angle: angle - limit, "pin.angle"), **more)


def slowed(factor):
    """A controller whose update refers to a number."""
    return mbd.Controller("brake", lambda time, values, state: ({"pin loss.coefficient": factor * 0.3}, state),
                          period=0.05, reads=(), writes="pin loss.coefficient", state=0)  # fmt: skip


def of_module(run):
    return STRENGTH * float(run["pin.angle"][-1])


STUDIES = {
    "first": {},
    "start": {"angle": 0.2},
    "function that starts": {"angle": lambda p: mbd.assemble(pendulum(), {"pin.angle": 0.2})},
    "law": {"model": lambda: pendulum(lambda t: 0.3 * mbd.sin(8.0 * t))},
    "table": {"model": lambda: pendulum(mbd.Samples((0.0, 9.0), (0.0, 0.5)))},
    "other table": {"model": lambda: pendulum(mbd.Samples((0.0, 9.0), (0.0, 0.6)))},
    "event": {"model": lambda: pendulum(words=[stop()])},
    "event that ends": {"model": lambda: pendulum(words=[stop(terminal=True)])},
    "guard": {"model": lambda: pendulum(words=[stop(0.8, terminal=True)])},
    "reset": {"model": lambda: pendulum(words=[stop(reset={"pin.angle.rate": 0.0})])},
    "controller": {"model": lambda: pendulum(words=[slowed(1.0)])},
    "other controller": {"model": lambda: pendulum(words=[slowed(2.0)])},
    "value": {"model": lambda: pendulum(loss=0.4)},
    "function": {"results": {"swing": swing(1.0)}},
    "what a function has captured": {"results": {"swing": swing(2.0)}},
    "default of a function": {"results": {"swing": swing(1.0, power=2.0)}},
    "module of a function": {"results": {"swing": of_module}},
    "partial": {"results": {"swing": partial(lambda scale, run: scale * run["pin.angle"][-1], 3.0)}},
    "other partial": {"results": {"swing": partial(lambda scale, run: scale * run["pin.angle"][-1], 4.0)}},
    "setting": {"until": 0.3},
    "scheme": {"integrator": mbd.RadauIIA()},
    "parameter": {"parameters": {"rod.center": 0.4}},
}


def study(file, model=pendulum, angle=1.0, results=("pin.angle",), **settings):
    """A sweep of a study: its table."""
    made = model()
    start = angle if callable(angle) else mbd.assemble(made, {"pin.angle": angle}, backend="python")
    settings = {"dt": 5e-2, "until": 0.1, "backend": "python", **settings}
    return mbd.sweep(made, {"rod.mass": [1.1, 2.0]}, start, results, file=file, **settings)


def test_no_study_takes_the_file_of_another(tmp_path):
    for name, one in STUDIES.items():
        study(tmp_path / f"{name}.jsonl", **one)
    heads = {name: json.loads((tmp_path / f"{name}.jsonl").read_text().splitlines()[0]) for name in STUDIES}
    assert len({json.dumps(head, sort_keys=True) for head in heads.values()}) == len(STUDIES)
    for name, one in STUDIES.items():
        file = tmp_path / f"{name}.jsonl"
        before = file.read_bytes()
        np.testing.assert_array_equal(study(file, **one)["success"], [True, True])
        assert file.read_bytes() == before, f"{name}: the same study has made its runs again"
    for name in list(STUDIES)[1:]:
        with pytest.raises(mbd.ModelError, match="belongs to another sweep, with other .*; give another name"):
            study(tmp_path / f"{name}.jsonl")


def test_a_value_that_a_function_finds_by_its_name_counts(tmp_path, monkeypatch):
    study(tmp_path / "a", results={"swing": of_module})
    monkeypatch.setattr(sys.modules[__name__], "STRENGTH", 2.0)
    with pytest.raises(mbd.ModelError, match="with other functions of the run"):
        study(tmp_path / "a", results={"swing": of_module})


def test_another_process_knows_the_study_again(tmp_path):
    file = tmp_path / "a.jsonl"
    study(file, model=partial(pendulum, words=[slowed(1.0), stop()]), results={"swing": swing(1.0)})
    code = (
        "from functools import partial; from tests.analysis.test_study_files import *\n"
        f"study({str(file)!r}, model=partial(pendulum, words=[slowed(1.0), stop()]), results={{'swing': swing(1.0)}})"
    )
    before = file.read_bytes()
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)
    assert file.read_bytes() == before


@pytest.mark.parametrize("seed", range(6))
def test_a_line_that_was_changed_is_named(tmp_path, seed):
    """Any byte of a whole line; the end of the file may be missing."""
    file, rng = tmp_path / "a.jsonl", random.Random(seed)
    table = study(file)
    content = bytearray(file.read_bytes())
    lines = content.splitlines(keepends=True)
    for _ in range(30):
        place = rng.randrange(len(lines[0]), len(content) - 1)
        damaged = content.copy()
        damaged[place] = rng.choice(b'0123456789[]{},"x\xff')
        file.write_bytes(damaged)
        if damaged != content:
            with pytest.raises(mbd.ModelError, match="line [23] of .* is not as it was written; take the line out"):
                study(file)
            assert file.read_bytes() == damaged
    file.write_bytes(content[: -rng.randrange(1, len(lines[-1]))])
    np.testing.assert_array_equal(study(file)["pin.angle"], table["pin.angle"])
    assert file.read_bytes() == content


@pytest.mark.parametrize("line", [b"[" * 100_000 + b"\n", b'{"case": 3}\n', b"\x00" * 40 + b"\n", b"\n"])
def test_lines_that_no_study_writes_are_named(tmp_path, line):
    file = tmp_path / "a.jsonl"
    study(file)
    with file.open("ab") as end:
        end.write(line)
    with pytest.raises(mbd.ModelError, match="line 4 of"):
        study(file)


def test_a_line_of_another_study_is_no_line_of_this_one(tmp_path):
    one, other = tmp_path / "one.jsonl", tmp_path / "other.jsonl"
    study(one), study(other, angle=0.2)
    lines = other.read_bytes().splitlines(keepends=True)
    one.write_bytes(one.read_bytes() + lines[1])
    with pytest.raises(mbd.ModelError, match="line 4 of"):
        study(one)


def test_a_disk_that_is_full_at_the_start_is_an_error():
    with pytest.raises(mbd.TrajectoryError, match="'/dev/full' cannot be written: No space left on device"):
        study("/dev/full")


def test_a_disk_that_is_full_later_costs_no_run(tmp_path, monkeypatch):
    from mbd.results.study_file import StudyFile

    write = StudyFile._write

    def full(self, line, mode):
        if mode == "a":
            raise OSError(28, "No space left on device")
        write(self, line, mode)

    monkeypatch.setattr(StudyFile, "_write", full)
    with pytest.warns(mbd.MbdWarning, match="No space left .* in the result of this sweep alone"):
        assert study(tmp_path / "a")["success"].all()


def test_digests_follow_from_what_things_are():
    assert identity({"a": 1}) == identity({"a": 1}) != identity({"a": 1.0})
    assert identity(np.arange(3.0)) != identity(np.arange(3)) != identity([0, 1, 2])
    assert (
        identity(np.random.default_rng(1)) == identity(np.random.default_rng(1)) != identity(np.random.default_rng(2))
    )
    assert identity(np.sin) != identity(np.cos)
    assert identity({3, 1, 2}) == identity({1, 2, 3})


MODULE = """
from dataclasses import dataclass
from functools import lru_cache
import {beside} as beside
class Law:
    sizes, kin = [{1}], {{"a": ({2},)}}
    def __call__(self, run): return self.sizes[0]
class Heir(Law):
    gain = property(lambda self: {3})
@dataclass
class Foot:
    moved: float
def of_import(run):
    import {beside}
    return {beside}.GAIN
def of_from(run):
    from {beside} import GAIN as gain
    return gain
def of_module(run): return beside.GAIN
@lru_cache
def of_cache(run): return {4}
"""
MADE = {
    "import in a function": (0, lambda own: own.of_import), "from in a function": (0, lambda own: own.of_from),
    "module beside": (0, lambda own: own.of_module), "list of a class": (1, lambda own: own.Law()),
    "dictionary of a class": (2, lambda own: own.Law), "class between": (3, lambda own: own.Heir()),
    "method of an object": (1, lambda own: own.Law().__call__), "decorated": (4, lambda own: own.of_cache),
    "a field 'moved'": (5, lambda own: own.Foot(own.NUMBERS[5])),
    "captured list": (5, lambda own: partial(max, [own.NUMBERS[5]])),
}  # fmt: skip
"""What a function of a user's module refers to, by the place of its number."""


@pytest.mark.parametrize("where", ["a script", "an installed package", "__main__ of cProfile"])
@pytest.mark.parametrize("what", MADE)
def test_everything_that_a_function_refers_to_counts(what, where, tmp_path, monkeypatch):
    import cProfile

    place, make = MADE[what]
    path = {"a script": tmp_path}.get(where, Path(np.__file__).parents[1])
    name = "__main__" if where.startswith("__main__") else "own_study_words"

    def digest(numbers):
        own, beside = types.ModuleType(name), types.ModuleType("own_words_beside")
        beside.GAIN, own.NUMBERS = numbers[0], numbers
        own.__file__ = str(path / "words.py")
        monkeypatch.setitem(sys.modules, "own_words_beside", beside)
        monkeypatch.setitem(sys.modules, name, own)
        exec(MODULE.format(*numbers, beside="own_words_beside"), own.__dict__)
        if name == "__main__":  # whose globals are those of the script, while the module is that of the profiler
            monkeypatch.setitem(sys.modules, name, cProfile)
        return identity(make(own))

    numbers = [0.5] * 6
    other = [0.75 if k == place else number for k, number in enumerate(numbers)]
    assert digest(numbers) == digest([*numbers]) != digest(other)


def test_runs_that_a_function_has_captured_count_with_their_parameters():
    model = mbd.Model("still", gravity=(0.0, 0.0, 0.0))
    rod = mbd.Link("rod", 1.0, 1.0, 0.5, 0.1)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))
    start = mbd.assemble(model, backend="python")
    made = [
        mbd.simulate(model, start, dt=0.1, until=0.2, backend="python", parameters={"rod.mass": mass})
        for mass in (1.1, 1.1, 1.2)
    ]
    one, again, other = (identity(lambda run, seen=run: run.t - seen.t) for run in made)
    assert one == again != other


@pytest.mark.parametrize(
    "unknown", [threading.Lock(), (x for x in "ab"), lambda run: eval("run"), lambda run: vars(run), sys.stdout]
)
def test_what_cannot_be_read_is_refused_by_name(unknown, tmp_path):
    with pytest.raises(mbd.ModelError, match="file: the study depends on <.*nobody can tell whether .*leave file= out"):
        study(tmp_path / "a", results={"swing": lambda run: unknown})
    study(tmp_path / "b", results={"swing": lambda run: 1.0})


def test_runs_count_as_the_same_whether_their_equations_were_derived_or_remembered(monkeypatch):
    def digest(remembers):
        monkeypatch.setattr("mbd.compile.remembered.ENABLED", remembers)
        monkeypatch.setattr("mbd.compile.mechanisms._BY_WORDS", OrderedDict())
        model = pendulum()
        return identity(mbd.simulate(model, mbd.assemble(model, {"pin.angle": 0.3}), dt=0.01, until=0.1))

    assert len({digest(remembers) for remembers in (True, True, False)}) == 1


def test_gaits_and_mechanisms_that_a_function_has_captured_count_whatever_was_done_with_them():
    """A start from a gait nearby: `start=lambda p: gait.at(p).state`."""

    def found(energy):
        return mbd.limit_cycle(*runner(), section="apex", energy=energy)

    def digest(gait):
        return identity(lambda p: gait.at(p).state)

    one, again, other = map(found, (1800.0, 1800.0, 1860.0))
    before = digest(one)
    assert again.at({"leg.stiffness": 20.1e3}).success and again.derivatives["period", "leg.stiffness"]
    assert digest(again) == digest(one) == before != digest(other)
    swings = [mbd.linearize(pendulum(loss=loss), mbd.assemble(pendulum())) for loss in (0.3, 0.3, 0.4)]
    assert identity(swings[0]) == identity(swings[1]) != identity(swings[2])


def test_a_module_of_the_user_with_a_name_of_pythons_is_read(tmp_path, monkeypatch):
    def digest(strength):
        own = types.ModuleType("profile")
        own.__file__ = str(tmp_path / "profile.py")
        monkeypatch.setitem(sys.modules, "profile", own)
        exec(f"def swing(run): return {strength}", own.__dict__)
        return identity(own.swing)

    assert digest(1.0) == digest(1.0) != digest(2.0)


def test_what_a_table_of_pythons_pickles_is_read():
    assert identity(re.compile("a")) == identity(re.compile("a")) != identity(re.compile("b"))


def test_the_error_names_what_a_function_reaches_others_by():
    with pytest.raises(mbd.ModelError, match="<function .*uses 'getattr', of which nobody"):
        identity(lambda run: getattr(run, "time"))  # noqa: B009
    assert identity(lambda run: run.dir) != identity(lambda run: run.open)  # attributes of these names are read
