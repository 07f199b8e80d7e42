"""Turns of a whole scene about the vertical: heading as a direction that changes nothing.

A walker on level ground walks along any heading alike. A turn S by ψ about the vertical n takes the place and the
rates of a floating body to S p and S ṗ, its quaternion q to exp(ψ n/2) ⊗ q, and leaves angular velocities in axes of
the body as they are; a hinge about the vertical turns by ψ. Where the mechanism is the same after such a turn, a state
stands for all its headings: of two of them the difference is taken once the one is turned as the other,

    tᵀ (q turned by ψ ⊖ q₀) = 0,   t = ∂(q₀ turned by ψ ⊖ q₀)/∂ψ at ψ = 0

so that what comes back need not come back along the same heading: a gait that turns by an angle each stride repeats
itself too. That the mechanism is the same is tried at some states: inertia, forces, gaps and events, and of all rows
what does not depend on the directions along the ground that they are written in, BᵀB, Bᵀḣ and Bᵀ(Ḃv).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL
from mbd.gait.heading_parts import Part, parts_of
from mbd.gait.reflection import in_space

ROUNDS, FINE = 12, 1e-15
"""Newton steps by which a state is turned as another, and the last of them [rad]."""


@dataclass(frozen=True, eq=False)
class Heading:
    """The turns of a mechanism about the vertical.

    parts : joints that a turn changes; compose : of the configuration
    """

    mechanism: Mechanism
    parts: tuple[Part, ...]

    def turned(self, q: Vector, v: Vector, angle: float) -> tuple[Vector, Vector]:
        """Coordinates and velocities after a turn by an angle [rad]."""
        q, v = np.array(q, dtype=float), np.array(v, dtype=float)
        for part in self.parts:
            part.turn(q, v, angle)
        return q, v

    def tangent(self, q: Vector) -> Vector:
        """t (n_v,): the increments of q by a turn, for each radian."""
        h, configuration = 1e-3, self.mechanism.equations.configuration
        ends = [configuration.difference(q, self.turned(q, np.zeros(configuration.n_v), s * h)[0]) for s in (1, -1)]
        far = [configuration.difference(q, self.turned(q, np.zeros(configuration.n_v), s * h)[0]) for s in (2, -2)]
        return np.asarray((8.0 * (ends[0] - ends[1]) - (far[0] - far[1])) / (12.0 * h))

    def rate_tangent(self, q: Vector, v: Vector) -> Vector:
        """∂(v turned by ψ)/∂ψ (n_v,) at ψ = 0: those along the ground turn by a quarter."""
        quarter, half = (self.turned(q, v, angle)[1] for angle in (0.5 * np.pi, np.pi))
        return np.asarray(quarter - 0.5 * (v + half))

    def angle(self, base: Vector, q: Vector, tangent: Vector) -> float:
        """By which q must be turned so that its difference from the base has no part along the tangent [rad]."""
        difference = self.mechanism.equations.configuration.difference
        none, size, angle = np.zeros(len(tangent)), float(tangent @ tangent), 0.0
        for _ in range(ROUNDS):
            step = -float(tangent @ difference(base, self.turned(q, none, angle)[0])) / size
            angle += step
            if abs(step) <= FINE:
                break
        return angle


def heading_of(
    model: Any, mechanism: Mechanism, parameters: Vector, values: dict[str, float], named: set[str] | None
) -> Heading | None:
    """The turns about the vertical, where the mechanism is the same after them; None where it is not.

    Parameters
    ----------
    values : of parameters by name, of which gravity tells the vertical
    named : coordinates and rates that resets of events set or read; None: any
    """
    if named is None or not in_space(model):
        return None
    gravity = np.array([values.get(f"gravity.{axis}", 0.0) for axis in "xyz"])
    size = float(np.linalg.norm(gravity))
    up = -gravity / size if size > 0.0 else np.array([0.0, 1.0, 0.0])
    parts = parts_of(model, up)
    if parts is None:
        return None
    changed = _names(mechanism, parts)
    found = Heading(mechanism, tuple(parts))
    return found if not changed & named and _is_the_same(found, parameters) else None


def _names(mechanism: Mechanism, parts: Sequence[Part]) -> set[str]:
    """Names of the coordinates and velocities that a turn changes."""
    configuration = mechanism.equations.configuration
    places = {configuration.names[k] for part in parts for k in part.q}
    return places | {configuration.velocity_names[k] for part in parts if part.kind == "place" for k in part.v}


def _is_the_same(heading: Heading, parameters: Vector) -> bool:
    """Whether inertia, forces, rows, gaps and events of turned motions are turned with them."""
    mechanism, random = heading.mechanism, np.random.default_rng(13)
    layout, configuration = mechanism.layout, mechanism.equations.configuration
    defaults = np.array(configuration.defaults)
    for _ in range(4):  # states at which the mechanism is compared with itself
        q0, q = (configuration.compose(defaults, end) for end in random.uniform(-0.5, 0.5, (2, layout.n_v)))
        y, angle = random.uniform(-1.0, 1.0, layout.n), float(random.uniform(-3.0, 3.0))
        turn = np.eye(layout.n)
        for k in range(layout.n_v):
            turn[: layout.n_v, k] = heading.turned(q, np.eye(layout.n_v)[k], angle)[1]
        begun, _ = heading.turned(q0, y[: layout.n_v], angle)
        image, rates = heading.turned(q, y[: layout.n_v], angle)
        here = _numbers(mechanism, parameters, (q0, q, y), np.eye(layout.n))
        there = _numbers(mechanism, parameters, (begun, image, np.append(rates, y[layout.n_v :])), turn)
        for mine, its in zip(here, there, strict=True):
            size = max(1.0, float(np.max(np.abs(mine), initial=0.0)))
            if not float(np.max(np.abs(mine - its), initial=0.0)) <= EQUAL_RTOL * size:
                return False
    return True


def _numbers(mechanism: Mechanism, parameters: Vector, at: tuple[Vector, Vector, Vector], turn: Matrix) -> list[Vector]:
    """What a turn must leave as it is, at (where feet touched, q, y), turned back."""
    touched, q, y = at
    layout, equations = mechanism.layout, mechanism.equations
    none, guards = np.zeros(layout.n_anchors), np.zeros(max(mechanism.sizes["guards"], 1))
    held = mechanism.acceleration_terms(0.0, touched, np.zeros(layout.n), parameters, none).captured
    anchors = np.concatenate([held, none])[: layout.n_anchors]
    terms = mechanism.acceleration_terms(0.0, q, y, parameters, anchors)
    mechanism.common["guards"](mechanism.block(0.0, q, y, anchors), parameters, guards)
    watched = 4 * len(equations.contacts) + 2 * len(equations.guards)
    B = terms.B @ turn
    rows = [B.T @ B, B.T @ terms.rate, B.T @ terms.bias, B.T @ terms.h]
    return [turn.T @ terms.M @ turn, turn.T @ terms.f, *rows, guards[:watched]]
