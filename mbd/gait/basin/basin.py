"""What becomes of every start: walks, falls, scuffs."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mbd.analysis.column_units import units_of
from mbd.arrays import Vector
from mbd.bodies.values import flag, is_finite_number, named_number_faults, shown
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.gait.basin.axes import Grid, grid_of, study_of
from mbd.gait.basin.kinds import LETTERS, NUMBER
from mbd.gait.basin.made import Made
from mbd.gait.basin.result import Basin
from mbd.gait.basin.walks import Decided, Numbers
from mbd.gait.cycle import LimitCycle
from mbd.progress import share_bar
from mbd.results.identity import identity, identity_of_model
from mbd.results.study_file import StudyFile
from mbd.simulation.batch.batch import worker_count

STATE = ("q", "v", "z", "anchors")
"""What a state of a gait is made of, which starts have where axes do not name it."""
BLOCK_SIZE = 8192
"""Starts that are decided together, and written to a file together."""


def basin(
    model: Any,
    gait: LimitCycle | Mapping[str, LimitCycle] | Sequence[LimitCycle],
    axes: Mapping[str | tuple[str, ...], Sequence[Any]],
    *,
    start: Callable[[Mapping[str, Vector]], Mapping[str, Any]] | None = None,
    steps: int = 20,
    dt: float | None = None,
    longest: float | None = None,
    parameters: Mapping[str, float] | None = None,
    file: str | Path | None = None,
    workers: int | None = None,
    progress: bool = False,
) -> Basin:
    """Which starts walk, and what becomes of the others.

    Every start of the grid walks return after return of the map of the gait, thousands side by side in the machine
    code, until it is decided: it has come into a verified ball round an attractor (`mbd.gait.basin.balls`), falls
    forward or backward, scuffs, stands, chatters, misses the section, fails, or is still undecided after all steps.
    What becomes of a start depends neither on the others nor on the number of threads.

    Parameters
    ----------
    model : that of the gait
    gait : a stable gait from `mbd.limit_cycle`; several, in a list or by name, that share section and mirror
    axes : coordinates [m, rad] and rates [m/s, rad/s] on the section, parameters, or functions of them, with their
        values: ``{"left hip.rate": np.linspace(-1.5, -0.8, 100), "slope": [0.03, 0.05]}``. All combinations are taken;
        names in a tuple change together: ``{("theta", "theta.rate"): [(0.2, -0.2), (0.3, -0.3)]}``. What has no name
        here is that of the gait, moved least so that it is on the section
    start : a function from columns of the axes to columns of coordinates, rates and parameters, for axes with names of
        their own: ``lambda axes: {"theta": axes["theta"], "theta.rate": axes["s"] - axes["theta"]}``
    steps : returns after which a start counts as not decided
    dt, longest : step and latest time of a return [s]; by default those of the gait
    parameters : values, or those of functions, that differ from the gait's; the gait is then looked for there
    file : to which starts are added as they are decided, and from which they are taken: a study that was ended or
        killed goes on where it was
    workers : threads; by default as many as there are processors
    progress : True for a bar on a terminal

    Returns
    -------
    Basin

    Raises
    ------
    ModelError, UnknownNameError
        for axes without or with unknown names, numbers that are not finite, gaits that attract nothing or are those of
        another model, a file of another study; before the first run.
    CapabilityError
        for models whose runs need Python between their steps, such as those with controllers.
    """
    faults = _faults(steps, dt, longest, parameters)
    if faults:
        raise ModelError(faults)
    bar_wanted, threads, grid = flag(progress, "progress of a basin"), worker_count(workers), grid_of(axes)
    gaits = _gaits(model, gait)
    first = next(iter(gaits.values()))
    map_ = replace(first.map, dt=dt or first.dt, longest=longest or first.map.longest)
    study = study_of(map_, grid, start)
    base = {**first.parameters, **(parameters or {})}
    wrong = [nearest(n, study.parameters, "parameter", "There are") for n in base if n not in study.parameters]
    if wrong:
        raise UnknownNameError(wrong)
    made = Made(map_, gaits, study, base, threads)
    store = None if file is None else Store(file, _head(made, grid, steps))
    with share_bar() if bar_wanted else nullcontext() as bar:
        decided, complete = _decided(made, steps, store, bar)
    own = (name for name in grid.names if name in study.places or name in study.parameters)  # others start= alone knows
    units = units_of(model, own, map_.backend)
    return Basin(getattr(model, "name", ""), grid, tuple(gaits), decided, made.all_balls, steps, complete, units, made)


def _faults(steps: Any, dt: Any, longest: Any, parameters: Any) -> list[str]:
    """What is wrong with the numbers."""
    faults = named_number_faults(parameters, "parameters")
    if isinstance(steps, bool) or not isinstance(steps, int) or not 1 <= steps <= 100_000:
        faults.append(f"steps must be a whole number from 1 to 100000, not {shown(steps)}")
    for name, value in (("dt", dt), ("longest", longest)):
        if value is not None and not (is_finite_number(value) and 1e-9 <= value <= 1e9):
            faults.append(f"{name} must be a positive number of seconds or None, not {shown(value)}")
    return faults


def _gaits(model: Any, gait: Any) -> dict[str, LimitCycle]:
    """The attractors by name."""
    if isinstance(gait, LimitCycle):
        found = {gait.name or "gait": gait}
    elif isinstance(gait, Mapping):
        found = dict(gait)
    elif isinstance(gait, list | tuple):
        found = {f"gait {k}": each for k, each in enumerate(gait)}
    else:
        found = {}
    if not found or not all(isinstance(k, str) and isinstance(each, LimitCycle) for k, each in found.items()):
        raise ModelError(
            f"gait must be a gait from mbd.limit_cycle, or several in a list or by name, not {shown(gait)[:80]}"
        )
    first = next(iter(found.values()))
    faults = []
    for name, each in found.items():
        if each.map.model is not model:
            faults.append(f"{name!r} is a gait of another model; give the model that it was found with")
        elif not each.success:
            faults.append(f"{name!r} is no gait: {each.outcome}")
        elif (each.section, each.mirror) != (first.section, first.mirror) or each.parameters != first.parameters:
            faults.append(f"{name!r} has another section, mirror or other parameters than the first gait")
    if faults:
        raise ModelError(faults)
    return found


def _head(made: Made, grid: Grid, steps: int) -> dict[str, Any]:
    """What makes a study another one."""
    map_ = made.map
    everything = (
        np.arange(len(grid))
        if len(grid) <= BLOCK_SIZE
        else np.unique(np.linspace(0, len(grid) - 1, BLOCK_SIZE).astype(int))
    )
    state, columns = made.study.columns(everything)
    return {
        "name": getattr(map_.model, "name", ""), **identity_of_model(map_.model, map_.mechanism),
        "section": map_.section, "integrator": repr(map_.integrator),
        "mirror": None if map_.mirror is None else list(map_.mirror.sides), "dt": map_.dt, "longest": map_.longest,
        "steps": steps, "axes": [list(names) for names in grid.dimensions], "shape": list(grid.shape),
        "parameters": {name: float(value) for name, value in made.base.items()}, "attractors": list(made.gaits),
        "starts": _digest_of(*grid.values.values(), *state.values(), *columns.values()),
        "functions": identity(map_.functions, made.study.start),
        "gaits": _digest_of(*(getattr(each.state, part) for each in made.gaits.values() for part in STATE)),
        "values": _digest_of([float(v) for v in getattr(map_.model, "parameters", {}).values()]),
    }  # fmt: skip


def _decided(made: Made, steps: int, store: Store | None, bar: Any) -> tuple[Decided, bool]:
    """All starts, block by block; those that the file has are taken from it. An interruption keeps what is decided."""
    total = len(made.study.grid)
    found = Decided.of(total)
    complete = True
    try:
        for first in range(0, total, BLOCK_SIZE):
            last = min(first + BLOCK_SIZE, total)
            block = found.part(first, last)
            left = np.arange(last - first) if store is None else store.fill(first, block)
            if len(left):
                _decide(made, first, left, steps, block, store)
            if bar is not None:
                bar(last, total)
    except KeyboardInterrupt:
        complete = False
    return found, complete


def _decide(made: Made, first: int, left: Numbers, steps: int, block: Decided, store: Store | None) -> None:
    """Decide the starts of a block that are left, and store it; also what is decided when Ctrl-C ends that."""
    found, waiting = Decided.of(len(left)), left
    try:
        made.decide(first + left, steps, found)
        waiting = left[:0]
    finally:
        block.take(left, found)
        if len(waiting):
            waiting = np.flatnonzero(block.kind == NUMBER["not decided"])
        if store is not None:
            store.keep(first, block, waiting)


# A file of blocks of starts that are decided.
#
# Each has its first number, a letter for the kind of each start (`mbd.gait.basin.kinds`), attractors, steps and times;
# one that Ctrl-C has cut short also the places of the starts that are left.


def _digest_of(*arrays: Any) -> str:
    """Of numbers, to tell one study from another."""
    found = hashlib.sha256()
    for array in arrays:
        found.update(np.ascontiguousarray(array, dtype=float).tobytes())
    return found.hexdigest()[:24]


class Store:
    """The blocks that a file holds, and the file, to which more are added.

    Raises
    ------
    ModelError
        for a file that is none of a basin, and one of another basin, by what differs.
    """

    def __init__(self, path: Any, head: Mapping[str, Any]) -> None:
        self.file = StudyFile(path, "basin", head)
        self._blocks = {line["first"]: line for line in self.file.parts}

    def fill(self, first: int, block: Decided) -> Numbers:
        """Note what became of a block of starts as far as the file has it; the places of those that are left."""
        line = self._blocks.get(first)
        if line is None or len(line["kinds"]) != len(block.kind):
            return np.arange(len(block.kind))
        block.kind[:] = [LETTERS.index(letter) for letter in line["kinds"]]
        block.attractor[:], block.steps[:], block.time[:] = line["attractors"], line["steps"], line["times"]
        return np.array(line.get("left", []), dtype=np.int64)

    def keep(self, first: int, block: Decided, left: Numbers) -> None:
        """Add a block that is decided but for the starts at the places `left`."""
        self.file.add({
            "first": first, "kinds": "".join(LETTERS[kind] for kind in block.kind.tolist()),
            "attractors": block.attractor.tolist(), "steps": block.steps.tolist(), "times": block.time.tolist(),
            **({"left": left.tolist()} if len(left) else {}),
        })  # fmt: skip
