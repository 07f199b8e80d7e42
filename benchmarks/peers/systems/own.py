"""`mbd` itself: `simulate` as a user calls it, code already made, and the time inside the kernel."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from time import process_time

import mbd
from benchmarks.peers.equations import problem
from benchmarks.peers.models import Posed, in_space, posed
from benchmarks.peers.race import Attempt, Outcome, Sweep
from benchmarks.peers.scenes import Scene
from benchmarks.peers.schemes import Setting, settings
from benchmarks.peers.space import tree
from benchmarks.stopwatch import kernel_watched
from mbd.compile import background

BY_HINGES = ("S7_top", "S7_double", "S7_chain")
"""Trees of ball joints that are tried with three hinges for each, too."""
APART = 1e-5
"""Time between stored rows of motions with impacts, at least: cubic interpolation adds less than 1e-10 to any [s]."""


def version() -> str:
    """The version that runs."""
    return mbd.__version__


def _stride(scene: Scene, setting: Setting) -> int:
    """Steps between stored rows: every output time, where steps hit them; else `APART`. All rows of steps that vary."""
    if "dt" not in setting.words:
        return 1
    dt, per_row = setting.words["dt"], scene.every / setting.words["dt"]
    if per_row >= 1.0 and abs(per_row - round(per_row)) < 1e-9 and _is_smooth(scene):
        return round(per_row)
    return max(int(APART / dt), 1)


def _is_smooth(scene: Scene) -> bool:
    return scene.family == "S7" or (problem(scene.name) is not None and scene.name != "S5b")


def once(scene: Scene, case: Posed, setting: Setting) -> Outcome:
    """One run; `seconds` are those of the kernel."""
    stride = _stride(scene, setting)
    with kernel_watched() as watch:
        began = process_time()
        run = mbd.simulate(case.model, case.start, setting.integrator, until=scene.until, store=stride, **setting.words)
        whole = process_time() - began
    return Outcome(case.read(run, scene.times), watch.seconds, run.stats["steps"], whole)


def attempts(scene: Scene) -> list[Sweep]:
    """Every scheme of the table; each model is derived, and the code of its modes made, before anything is timed."""
    makers = {"": partial(posed, scene)}
    if scene.name in BY_HINGES:
        makers["three hinges, "] = partial(in_space, tree(scene.name).by_hinges)
    found = []
    for words, made in makers.items():
        case = made()
        for sweep in settings(scene, bool(words)):
            with suppress(mbd.MbdError):  # a setting that fails says so when it is measured
                once(scene, case, sweep[0])
                background.finish()
            found.append([
                Attempt(words + one.label, partial(once, scene, case, one), partial(_from_words, scene, made, one))
                for one in sweep
            ])  # fmt: skip
    return found


def _from_words(scene: Scene, made: Callable[[], Posed], setting: Setting) -> Outcome:
    """A run of a model that is new in this process."""
    return once(scene, made(), setting)


def first_step(scene: Scene) -> None:
    """Words, equations, code from the cache, and one step."""
    case = posed(scene)
    mbd.simulate(case.model, case.start, mbd.GeneralizedAlpha(1.0), dt=scene.every, until=scene.until)
