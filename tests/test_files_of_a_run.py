"""What docs/files.md says of files is what is in them, and the record keeps its schema."""

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import mbd
from mbd.view.report import record
from tests.view.handmade_runs import ball, walker

DOCS = Path(__file__).parent.parent / "docs"
TEXT = (DOCS / "files.md").read_text(encoding="utf-8")
SCHEMA = json.loads((DOCS / "record.schema.json").read_text(encoding="utf-8"))


def fields(title: str) -> set[str]:
    """First column of the table with this head."""
    [table] = re.findall(rf"^\| {re.escape(title)} \| meaning \|\n\|---\|---\|\n((?:\|.*\n?)+)", TEXT, re.M)
    return {name for line in table.splitlines() for name in re.findall(r"`([^`]+)`", line.split(" | ")[0])}


@pytest.mark.parametrize("make", [walker, ball])
def test_the_record_keeps_its_schema(make, tmp_path):
    jsonschema = pytest.importorskip("jsonschema")
    script = tmp_path / "walk.py"
    script.write_text("x = 1\n")
    commit = ["-c", "user.name=a", "-c", "user.email=a", "commit", "-qm", "a"]
    for command in (["init", "-q"], ["add", "walk.py"], commit):
        subprocess.run(["git", "-C", str(tmp_path), *command], check=True, capture_output=True, timeout=60)
    found = json.loads(json.dumps(record(make(), {"load": 0.1, "simulate": 0.2}, script), default=float))
    jsonschema.validate(found, SCHEMA)
    assert set(found) == fields("field")


def test_the_schema_has_the_fields_of_the_page():
    assert set(SCHEMA["properties"]) == fields("field")


def test_the_file_of_a_run_has_the_words_and_arrays_of_the_page(tmp_path):
    model, body = mbd.Model("ball"), mbd.PointMass("ball", mass=1.0)
    model.connect(mbd.Prismatic("fall", model.ground.origin, body.origin, axis="y", loss=mbd.Viscous(0.1)))
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin)))
    start = mbd.assemble(model, {"fall.displacement": 0.1})
    run = mbd.simulate(model, start, dt=1e-2, until=0.3, backend="python")
    with np.load(run.save(tmp_path / "run"), allow_pickle=False) as file:
        words = json.loads(file["meta"].tobytes())
        arrays = {re.sub(r" \d+$", " 0", name) for name in file.files}
    told = fields("array")
    assert set(words) == fields("word of `meta`")
    assert {name for name in arrays if not name.startswith("graph")} - {"meta", "hash"} <= told
    assert (words["format"], words["version"]) == ("mbd run", 1)
