"""A wheel whose rolling asks for grip where nothing presses it onto its plane, so that its contact opens and closes.

With its contact closed the wheel rolls, and what holds the slip at zero makes the contact pull; with the contact open
the grip is gone, and the wheel falls back onto the plane. A real wheel slips there.
"""

from collections.abc import Sequence

import numpy as np

from mbd.results.record import EventRecord
from mbd.simulation.run.stepper import Stepper


def lost_grip(stepper: Stepper, events: Sequence[EventRecord]) -> str:
    """A sentence on the wheel among the last switches that needs grip without a normal force, '' if there is none."""
    v, names = stepper.kernel, stepper.manager.names
    for name in dict.fromkeys(event.name for event in events[-6:] if event.kind in ("closed", "opened")):
        contact = names.index(name)
        rows = stepper.mechanism.equations.rows
        grips = [k for k, row in enumerate(rows) if row.contact == contact and v.row_level[k] == 1]
        forces = _forces_with(stepper, contact) if grips else None
        if forces is None:
            continue
        normal = float(forces[int(v.normal[contact])])
        grip = max(grips, key=lambda k: abs(forces[k]))
        pull = abs(float(forces[grip]))
        if pull > max(normal, 0.0):
            return (
                f"{rows[grip].title} rolls while {name!r} is closed, and needs {pull:.3g} N of grip where {name!r} "
                f"presses with {normal + 0.0:.3g} N: the wheel can neither roll nor fly there, it slips; give {name!r} "
                "friction=mu and leave the rolling out, so that friction decides"
            )
    return ""


def _forces_with(stepper: Stepper, contact: int) -> np.ndarray | None:
    """−λ of all rows with this contact closed at the accepted state, 0 of those that do not act; None if singular."""
    v = stepper.kernel
    flags = v.closed[: v.n_contacts].copy()
    flags[contact] = 1
    held, terms = stepper.acting(flags), stepper.terms(stepper.manager.penalties(flags))
    try:
        solved = np.linalg.solve(terms.saddle(held), -np.concatenate([terms.f, terms.bias[held]]))
    except np.linalg.LinAlgError:
        return None
    forces = np.zeros(v.n_rows)
    forces[held] = -solved[v.n :]
    return forces
