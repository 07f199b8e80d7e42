"""What docs/extending.md adds to the library: a copy of the package with these files finds it as its own."""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import mbd
from mbd.kernel.schemes import contract

PAGE = Path(__file__).resolve().parents[1] / "docs" / "extending.md"
BLOCK = re.compile(r"^```python\n# (\S+)( of \w+)?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_a_new_joint_loss_measure_and_law_are_one_file_and_one_line(tmp_path):
    shutil.copytree(Path(mbd.__file__).parent, tmp_path / "mbd", ignore=shutil.ignore_patterns("__pycache__"))
    tests, added = [], []
    for title, _, code in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
        if title.startswith("mbd/"):
            path, name = tmp_path / title, re.search(r"^class (\w+)", code, re.MULTILINE)[1]
            path.write_text(code, encoding="utf-8")
            package = ".".join(path.parent.relative_to(tmp_path).parts)
            with (path.parent / "__init__.py").open("a", encoding="utf-8") as lines:
                lines.write(f"from {package}.{path.stem} import {name}\n")
            tests.append(f"from {package} import {name}")
            added.append(name)
        elif title == "test":
            tests.append(code)
    assert added == ["PinInSlot", "Root", "MountedDamper", "Clearance", "Clutch"]
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(tests)], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "change of energy" in done.stdout


def test_the_table_of_a_scheme_has_every_field_with_its_default():
    lines = re.findall(r"^\| (`.*?`) \| (.*?) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    told = {name.strip("`"): default.strip("`") for names, default in lines for name in names.split(", ")}
    known = {each.name: each.default for each in fields(contract.Scheme) if each.name != "abilities"}
    known |= {f"abilities.{each.name}": each.default for each in fields(contract.Abilities)}
    assert [*told] == [*known]
    plain = {name: repr(value) for name, value in known.items() if isinstance(value, int | float | str | tuple | None)}
    assert {name: told[name] for name in plain} == plain
