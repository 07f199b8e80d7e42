"""Whether a steady motion of bodies that turn freely stays the same in axes that turn with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mbd.analysis.instant import Instant
from mbd.equations.linearization import LinearTerms
from mbd.notes import doubt

__all__ = ["doubt_of_turning"]

DERIVATIVE_RTOL = 1e-5
"""Change of the derivatives within that, over their size, that counts as one [-]."""


def doubt_of_turning(found: Instant, terms: LinearTerms) -> None:
    """Tell where derivatives change along a motion whose joints with quaternions turn: eigenvalues are not of it."""
    configuration, state = found.mechanism.equations.configuration, found.state
    speed = float(np.max(np.abs(state.v), initial=0.0))
    if configuration.is_vector or speed == 0.0:
        return
    names = configuration.velocity_names
    turning = [k for k, name in enumerate(names) if ".angular_velocity." in name and abs(state.v[k]) > 1e-9 * speed]
    if not turning:
        return
    # how far the motion is followed, as an angle of the fastest turn [rad]
    step = 1e-3 / float(np.max(np.abs(state.v[turning])))
    turned = np.where(np.isin(np.arange(len(names)), turning), state.v[: len(names)], 0.0)
    ahead = replace(found, state=replace(state, q=configuration.compose(state.q, step * turned))).terms()
    pairs = [(getattr(terms, name), getattr(ahead, name)) for name in ("M", "C", "K", "B")]
    if all(np.max(np.abs(a - b), initial=0.0) <= DERIVATIVE_RTOL * np.max(np.abs(a), initial=0.0) for a, b in pairs):
        return
    fastest = names[max(turning, key=lambda k: abs(state.v[k]))].partition(".")[0]
    doubt(
        f"linearize: '{fastest}' turns, and the derivatives change along its motion: A is that of this instant, and "
        "its eigenvalues do not tell whether the motion is stable; give what spins steadily a Revolute about its axis"
    )
