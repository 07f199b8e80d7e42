"""All measurements of one process run, and the record that is kept of them."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from benchmarks import (
    basins,
    compiling,
    counts,
    cycles,
    derivatives,
    gait,
    laboratory,
    machines,
    people,
    startup,
    steps,
    watching,
)
from benchmarks.figures import Figure
from benchmarks.handwritten import FLAGS, compiler, compiler_version

HERE = Path(__file__).parent
BASELINE, RESULTS = HERE / "baseline.json", HERE / "results.json"
GROUPS = (
    "counts",
    "steps",
    "watching",
    "gait",
    "cycles",
    "machines",
    "basins",
    "derivatives",
    "compiling",
    "people",
    "laboratory",
    "startup",
)
C_STEP = "step, compass, 4 dof + 2 rows, index 3"


@dataclass(frozen=True)
class Record:
    """Figures and the machine that they were taken on."""

    figures: tuple[Figure, ...]
    machine: dict[str, Any]

    def save(self, path: Path) -> None:
        """Write as JSON."""
        content = {"machine": self.machine, "figures": [asdict(figure) for figure in self.figures]}
        path.write_text(json.dumps(content, indent=1) + "\n")

    @classmethod
    def load(cls, path: Path) -> Record:
        """Read what `save` wrote."""
        content = json.loads(path.read_text())
        return cls(tuple(Figure(**figure) for figure in content["figures"]), content["machine"])


def measure(repeats: int, groups: Iterable[str] = GROUPS) -> Record:
    """The figures of some groups, at least seven repeats of each measurement."""
    groups = set(groups)
    busy = load()
    figures: list[Figure] = []
    if "counts" in groups:
        figures += counts.measure()
    if groups & {"steps", "gait"}:
        stepped = steps.measure(repeats)
        reference = next(figure.reference for figure in stepped if figure.name == C_STEP)
        figures += stepped if "steps" in groups else []
        figures += gait.measure(repeats, reference) if "gait" in groups else []
    if "watching" in groups:
        figures += watching.measure(repeats)
    if "cycles" in groups:
        figures += cycles.measure(repeats)
    if "machines" in groups:
        figures += machines.measure(repeats)
    if "basins" in groups:
        figures += basins.measure(repeats)
    if "derivatives" in groups:
        figures += derivatives.measure(repeats)
    if "compiling" in groups:
        figures += compiling.measure(repeats)
    if "people" in groups:
        figures += people.measure(repeats)
    if "laboratory" in groups:
        figures += laboratory.measure(repeats)
    if "startup" in groups:
        figures += startup.measure(repeats)
    return Record(tuple(figures), {**_machine(), "load before": busy, "load after": load(), "repeats": repeats})


def load() -> float | None:
    """Processes that wanted to run in the last minute, where the system says so."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


def _machine() -> dict[str, Any]:
    from mbd.compile.host import host

    return {
        "processor": host().cpu,
        "architecture": platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "llvmlite": version("llvmlite"),
        "compiler": compiler_version(),
        "flags": " ".join(FLAGS) if compiler() else "",
    }
