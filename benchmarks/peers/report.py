"""The comparison in words: tables of times to an error, and the page of the documentation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.peers.command import SYSTEMS, Comparison
from benchmarks.peers.race import Result
from benchmarks.peers.scenes import SCENES

TOLERANCES = (1e-3, 1e-6, 1e-9)
GROUPS = {
    "S1": "Double pendulum", "S2": "Chains", "S3a": "Four-bars through singular poses", "S3b": "Andrews' mechanism",
    "S4": "Impacts", "S5": "Stiff springs",
    "S7": "In space",
}  # fmt: skip
"""Sections and pictures: scenes whose names begin so."""


@dataclass(frozen=True)
class Column:
    """Times of a system: `timed` says which of a `Result`."""

    title: str
    system: str
    timed: str

    def seconds_of(self, result: Result) -> float:
        """The time of a result; infinite where it was not taken."""
        spent: float | None = getattr(result, self.timed)
        return float("inf") if spent is None else spent


LOOP, CALL = Column("mbd, loop", "mbd", "seconds"), Column("mbd, call", "mbd", "whole")

HEAD = """# Beside other systems

`mbd` and five other multibody systems simulate the same scenes. `python -m benchmarks peers` measures all of them in
one run and writes this page. The folder `benchmarks/peers` holds the parameters of each scene and the reference
motions: equations derived by hand, integrated by DOP853 at 1e-13 with impacts located.

- **Times** are processor times of one thread, the best of up to five runs. They exclude import, model building and
  reading of results. `mbd` has two columns: *call* is `mbd.simulate` as you call it, once the model is compiled;
  *loop* is the time inside its kernel.
- **From words** is the time from the words of a model to the values that are compared, in a process that has done
  the same before: the model is built again, run and read each time. Compiled code is there, equations are not.
- **Errors** are the largest absolute difference from the reference at any output time. Each scene says what is
  compared.
- **A cell** is the time of the fastest setting that reaches the error. A dash means that no setting tried reached it,
  or that the system cannot build the scene as stated. Settings finer than the first that took over 0.4 s were not
  tried.
- **By hand** is the floor: equations derived for that one scene, in a compiled loop (`numba`) or called by
  `solve_ivp` (`scipy`).

Compare columns, not absolute times: the machine was shared with other work. Every system ran with its usual settings
and with what its documentation recommends for accuracy, but an expert may get more out of it. [Settings of the
comparison](peers-settings.md) lists the settings of `mbd`, those that failed, and how scenes were built.
"""

SETTINGS = """# Settings of the comparison

[Beside other systems](peers.md) shows how long `mbd` and other systems take for an error. This page lists the
settings behind its cells.

- In space (S7) each system was tried with its own ball joints and with three hinges in place of each; the faster
  result counts.
- DART and the implicit schemes of other systems have order 1 or 2.
- Pinocchio computes equations but has no simulator. Its loops are written in Python, which dominates the time of
  small models.
- Only Exudyn and `mbd` have rolling without slip as a constraint. The others have frictional contact, which is
  another scene, so their cells of the coin show a dash.
- By hand, `scipy` solves the impacts (S4) with the reference's own code: events and, in S4c and S4d, a largest step.

Each entry of `mbd` gives the setting, the error it reached, and steps × time of a step in the loop. Other lists name
the settings that gave no result, with the message of the system.
"""


def page(comparison: Comparison) -> str:
    """The page of the documentation."""
    parts = [HEAD, _participants(comparison), _firsts(comparison)]
    for group, (title, names) in _groups(comparison).items():
        parts += [
            f"## {title}\n", _described(names), f"![Time of each system against its error](peers/{group}.png)\n",
            table(comparison, names, _columns(comparison)),
            "From words:\n", table(comparison, names, _from_words(comparison)),
        ]  # fmt: skip
    if comparison.starts:
        parts.append(_start_up(comparison))
    return "\n".join(parts)


def settings(comparison: Comparison) -> str:
    """The page of the settings behind the cells."""
    parts = [SETTINGS]
    for title, names in _groups(comparison).values():
        parts += [f"## {title}\n", _bests(comparison, names)]
    return "\n".join([*parts, _failures(comparison)])


def _groups(comparison: Comparison) -> dict[str, tuple[str, list[str]]]:
    """Titles and scenes of the sections, by the beginning of their names."""
    ran = _scenes(comparison)
    found = {group: (title, [name for name in ran if name.startswith(group)]) for group, title in GROUPS.items()}
    return {group: section for group, section in found.items() if section[1]}


def _described(names: Sequence[str]) -> str:
    """What is simulated and compared."""
    return "\n".join(f"- {name}: {SCENES[name].title}; compared: {SCENES[name].shown}" for name in names) + "\n"


def table(comparison: Comparison, names: Sequence[str], columns: Iterable[Column]) -> str:
    """Times to each error, a row for each scene and error, and the least error reached."""
    columns = [each for each in columns if any(_reached(comparison, name, each, float("inf")) for name in names)]
    lines = ["| scene, error | " + " | ".join(each.title for each in columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for name in names:
        for error in TOLERANCES:
            cells = [_time(_reached(comparison, name, each, error), each) for each in columns]
            lines.append(f"| {name} ≤ {error:g} | " + " | ".join(cells) + " |")
        least = [min((r.error for r in _of(comparison, name, each) if r.error is not None), default=None)
                 for each in columns]  # fmt: skip
        lines.append(f"| {name}, least error | " + " | ".join("-" if e is None else f"{e:.1e}" for e in least) + " |")
    return "\n".join(lines) + "\n"


def _columns(comparison: Comparison) -> list[Column]:
    """Loops of all, and the call of `mbd`."""
    present = [system.name for system in SYSTEMS if system.name in comparison.versions]
    own = [CALL, LOOP] if "mbd" in present else []
    return [*own, *(Column(name, name, "seconds") for name in present if name != "mbd")]


def _from_words(comparison: Comparison) -> list[Column]:
    """Those of the systems that have words."""
    with_words = [system.name for system in SYSTEMS if system.starts and system.name in comparison.versions]
    return [Column(name, name, "words") for name in with_words]


def _firsts(comparison: Comparison) -> str:
    """In how many of the cells that another system reaches, too, `mbd` is the fastest."""
    words = _from_words(comparison)
    loops = [Column(each.system, each.system, "seconds") for each in words]
    loop, call, from_words = (
        _first(comparison, own, [each for each in others if each.system != "mbd"])
        for own, others in ((LOOP, loops), (CALL, loops), (Column("mbd", "mbd", "words"), words))
    )
    return (
        f"`mbd` is the fastest system in {loop} cells by its loop, in {call} by its call, and in {from_words} from "
        "words. Cells that no other system reaches are not counted, nor is what is written by hand.\n"
    )


def _first(comparison: Comparison, own: Column, others: Sequence[Column]) -> str:
    cells = [(name, error) for name in _scenes(comparison) for error in TOLERANCES]
    first = list[bool]()
    for name, error in cells:
        mine, *theirs = (_reached(comparison, name, each, error) for each in (own, *others))
        times = [each.seconds_of(found) for each, found in zip(others, theirs, strict=True) if found is not None]
        if mine is not None and times:
            first.append(own.seconds_of(mine) <= min(times))
    return f"{sum(first)} of {len(first)}"


def _scenes(comparison: Comparison) -> list[str]:
    ran = {result.scene for result in comparison.results}
    return [name for name in SCENES if name in ran]


def _of(comparison: Comparison, scene: str, column: Column) -> list[Result]:
    return [r for r in comparison.results if (r.scene, r.system) == (scene, column.system) and r.error is not None]


def _reached(comparison: Comparison, scene: str, column: Column, error: float) -> Result | None:
    """The fastest result within an error."""
    good = [r for r in _of(comparison, scene, column) if r.error is not None and r.error <= error]
    return min(good, key=column.seconds_of, default=None)


def _time(result: Result | None, column: Column) -> str:
    if result is None:
        return "-"
    spent = column.seconds_of(result)
    return f"{spent * 1e3:.2g} ms" if spent < 0.0995 else f"{spent:.2g} s"


def _participants(comparison: Comparison) -> str:
    listed = ", ".join(f"{name.removeprefix('by hand, ')} {version}" for name, version in comparison.versions.items())
    left = f" Not installed, and left out: {', '.join(comparison.missing)}." if comparison.missing else ""
    return f"Versions: {listed}.{left} Machine: {comparison.machine}.\n"


def _bests(comparison: Comparison, names: Sequence[str]) -> str:
    """What `mbd` did in the cells above."""
    lines = []
    for name in names:
        for error in TOLERANCES:
            best = _reached(comparison, name, LOOP, error)
            if best is not None and best.steps and best.seconds is not None:
                each = best.seconds / best.steps * 1e6
                lines.append(f"- {name} ≤ {error:g}: {best.label}: {best.error:.1e}; {best.steps} × {each:.2g} µs")
    return "\n".join(lines) + "\n"


def _start_up(comparison: Comparison) -> str:
    lines = [
        "## From a fresh process to the first step\n",
        "Wall time from the start of the interpreter to the end of the first step of the double pendulum, in seconds",
        "and as a multiple of a process that only imports numpy. Compiled code is cached where a system has a cache.\n",
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
    lines = ["## Settings that failed\n"]
    lines += [f"- {scene}, {system}: {', '.join(labels)}: {fault}" for (scene, system, fault), labels in failed.items()]
    return "\n".join(lines) + "\n"


def write(comparison: Comparison, folder: Path) -> None:
    """The pages and their pictures."""
    from benchmarks.peers.plots import draw

    pictures = folder / "peers"
    pictures.mkdir(parents=True, exist_ok=True)
    for group, title in GROUPS.items():
        draw(comparison, group, title, pictures / f"{group}.png")
    (folder / "peers.md").write_text(page(comparison))
    (folder / "peers-settings.md").write_text(settings(comparison))
