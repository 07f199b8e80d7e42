"""Files of runs changed in every way: bytes, members, kinds, shapes, numbers, words; with their hash or a new one.

``python -m tests.simulation.mutations 0 2000`` changes files with these seeds; a process that ends otherwise than with
a return code of 0 is a fault.
"""

import io
import json
import random
import sys
import tempfile
import warnings
import zipfile
from collections import Counter
from contextlib import suppress
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import mbd
from mbd.results import archive
from mbd.results.trajectory import Trajectory
from mbd.simulation.run import remembered
from mbd.state import Memory, State

NUMBERS = (0, -1, 1, 2, 3, 17, -9, 1 << 31, 1 << 62, -(1 << 63))
REALS = (0.0, -1.0, 1e-300, 1e300, np.nan, np.inf, -np.inf, 0.37)
WORDS: tuple[Any, ...] = (None, True, -1, 1 << 70, 1e999, "", "x", "\x1b[2J", [], {}, [1, [2]], {"array": "q"})


@cache
def scene() -> tuple[mbd.Model, Trajectory, bytes]:
    """A driven crate that slips, hops and is switched by a clock, its run, and the file of that."""
    model = mbd.Model("crate")
    box = mbd.PointMass("box", mass=2.0)
    place = mbd.Translation("place", model.ground.origin, box.origin)
    model.connect(place)
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(box.origin), friction=0.3))
    model.constrain(mbd.Event("mark", mbd.measure("place.x", unit="m")))
    model.apply(mbd.Applied("push", box.origin, force=lambda t: (9.0 * mbd.sin(20.0 * t), 22.0 * mbd.sin(31.0 * t), 0)))
    start = mbd.assemble(model, {"place.x": -0.02, "place.y": 0.01}, velocity={"place.x": 0.3})
    run = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.8), dt=2e-3, until=0.6)
    with tempfile.TemporaryDirectory() as folder:
        return model, run, run.save(Path(folder) / "run").read_bytes()


def use(run: Trajectory, model: mbd.Model) -> mbd.Trajectory:
    """What anybody does with a run that was read, and the run that goes on from it."""
    repr(run)
    for name in run.names:
        run[name]
    run.at(np.linspace(run.time[0], run.time[-1], 7))["place.x"]
    repr(run.energy)
    repr(run.violation)
    repr(run.events)
    return mbd.simulate(
        model, run.final, mbd.GeneralizedAlpha(0.8), dt=2e-3, until=run.final.time + 0.05, on_failure="return"
    )


def changed_file(rng: random.Random) -> tuple[bytes, bool]:
    """The file with one change, and whether it has a hash that agrees with it."""
    content, hashed = scene()[2], False
    if rng.random() < 0.25:
        return _bytes(content, rng), hashed
    with zipfile.ZipFile(io.BytesIO(content)) as source:
        members = {name: source.read(name) for name in source.namelist()}
    arrays = {name.removesuffix(".npy"): np.load(io.BytesIO(text)) for name, text in members.items()}
    meta = json.loads(arrays.pop("meta").tobytes())
    old = arrays.pop("hash")
    if rng.random() < 0.5:
        name = rng.choice(sorted(arrays))
        array = _array(arrays[name], rng)
        if array is None:
            del arrays[name]
        else:
            arrays[name] = array
    else:
        _word(meta, rng)
    text = np.frombuffer(json.dumps(meta).encode(), dtype=np.uint8)
    hashes = {"meta": text}
    if rng.random() < 0.67 and not any(array.dtype.hasobject for array in arrays.values()):
        told = archive._hash({**arrays, "meta": text})
        hashes["hash"], hashed = np.frombuffer(told, dtype=np.uint8), True
    elif rng.random() < 0.8:
        hashes["hash"] = old
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as target:
        for name, array in {**arrays, **hashes}.items():
            buffer = io.BytesIO()
            np.lib.format.write_array(buffer, np.asarray(array), allow_pickle=True)
            target.writestr(f"{name}.npy", buffer.getvalue())
    return out.getvalue(), hashed


def _bytes(content: bytes, rng: random.Random) -> bytes:
    """Some bytes changed, cut off or doubled."""
    changed = bytearray(content)
    for _ in range(rng.choice((1, 1, 3, 40))):
        changed[rng.randrange(len(changed))] = rng.randrange(256)
    cut = rng.randrange(len(changed))
    return bytes(rng.choice((changed, changed, changed, content[:cut], content[cut:], changed + content)))


def _array(array: np.ndarray, rng: random.Random) -> np.ndarray | None:
    """Another array; None for none at all."""
    kind = rng.randrange(7)
    if kind == 0:
        return None
    if kind == 1:
        return array.astype(rng.choice((np.float32, np.int64, np.uint8, np.complex128, ">f8", "U3")))
    if kind == 2:
        return array.reshape(-1)[: rng.randrange(array.size + 1)]
    if kind == 3:
        return np.zeros(rng.choice(((), (3,), (2, 2), (1, 1, 1), (0, 5), (len(array) if array.ndim else 1, 99))))
    if kind == 4:
        return np.array([{"an": "object"}], dtype=object)
    changed = array.copy().reshape(-1)
    for _ in range(rng.choice((1, 1, 5)) if array.size else 0):
        place = rng.randrange(array.size)
        value = rng.choice(NUMBERS if array.dtype.kind in "iu" else REALS)
        with np.errstate(all="ignore"):
            changed[place] = np.array(value).astype(array.dtype)
    return changed.reshape(array.shape)


def _word(words: Any, rng: random.Random) -> None:
    """One entry somewhere in the words changed, added or left out."""
    while True:
        keys = list(words) if isinstance(words, dict) else list(range(len(words)))
        if not keys:
            return
        key = rng.choice(keys)
        inner = words[key]
        if isinstance(inner, dict | list) and inner and rng.random() < 0.85:
            words = inner
            continue
        if rng.random() < 0.3:
            del words[key]
        else:
            words[key] = rng.choice(WORDS)
        return


def changed_memory(state: State, rng: random.Random) -> tuple[State, bool]:
    """A state whose memory has other numbers, or another kind of something, and whether it is sealed again."""
    memory = state.memory
    assert memory is not None
    if rng.random() < 0.2:
        name = rng.choice([item.name for item in fields(Memory)])
        value = rng.choice(
            (None, 3, "x", (), ("a",), np.zeros(3), np.zeros((2, 2)), {}, {"samples": {}}, np.zeros(0, int))
        )
        memory = replace(memory, **{name: value})
    else:
        reals, integers = memory.reals.copy(), memory.integers.copy()
        for _ in range(rng.choice((1, 1, 4))):
            if rng.random() < 0.7:
                integers[rng.randrange(len(integers))] = rng.choice(NUMBERS)
            else:
                reals[rng.randrange(len(reals))] = rng.choice(REALS)
        memory = replace(memory, reals=reals, integers=integers)
    resealed = rng.random() < 0.7
    with suppress(AttributeError, TypeError, KeyError, ValueError):
        memory = remembered.sealed(memory) if resealed else memory
    return replace(state, memory=memory), resealed


def go_on(state: State) -> Trajectory:
    """The run of the scene from a state."""
    return mbd.simulate(
        scene()[0], state, mbd.GeneralizedAlpha(0.8), dt=2e-3, until=state.time + 0.05, on_failure="return"
    )


def outcome_of_file(seed: int, path: Path) -> str:
    """'refused', 'the same' as without the change, 'told' by a note, or 'another' motion."""
    content, hashed = changed_file(random.Random(seed))
    path.write_bytes(content)
    try:
        run = use(mbd.load(path), scene()[0])
    except mbd.TrajectoryError:
        return "refused"
    except mbd.ModelError:
        assert hashed
        return "refused"
    return _outcome(run, hashed)


def outcome_of_memory(seed: int) -> str:
    """The same for a state whose memory is changed."""
    state, resealed = changed_memory(scene()[1].final, random.Random(seed))
    try:
        return _outcome(go_on(state), resealed)
    except mbd.ModelError:
        return "refused"


@cache
def _unchanged() -> bytes:
    return go_on(scene()[1].final).final.q.tobytes()


def _outcome(run: Trajectory, by_design: bool) -> str:
    """What became of a run that went on; another motion is a fault unless the hash was made for it."""
    if any("damaged" in note for note in run.stats["notes"]):
        return "told"
    if run.final.q.tobytes() == _unchanged():
        return "the same"
    assert by_design, "another motion, in silence"
    return "another"


def main(seeds: range) -> None:
    """Every change is refused by name, told, or without effect."""
    told = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:
            print(seed, flush=True)
            told[outcome_of_file(seed, Path(folder) / "changed.mbd.npz")] += 1
            told[outcome_of_memory(seed)] += 1
    print(dict(told))
    print("done")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main(range(*map(int, sys.argv[1:3])))
