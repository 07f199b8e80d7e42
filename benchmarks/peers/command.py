"""``python -m benchmarks peers``: every scene in every system that is installed, in one run."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.figures import interleaved
from benchmarks.peers.race import Result
from benchmarks.peers.scenes import chosen
from benchmarks.peers.worker import DONE, MARK
from benchmarks.processes import output_of
from benchmarks.run import load
from benchmarks.startup import until_done

ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
PATIENCE = 1800.0
"""Seconds after which a system is given up."""
STARTS = 3
FIRST_STEP = """
from benchmarks.peers.scenes import Scene
from benchmarks.peers.systems.{module} import first_step
first_step(Scene("S1", "its first millisecond", 1e-3, 1e-3, ""))
"""


@dataclass(frozen=True)
class System:
    """A column of the table: its module here, and the packages that it needs."""

    name: str
    module: str
    packages: tuple[str, ...]
    starts: bool = True

    @property
    def is_installed(self) -> bool:
        return all(find_spec(package) is not None for package in self.packages)


SYSTEMS = (
    System("mbd", "own", ("mbd",)),
    System("by hand, numba", "compiled", ("numba", "scipy"), starts=False),
    System("by hand, scipy", "by_scipy", ("numba", "scipy"), starts=False),
    System("exudyn", "by_exudyn", ("exudyn",)),
    System("mujoco", "by_mujoco", ("mujoco",)),
    System("drake", "by_drake", ("pydrake",)),
    System("pinocchio", "by_pinocchio", ("pinocchio",)),
    System("dartpy", "by_dart", ("dartpy",)),
)


@dataclass(frozen=True)
class Comparison:
    """What a run gave: results, versions of the systems that took part, start-up times [s], systems left out.

    `machine` says on what, and how many processes wanted to run.
    """

    results: tuple[Result, ...]
    versions: dict[str, str]
    starts: dict[str, float]
    missing: tuple[str, ...]
    machine: str

    def save(self, path: Path) -> None:
        """Write as JSON."""
        path.write_text(json.dumps(asdict(self), indent=1) + "\n")

    @classmethod
    def load(cls, path: Path) -> Comparison:
        """Read what `save` wrote."""
        content = json.loads(path.read_text())
        results = tuple(Result(**result) for result in content.pop("results"))
        return cls(results, content["versions"], content["starts"], tuple(content["missing"]), content["machine"])


def compare(words: Sequence[str], record: Path | None = None, tell: Any = print) -> Comparison:
    """Run the scenes named (all without names) in every system that is installed; kept in a file after each system."""
    systems = [system for system in SYSTEMS if system.is_installed]
    missing = tuple(system.name for system in SYSTEMS if not system.is_installed)
    if missing:
        tell(f"not installed and left out: {', '.join(missing)}")
    versions = {system.name: _version(system) for system in systems}
    done = Comparison((), versions, {}, missing, _machine(load()))
    for system in systems:
        found = tuple(_results(system, [scene.name for scene in chosen(words)]))
        done = replace(done, results=done.results + found)
        tell(f"{system.name:<15} {len(found)} settings, {sum(not result.fault for result in found)} with a result")
        if record:
            done.save(record)
    if not words or "S6" in words:
        done = replace(done, starts=_starts(systems))
    return done


def _machine(busy: float | None) -> str:
    words = f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}"
    return words if busy is None else f"{words}; {busy} processes wanted to run as it began"


def _results(system: System, names: list[str]) -> Iterator[Result]:
    """Of scenes in a process of their own; should it die, that scene has failed, and another one goes on after it."""
    while names:
        lines, fault = _worked(system, names)
        known = {field.name for field in fields(Result)}
        for line in lines:
            if line.startswith(MARK):
                content = {key: value for key, value in json.loads(line[len(MARK) :]).items() if key in known}
                yield Result(**{**content, "system": system.name})
        finished = {line[len(DONE) :] for line in lines if line.startswith(DONE)}
        names = [name for name in names if name not in finished]
        if names:
            yield Result(names.pop(0), system.name, "the process", fault=fault)


def _worked(system: System, names: Sequence[str]) -> tuple[list[str], str]:
    """What a process with one thread has printed, and how it ended."""
    environment = {
        **os.environ,
        **ONE_THREAD,
        "PYTHONPATH": os.pathsep.join(map(os.path.abspath, filter(None, sys.path))),
    }
    command = [sys.executable, "-m", "benchmarks.peers.worker", system.module, *names]
    with TemporaryDirectory() as folder:  # some libraries leave logs where they run
        try:
            done = subprocess.run(
                command, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False, cwd=folder
            )
        except subprocess.TimeoutExpired as late:
            output = late.stdout.decode() if isinstance(late.stdout, bytes) else late.stdout or ""
            return output.splitlines(), f"given up after {PATIENCE:g} s"
    last = done.stderr.strip().splitlines()[-1:] or [f"ended with {done.returncode}"]
    return done.stdout.splitlines(), last[0][:160]


def _starts(systems: Sequence[System]) -> dict[str, float]:
    """S6: seconds from the start of a process to the end of its first step; bytecode and caches are there."""
    scripts = {"import numpy": "import numpy"}
    scripts |= {system.name: FIRST_STEP.format(module=system.module) for system in systems if system.starts}
    samples = interleaved({name: partial(until_done, script) for name, script in scripts.items()}, STARTS)
    return {name: taken.least for name, taken in samples.items()}


def _version(system: System) -> str:
    script = f"from benchmarks.peers.systems.{system.module} import version\nprint('version', version())"
    return next(line.split()[1] for line in output_of(script).splitlines() if line.startswith("version "))
