"""What is kept of a run on disk: plots, page, the run itself, and a record of how it came about."""

import json
import os
import platform
import subprocess
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from functools import partial
from hashlib import sha256
from importlib import metadata
from pathlib import Path
from typing import Any

from mbd.analysis.gait import gait
from mbd.results.archive import plain, write as write_arrays, write_whole
from mbd.results.storage import SUFFIX, Archive, contents
from mbd.results.summary import facts
from mbd.results.trajectory import Trajectory
from mbd.view.beside import beside

FORMAT, VERSION = "mbd record", 1
"""Of the record, see docs/files.md."""

LIBRARIES = ("numpy", "scipy", "sympy", "networkx", "llvmlite", "matplotlib")


def versions() -> dict[str, str | None]:
    """Versions of mbd, Python and the libraries it uses; None for one that is not installed."""
    import mbd

    found: dict[str, str | None] = {"mbd": mbd.__version__, "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = None
    return found


def machine() -> dict[str, Any]:
    """System, architecture, processor and number of processors."""
    return {
        "system": platform.platform(terse=True),
        "architecture": platform.machine(),
        "processor": _processor(),
        "processors": os.cpu_count(),
    }


def made_with() -> str:
    """Versions, processor and time, for the foot of a page."""
    known, now = versions(), datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return f"mbd {known['mbd']}, Python {known['python']}, numpy {known['numpy']}, {machine()['processor']}; {now}"


def _processor() -> str:
    """The processor's name, as the system tells it."""
    listing = Path("/proc/cpuinfo")
    if listing.is_file():
        for line in listing.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def provenance(script: Path | None) -> dict[str, Any]:
    """The script's name, the hash of its text, and the commit of the folder it lies in, if it lies in one."""
    if script is None:
        return {}
    here = ["git", "-C", str(script.resolve().parent)]
    try:
        commit, changed = (
            subprocess.run([*here, *words], capture_output=True, text=True, timeout=5.0, check=True).stdout.strip()
            for words in (["rev-parse", "HEAD"], ["status", "--porcelain", "--", script.name])
        )
    except (OSError, subprocess.SubprocessError):
        commit, changed = "", ""
    known = {"script": script.name, "script_sha256": sha256(script.read_bytes()).hexdigest()}
    return known | ({"commit": commit, "script_changed": bool(changed)} if commit else {})


def record(run: Trajectory, wall: Mapping[str, float], script: Path | None = None) -> dict[str, Any]:
    """Everything needed to tell later how a run came about and how it went, for JSON.

    Parameters
    ----------
    wall : wall times by stage [s]
    script : the file that describes the run, whose hash is kept
    """
    return {
        "format": FORMAT,
        "version": VERSION,
        "model": run.name,
        "success": run.success,
        "message": run.message,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        **provenance(script),
        "versions": versions(),
        "machine": machine(),
        "settings": run.settings,
        "parameters": run.parameters,
        "statistics": run.stats,
        "wall_times": {name: round(seconds, 6) for name, seconds in wall.items()},
        "summary": dict(facts(run)),
        "energy": run.energy.sums | {"change": run.energy.change},
        "events": len(run.events),
        "steps": gait(run).as_json(),
    }


def write(
    run: Trajectory, folder: str | Path, wall: Mapping[str, float], plots: bool = True, script: Path | None = None
) -> list[Path]:
    """Write plots (PNG), page (HTML), the run (npz) and its record (JSON) into a folder; returns the paths."""
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    stored = place / f"run{SUFFIX}"
    plotted = _plots(run, place) if plots else {}
    with beside(lambda: _draw(plotted)), ThreadPoolExecutor(1) as pool:  # compression does not hold the interpreter
        saved = pool.submit(write_arrays, stored, *contents(run.record, Archive.of(run)))
        page = run.page(place / "page.html")
        saved.result()
    text = json.dumps(record(run, wall, script), indent=2, default=plain)
    write_whole(place / "record.json", lambda partial: partial.write_text(text + "\n", encoding="utf-8"))
    return [page, stored, *plotted, place / "record.json"]


def draw(run: Trajectory, place: Path, plots: bool = True) -> list[Path]:
    """Write the page of a run and its plots, as far as there is something to plot; returns the paths."""
    place.mkdir(parents=True, exist_ok=True)
    plotted = _plots(run, place) if plots else {}
    with beside(lambda: _draw(plotted)):
        page = run.page(place / "page.html")
    return [page, *plotted]


def _draw(plotted: Mapping[Path, Callable[..., object]]) -> None:
    for path, plot in plotted.items():
        plot(path=path)


def _plots(run: Trajectory, place: Path) -> dict[Path, Callable[..., object]]:
    """Coordinates, energy, phase portrait and forces of contacts, as far as the run has them: what draws each file."""
    import matplotlib.figure  # noqa: F401  (a fork must not find another thread importing it)

    from mbd.view.plots import phase_portrait, portrayed

    found: dict[Path, Callable[..., object]] = {
        place / "coordinates.png": run.plot,
        place / "energy.png": run.energy.plot,
    }
    if portrayed(run):
        found[place / "phase.png"] = partial(phase_portrait, run)
    kinds = [f"{contact.name}.{what}" for contact in run.facts.contacts for what in ("force", "friction")]
    forces = [name for name in kinds if name in run]
    if forces:
        found[place / "forces.png"] = partial(run.plot, *forces)
    return found
