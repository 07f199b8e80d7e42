"""What a gait costs: the energy of one period by cause, and over weight and distance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.results.ledger import SPENT, titled

if TYPE_CHECKING:
    from mbd.results.trajectory import Trajectory

__all__ = ["cost_of_transport", "energy_by_cause"]


def energy_by_cause(run: Trajectory) -> dict[str, float]:
    """What each cause gave from the first row to the last [J]; negative: it took. Gravity and springs give what they
    had stored; NaN of a kind with a part that is withheld.
    """
    ledger = run.energy
    kinds, withheld = ledger.by_kind(), {part.kind for part in ledger.parts if part.withheld}
    stored = titled(ledger.stored, kinds)
    given = {title: float(energy[0] - energy[-1]) for title, energy in stored.items() if len(energy)}
    taken = {kind: float(values[-1]) for kind, values in kinds.items() if len(values)}
    return {**given, **taken, **dict.fromkeys(withheld, float("nan"))}


def cost_of_transport(energy: Mapping[str, float], model: Any, changed: Mapping[str, float], distance: float) -> float:
    """``−Σ (losses, dampers, friction, penalties, impacts) / (m g d)`` [-]; NaN without bodies, gravity or a way, and
    where one of these is not known.
    """
    values = {**getattr(model, "parameters", {}), **changed}
    mass = sum(values.get(f"{body}.mass", 0.0) for body in getattr(model, "bodies", {}))
    gravity = float(np.linalg.norm([values.get(f"gravity.{axis}", 0.0) for axis in "xyz"]))
    weight = mass * gravity * abs(distance)
    taken = -sum(value for kind, value in energy.items() if kind in SPENT)
    return taken / weight if weight > 0.0 else float("nan")
