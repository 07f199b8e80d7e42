"""How far forces can be known where positions are known to a tolerance only."""

from typing import Any

import numpy as np

import mbd
from tests.fuzz.bodies import Bodies, mass_of
from tests.fuzz.geometry import Array
from tests.fuzz.quantities import gap_of


def unknown_force(bodies: Bodies, tol: float, h: Array, reach: float) -> Array:
    """What forces may miss where positions are off by `tol` [m, rad], rates by ``tol/h``: ``tol min(K + C/h, M/h²)``.

    K is the stiffness and C the damping of all springs and closed penalty contacts at the instant, M the whole mass:
    what is so stiff that a step of h does not follow it changes accelerations by tol/h² at most.

    Parameters
    ----------
    h : duration of the step that holds each instant (n,) [s]; reach : size of the mechanism, the arm of angles [m]

    Returns
    -------
    (n,) [N]
    """
    told, model = bodies.told, bodies.model
    parameters: Any = told.parameters
    K, C = np.zeros(len(told)), np.zeros(len(told))
    for word in model.contacts:
        if isinstance(word, mbd.Penalty):
            closed = told.closed[word.name]
            depth = np.where(closed, np.maximum(-gap_of(word.measure, bodies).value, 0.0), 0.0) + tol * reach
            stiffness = parameters[f"{word.name}.stiffness"]
            damping = parameters.get(f"{word.name}.damping", 0.0)
            if word.chi is not None:  # p = k δⁿ (1 − χ ġ / v), v the speed at which it closed
                fastest = np.max(np.abs(told[f"{word.name}.gap_rate"]), initial=1e-3)
                damping = word.chi * stiffness * depth**word.exponent / fastest
            K = K + closed * stiffness * word.exponent * depth ** (word.exponent - 1.0)
            C = C + closed * damping
    touched = {word.name for word in model.constraints}
    for name, value in parameters.items():
        if name.endswith(".stiffness") and name.removesuffix(".stiffness") not in touched:
            K = K + value
    whole = sum(mass_of(body, parameters).mass for body in model.bodies.values() if body is not model.ground)
    return np.asarray(tol * reach * np.minimum(K + C / h, whole / h**2))
