"""A run in a few lines: as text, and as a table for notebooks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.results.ledger import Ledger

if TYPE_CHECKING:
    from mbd.trajectory import Trajectory

__all__ = ["facts", "of_the_swing", "text"]

LABELS = {"derive_and_compile_seconds": "derive and compile seconds (of the model, all its runs so far)"}
"""Words for statistics whose names say too little."""


def facts(run: Trajectory) -> list[tuple[str, str]]:
    """(title, value) pairs: what was run, how it ended, how well it did, what it cost."""
    time = run.time
    found = [("outcome", ("success" if run.success else "failure") + (f": {run.message}" if run.message else ""))]
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
    numbers = {key: value for key, value in run.stats.items() if isinstance(value, int | float)}
    costs = {LABELS.get(key, key.replace("_", " ")): value for key, value in numbers.items()}
    if costs:
        found.append(("cost", ", ".join(f"{key} {_number(value)}" for key, value in costs.items())))
    found += [("note", str(note)) for note in run.stats.get("notes", ())]
    return found


def accuracy(tolerance: Mapping[str, Any]) -> str:
    """The estimated error beside the one asked for, how errors grew, and what the runs cost."""
    steps = " + ".join(str(one["steps"]) for one in tolerance["runs"])
    return (
        f"estimated error of coordinates {tolerance['estimated']:.2g}, asked for {tolerance['requested']:g}; "
        f"global over local errors {tolerance['growth']:.2g}; runs of {steps} steps"
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


def _number(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def text(run: Trajectory) -> str:
    """The printed form of a run."""
    lines = [f"Trajectory of {run.name!r}"]
    lines += [f"  {title:<12} {value}" for title, value in facts(run)]
    return "\n".join(lines)


def of_the_swing(energy: Ledger) -> str:
    """What the scheme itself took, over the swing of the kinetic energy; '' where that is round-off, or no number."""
    if not np.all(np.isfinite(energy.kinetic)):
        return ""
    swing, most = float(np.ptp(energy.kinetic)), float(np.max(np.abs(energy.kinetic), initial=0.0))
    return f"{energy.drift:.2g} of the swing of kinetic energy" if swing > 1e-9 * most else ""
