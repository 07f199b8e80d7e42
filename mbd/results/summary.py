"""A run in a few lines: as text, and as a table for notebooks."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.results.ledger import Ledger

if TYPE_CHECKING:
    from mbd.results.trajectory import Trajectory

COLUMNS = 100
"""Width of what is printed; longer lines go on below [-]."""

COUNTS = {
    "steps": "step", "rejected": "rejected step", "iterations": "Newton iteration", "events": "event",
    "impacts": "impact", "singular_steps": "step near a singular configuration", "shortened": "shortened step",
}  # fmt: skip
"""Counters of a run that a reader asks for, and the word for one of each; the others are in `Trajectory.stats`."""


def facts(run: Trajectory) -> list[tuple[str, str]]:
    """(title, value) pairs: what was run, how it ended, how well it did, what it cost."""
    time = run.time
    found = [("outcome", outcome(run))]
    if len(time):
        found.append(("time", f"{time[0]:g} s to {time[-1]:g} s in {len(time)} stored rows"))
    settings = [f"{run.settings[key]}" for key in ("integrator",) if key in run.settings]
    settings += [f"{key} = {run.settings[key]}" for key in ("dt", "tol") if run.settings.get(key) is not None]
    if settings:
        found.append(("integrator", ", ".join(settings)))
    if strategy(run):
        found.append(("contact", strategy(run)))
    if len(time):
        energy = run.energy
        relative = of_the_swing(energy)
        relative = f" ({relative})" if relative else ""
        found.append(("energy", f"change {energy.change:.4g} J; numerical {energy.numerical[-1]:.2g} J{relative}"))
        found.append(("constraints", str(run.violation)))
    found.append(("events", counts(run) or "none"))
    tolerance = run.stats.get("tolerance")
    if tolerance:
        found.append(("accuracy", accuracy(tolerance)))
    if cost(run):
        found.append(("cost", cost(run)))
    found += [("note", str(note)) for note in run.stats.get("notes", ())]
    return found


def outcome(run: Trajectory) -> str:
    """How a run ended: 'success: reached t = 1 s', 'ended by 'fall' at t = 0.8 s', 'failure: …'.

    An event that was asked for ends a run as it was meant to, but a fall is no success.
    """
    if run.status == 1:
        return run.message
    return ("success" if run.success else "failure") + (f": {run.message}" if run.message else "")


def cost(run: Trajectory) -> str:
    """'21095 steps, 23638 Newton iterations, 203 events; 0.638 s', with the seconds before the first step, if told."""
    stats = run.stats
    words = [f"{stats[key]} {word}{'s' * (stats[key] != 1)}" for key, word in COUNTS.items() if stats.get(key)]
    seconds = [f"{stats['wall_seconds']:.3g} s"] if "wall_seconds" in stats else []
    before = stats.get("derive_and_compile_seconds")
    seconds += [f"{before:.2g} s to derive and compile before it"] if before and before >= 5e-4 else []
    return "; ".join(part for part in (", ".join(words), ", ".join(seconds)) if part)


def accuracy(tolerance: Mapping[str, Any]) -> str:
    """The estimated error beside the one asked for, how errors grew, and what the runs cost."""
    steps = " + ".join(str(one["steps"]) for one in tolerance["runs"])
    growth = tolerance["growth"]  # unknown where local errors are round-off
    grown = f"global over local errors {growth:.2g}; " if math.isfinite(growth) else ""
    return (
        f"estimated error of coordinates {tolerance['estimated']:.2g}, asked for {tolerance['requested']:g}; "
        f"{grown}runs of {steps} steps"
    )


def strategy(run: Trajectory) -> str:
    """How contacts were treated, and why; '' without contacts, and where a choice left open came to the usual."""
    if not run.record.closed.shape[1] or "contact" not in run.settings:
        return ""
    if run.settings.get("contact_reason") and run.settings["contact"] == "events":
        return ""
    return str(run.settings.get("contact_reason") or f"contact='{run.settings['contact']}', as asked")


def counts(run: Trajectory) -> str:
    """'3 × left foot closed, …' in the order of first occurrence."""
    return ", ".join(f"{n} × {what}" for what, n in Counter(f"{e.name} {e.kind}" for e in run.events).items())


def text(run: Trajectory) -> str:
    """The printed form of a run."""
    return "\n".join([f"Trajectory of {run.name!r}", *entries(facts(run))])


def entries(pairs: Sequence[tuple[str, str]]) -> list[str]:
    """Lines of titles and values, folded at `COLUMNS`."""
    return [
        line
        for title, value in pairs
        for line in wrap(
            f"  {title:<12} {value}", COLUMNS, subsequent_indent=" " * 15, break_long_words=False,
            break_on_hyphens=False, drop_whitespace=True, replace_whitespace=False,
        ) or [f"  {title}"]
    ]  # fmt: skip


def of_the_swing(energy: Ledger) -> str:
    """What the scheme itself took, over the swing of the kinetic energy; '' where that is round-off, or no number."""
    if not np.all(np.isfinite(energy.kinetic)):
        return ""
    swing, most = float(np.ptp(energy.kinetic)), float(np.max(np.abs(energy.kinetic), initial=0.0))
    return f"{energy.drift:.2g} of the swing of kinetic energy" if swing > 1e-9 * most else ""
