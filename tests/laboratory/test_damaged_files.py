"""Damaged files of every format: a named error, or numbers; one changed cell changes that number alone."""

import random
import warnings

import numpy as np
import pytest

import mbd
from tests.laboratory.test_read_mjcf import TEXT as MJCF
from tests.laboratory.test_read_model import ROBOT
from tests.laboratory.test_read_osim import document
from tests.laboratory.test_read_osim_muscles import muscles, with_muscle
from tests.laboratory.test_recordings import CSV, STO, TRC, trial, written

MODELS = {
    "leg.urdf": ROBOT, "leg.xml": MJCF, "old.osim": document("30000"), "new.osim": document("40000"),
    "muscle.osim": with_muscle("40000", muscles("40000")),
}  # fmt: skip
FILES = {"walk.trc": TRC, "walk.sto": STO, "walk.mot": STO, "walk.csv": CSV, "walk.c3d": None} | MODELS
DEFAULT, MANY = 25, 2000
"""Damaged files of each format, by default and where slow tests run."""
SIGNS = b"0123456789eE+-.,;\t\n\r <>/abcNn=\"'#\x00\xff"


def damaged(data, rng):
    """Bytes and lines changed, doubled, left out, the end cut off."""
    out = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        if not out:
            break
        at, kind = rng.randrange(len(out)), rng.randrange(6)
        if kind == 0:
            out[at] = rng.randrange(256)
        elif kind == 1:
            del out[at : at + rng.randint(1, 30)]
        elif kind == 2:
            out[at:at] = bytes(rng.choice(SIGNS) for _ in range(rng.randint(1, 5)))
        elif kind == 3:
            lines = bytes(out).split(b"\n")
            lines.insert(rng.randrange(len(lines)), rng.choice(lines))
            out = bytearray(b"\n".join(lines))
        elif kind == 4:
            digits = [k for k, byte in enumerate(out) if byte in b"0123456789.-"]
            if digits:
                out[rng.choice(digits)] = rng.choice(b"0123456789.-e ")
        elif rng.random() < 0.3:
            out = out[:at]
    return bytes(out)


def original(name, folder):
    if name != "walk.c3d":
        return FILES[name].encode()
    pytest.importorskip("ezc3d")
    return trial(np.random.default_rng(0)).save(folder / "given.c3d").read_bytes()


def judge(path):
    """Whether a file is refused by name; what is read holds numbers that belong together."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            if path.name in MODELS:
                model = mbd.read_model(path)
                assert model.report.understood
                assert all(np.isfinite(list(body.fields().values())).all() for body in model.bodies.values())
                return False
            found = mbd.read(path)
        except mbd.MbdError as error:
            refusal = str(error)
        else:
            refusal = ""
    if refusal:
        assert path.name in refusal or path.stem in refusal, refusal
        return True
    assert np.all(np.isfinite(found.time)) and np.all(np.diff(found.time) > 0.0)
    for values in [*found.markers.values(), *found.channels.values()]:
        assert len(values) == len(found.time) and not np.isinf(values).any()
    return False


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("count", [DEFAULT, pytest.param(MANY, marks=pytest.mark.slow)])
def test_a_damaged_file_gives_a_named_error_or_numbers(tmp_path, name, count):
    if name == "leg.xml":
        pytest.importorskip("mujoco")
    data, rng = original(name, tmp_path), random.Random(f"{name} {count}")
    refused = sum(judge(written(tmp_path, name, damaged(data, rng))) for _ in range(count))
    assert 0.1 * count < refused <= count


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("name", ["walk.trc", "walk.sto"])
def test_a_cell_that_changes_changes_that_number_alone(tmp_path, name, seed):
    rng = random.Random(seed)
    text, first = {"walk.trc": (TRC, 7), "walk.sto": (STO, 7)}[name]
    lines = text.split("\n")
    cells = {(k, c) for k in range(first, len(lines)) for c, cell in enumerate(lines[k].split("\t")) if cell and c > 1}
    line, column = rng.choice(sorted(cells))
    row, value = lines[line].split("\t"), round(rng.uniform(1.0, 900.0), rng.randint(0, 6))
    row[column] = rng.choice(["{}", "{:e}", "+{}", "0{}", "{:.12g}"]).format(value)
    lines[line] = "\t".join(row)
    before = mbd.read(written(tmp_path, name, text))
    after = mbd.read(written(tmp_path, name, "\n".join(lines)))
    changed = 0
    for known in (before.markers, before.channels):
        for key, values in known.items():
            different = ~((values == after[key]) | (np.isnan(values) & np.isnan(after[key])))
            changed += int(different.sum())
            for number in after[key][different]:
                scale = 1e-3 if name == "walk.trc" else np.radians(1.0) if key == "knee_angle_r" else 1.0
                assert number == pytest.approx(float(row[column]) * scale, rel=1e-14)
    assert changed == 1
