"""The comparison in words: tables of times to an error, and the page of the documentation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from benchmarks.peers.command import SYSTEMS, Comparison
from benchmarks.peers.race import Result
from benchmarks.peers.scenes import SCENES

__all__ = ["GROUPS", "page", "table", "write"]

TOLERANCES = (1e-3, 1e-6, 1e-9)
GROUPS = {
    "S1": "Double pendulum", "S2": "Chains", "S3a": "Four-bars through singular poses", "S3b": "Andrews' mechanism",
    "S4": "Impacts", "S5": "Stiff springs",
    "S7": "In space",
}  # fmt: skip
"""Sections and pictures: scenes whose names begin so."""
LOOP, CALL = "mbd, loop", "mbd, call"

HEAD = """# Beside other systems

The same scenes, with the same physics and the same measure of error, in `mbd` and in other multibody systems, all in
one run of `python -m benchmarks peers`, which writes this page. The scenes, their numbers and the reference motions
(equations derived by hand, DOP853 at 1e-13, impacts located) stand in `benchmarks/peers`.

- **Times** are seconds of processor time, one thread, the least of up to five repeats, of the simulation loop alone: no
  import, no building of models, no reading of results. For `mbd` two columns: *call* is `mbd.simulate` as a user calls
  it, with the code of the model already made; *loop* is the time inside its kernel.
- **Errors** are the largest absolute difference from the reference at any output time [rad, m; rates and strike times
  in S4]. A cell is the fastest setting tried that reaches the error; '-' means that none did, or that the scene cannot
  be built as it is stated. Finer settings than the first that takes longer than 0.4 s are not tried.
- **In space** (S7) every system is tried with ball joints as it has them and with three hinges in the place of each,
  `mbd` too; the largest difference of any center of mass counts [m], of the top that of its axis, of the coin that of
  center and axis. DART and the implicit schemes of others are of order 1 or 2. Pinocchio is a library of equations
  without a simulator: its loops are Python, whose share is large for small models. Rolling without slip is a joint of
  Exudyn; the others have contacts with friction only, which is another scene.
- **By hand** is no framework: equations derived for the one scene and compiled, in loops compiled with them (`numba`),
  or called by `solve_ivp` (`scipy`; of S4 the reference's own code, with events and, in S4c and S4d, a largest step).
  They are the floor.
- A machine that is shared with other work makes all times longer, those of large models and of memory most. What counts
  is how columns of one run compare.
- Settings were chosen to span the errors, for every system from its usual way of working to what its documentation
  offers beyond; a user who knows a system better may get more out of it.
"""


def page(comparison: Comparison) -> str:
    """The page of the documentation."""
    parts = [HEAD, _participants(comparison)]
    for group, title in GROUPS.items():
        names = [name for name in _scenes(comparison) if name.startswith(group)]
        if names:
            parts += [
                f"## {title}\n",
                f"![work and precision](peers/{group}.png)\n",
                table(comparison, names),
                _bests(comparison, names),
            ]
    if comparison.starts:
        parts.append(_start_up(comparison))
    parts.append(_failures(comparison))
    return "\n".join(parts)


def table(comparison: Comparison, names: Iterable[str]) -> str:
    """Times to each error, a row for each scene and error, and the least error reached."""
    systems = [system.name for system in SYSTEMS if system.name in comparison.versions]
    columns = [CALL, LOOP, *systems[1:]] if systems[:1] == ["mbd"] else systems
    columns = [column for column in columns if any(_reached(comparison, name, column, float("inf")) for name in names)]
    lines = ["| scene, error | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for name in names:
        for error in TOLERANCES:
            cells = [_time(_reached(comparison, name, column, error), column) for column in columns]
            lines.append(f"| {name} ≤ {error:g} | " + " | ".join(cells) + " |")
        least = [
            min((r.error for r in _of(comparison, name, column) if r.error is not None), default=None)
            for column in columns
        ]
        lines.append(f"| {name}, least error | " + " | ".join("-" if e is None else f"{e:.1e}" for e in least) + " |")
    return "\n".join(lines) + "\n"


def _scenes(comparison: Comparison) -> list[str]:
    ran = {result.scene for result in comparison.results}
    return [name for name in SCENES if name in ran]


def _of(comparison: Comparison, scene: str, column: str) -> list[Result]:
    system = "mbd" if column in (LOOP, CALL) else column
    return [r for r in comparison.results if (r.scene, r.system) == (scene, system) and r.error is not None]


def _seconds(result: Result, column: str) -> float:
    spent = result.whole if column == CALL else result.seconds
    return float("inf") if spent is None else spent


def _reached(comparison: Comparison, scene: str, column: str, error: float) -> Result | None:
    """The fastest result within an error."""
    good = [r for r in _of(comparison, scene, column) if r.error is not None and r.error <= error]
    return min(good, key=lambda r: _seconds(r, column), default=None)


def _time(result: Result | None, column: str) -> str:
    if result is None:
        return "-"
    spent = _seconds(result, column)
    return f"{spent * 1e3:.2g} ms" if spent < 0.0995 else f"{spent:.2g} s"


def _participants(comparison: Comparison) -> str:
    listed = ", ".join(f"{name.removeprefix('by hand, ')} {version}" for name, version in comparison.versions.items())
    left = f" Not installed, and left out: {', '.join(comparison.missing)}." if comparison.missing else ""
    return f"Versions: {listed}.{left} Machine: {comparison.machine}.\n"


def _bests(comparison: Comparison, names: Sequence[str]) -> str:
    """What `mbd` did in the cells above."""
    lines = ["`mbd` in these cells (the error reached; steps × time of a step in the loop):\n"]
    for name in names:
        for error in TOLERANCES:
            best = _reached(comparison, name, LOOP, error)
            if best is not None and best.steps and best.seconds is not None:
                each = best.seconds / best.steps * 1e6
                lines.append(f"- {name} ≤ {error:g}: {best.label}: {best.error:.1e}; {best.steps} × {each:.2g} µs")
    return "\n".join(lines) + "\n"


def _start_up(comparison: Comparison) -> str:
    lines = [
        "## S6: from a fresh process to the first step\n",
        "Seconds by the clock from the start of the interpreter to the end of the first step of the double pendulum,",
        "and in times of a process that imports numpy; code is in the cache, where a system has one.\n",
        "| | s | × numpy |", "|---|---|---|",
    ]  # fmt: skip
    numpy = comparison.starts["import numpy"]
    rows = [f"| {name} | {spent:.2f} | {spent / numpy:.1f} |" for name, spent in comparison.starts.items()]
    return "\n".join([*lines, *rows]) + "\n"


def _failures(comparison: Comparison) -> str:
    """Settings without a result."""
    failed: dict[tuple[str, str, str], list[str]] = {}
    for r in comparison.results:
        if r.fault:
            failed.setdefault((r.scene, r.system, r.fault), []).append(r.label)
    if not failed:
        return ""
    lines = ["## Settings without a result\n"]
    lines += [f"- {scene}, {system}: {', '.join(labels)}: {fault}" for (scene, system, fault), labels in failed.items()]
    return "\n".join(lines) + "\n"


def write(comparison: Comparison, folder: Path) -> None:
    """The page and its pictures."""
    from benchmarks.peers.plots import draw

    pictures = folder / "peers"
    pictures.mkdir(parents=True, exist_ok=True)
    for group, title in GROUPS.items():
        draw(comparison, group, title, pictures / f"{group}.png")
    (folder / "peers.md").write_text(page(comparison))
