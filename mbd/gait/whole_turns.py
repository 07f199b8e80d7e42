"""Angles that come back after whole turns: a wheel on a hinge turns on and on, and stands as it did.

An angle counts its turns, so that a wheel's never comes back itself. Where a whole turn of it changes nothing, neither
inertia, forces, rows, gaps nor events, and no reset names it, a state stands for all states whose angle differs by
multiples of 2π. That is tried where an angle has gone further than half a turn, and nowhere else.
"""

import numpy as np

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism
from mbd.equal import EQUAL_RTOL
from mbd.gait.unmoved import reset_names


def angles(mechanism: Mechanism) -> list[int]:
    """Numbers of the increments that are angles of their own, none of a quaternion's."""
    configuration = mechanism.equations.configuration
    pairs = zip(configuration.places, configuration.freedoms, strict=True)
    return [k for k, (place, (_, unit)) in enumerate(pairs) if place >= 0 and unit == "rad"]


def unwound(mechanism: Mechanism, parameters: Vector, moved: Vector) -> Vector:
    """Differences of configurations (…, n_v) without whole turns that change nothing."""
    if np.abs(moved).max(initial=0.0) <= np.pi:
        return moved
    turned = [k for k in angles(mechanism) if np.max(np.abs(moved[..., k]), initial=0.0) > np.pi]
    turned = [k for k in turned if whole_turn_changes_nothing(mechanism, parameters, k)]
    if not turned:
        return moved
    found = np.array(moved)
    found[..., turned] -= 2.0 * np.pi * np.round(found[..., turned] / (2.0 * np.pi))
    return found


def whole_turn_changes_nothing(mechanism: Mechanism, parameters: Vector, k: int) -> bool:
    """Whether the mechanism is the same after a whole turn of the angle with this number."""
    known = mechanism.equations.memory.setdefault("whole turns", {})
    key = (k, parameters.tobytes())
    if key not in known:
        known[key] = _is_the_same(mechanism, parameters, k)
    return bool(known[key])


def _is_the_same(mechanism: Mechanism, parameters: Vector, k: int) -> bool:
    named, configuration = reset_names(mechanism.equations), mechanism.equations.configuration
    if named is None or configuration.names[configuration.places[k]] in named:
        return False
    layout, random = mechanism.layout, np.random.default_rng(17)
    defaults, move = np.array(configuration.defaults), np.zeros(layout.n_v)
    move[k] = 2.0 * np.pi
    for _ in range(3):  # states at which the mechanism is compared with itself
        touched, q = (configuration.compose(defaults, end) for end in random.uniform(-0.5, 0.5, (2, layout.n_v)))
        y = random.uniform(-1.0, 1.0, layout.n)
        turned = configuration.compose(q, move)
        for mine, its in zip(*(_numbers(mechanism, parameters, touched, at, y) for at in (q, turned)), strict=True):
            size = max(1.0, float(np.max(np.abs(mine), initial=0.0)))
            if not float(np.max(np.abs(mine - its), initial=0.0)) <= EQUAL_RTOL * size:
                return False
    return True


def _numbers(mechanism: Mechanism, parameters: Vector, touched: Vector, q: Vector, y: Vector) -> list[Vector]:
    """All that the motion follows from at (q, y), contacts holding what they touched at another position."""
    layout, none = mechanism.layout, np.zeros(mechanism.layout.n_anchors)
    held = mechanism.acceleration_terms(0.0, touched, np.zeros(layout.n), parameters, none).captured
    anchors, guards = np.concatenate([held, none])[: layout.n_anchors], np.zeros(max(mechanism.sizes["guards"], 1))
    terms = mechanism.acceleration_terms(0.0, q, y, parameters, anchors)
    mechanism.common["guards"](mechanism.block(0.0, q, y, anchors), parameters, guards)
    return [terms.M, terms.f, terms.R, terms.B, terms.rate, terms.bias, terms.h, guards]
