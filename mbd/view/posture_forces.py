"""Forces of the ground in the picture of a state."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.errors import MbdError
from mbd.simulation.simulate import simulate
from mbd.view.pushes import Push
from mbd.view.scene import Scene
from mbd.view.style import INK, tone

if TYPE_CHECKING:
    from mbd.results.trajectory import Trajectory
    from mbd.state import State

__all__ = ["draw_forces", "with_forces"]

FORCE_COLOR = "#009E73"


def with_forces(model: Any, state: State) -> Trajectory | None:
    """A run of one row, the state with the forces that act in it; None where none of a contact is known.

    Contacts that are open push nothing. Of models with controllers, which would have to be called, no force is shown.
    """
    if not state.mode.closed or model.controllers:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run = simulate(model, state, dt=1e-3, until=float(state.time))
    except MbdError:
        return None
    return run if len(run) == 1 else None


def draw_forces(axes: Any, picture: Scene, rows: Matrix, size: float) -> None:
    """Arrows from where contacts touch, in proportion; the largest is labelled [N].

    rows : the camera; size : of the mechanism [m]
    """
    pushes = [push for push in picture.pushes if np.any(push.force[0])]
    forces = [float(np.linalg.norm(push.force[0])) for push in pushes]
    # the largest force, over the size of the mechanism
    ends = [_arrow(axes, push, rows, size / (3.0 * max(forces))) for push in pushes]
    if pushes:
        text, end = f"{max(forces):.3g} N", ends[int(np.argmax(forces))]
        axes.annotate(text, end, (4.0, 2.0), textcoords="offset points", color=tone(INK), fontsize=8.0, zorder=7)


def _arrow(axes: Any, push: Push, rows: Matrix, scale: float) -> Vector:
    """Where it ends in the picture."""
    start = rows[:2] @ push.place[0]
    end = start + scale * (rows[:2] @ push.force[0])
    how = {
        "arrowstyle": "-|>",
        "color": tone(FORCE_COLOR),
        "lw": 1.8,
        "shrinkA": 0.0,
        "shrinkB": 0.0,
        "mutation_scale": 11.0,
    }
    axes.annotate("", end, start, arrowprops=how, zorder=7)
    return np.asarray(end)
