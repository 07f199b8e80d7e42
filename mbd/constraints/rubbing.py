"""Friction of contacts that push by a force law: Coulomb's law, made smooth where nothing slides."""

from __future__ import annotations

from collections.abc import Sequence

from mbd.bodies.scope import Scope
from mbd.constraints.law import Drag, Hold
from mbd.constraints.measure import Measure
from mbd.tape.derivatives import substitute
from mbd.tape.functions import maximum, sqrt
from mbd.tape.node import Node, Scalar

__all__ = ["rub", "slip_velocities"]


def slip_velocities(measure: Measure, scope: Scope, hold: Hold) -> list[tuple[str, Scalar]]:
    """(part, velocity [m/s]) of the contact point along the surface, forward and sideways.

    Those of a measure with tangents are the rates of their residuals, with the directions at the point of now.
    """
    captured = measure.captured(scope)
    held = hold(captured)
    here = {anchor: value for anchor, value in zip(held, captured, strict=True) if isinstance(anchor, Node)}
    found: list[tuple[str, Scalar]] = []
    for part, residual in measure.tangents(scope, held):
        rate = scope.rate(residual)
        found.append((part, substitute([rate], here)[0] if isinstance(rate, Node) else rate))
    return found + [(part, velocity) for part, velocity in measure.slip_velocities(scope)]


def rub(velocities: Sequence[tuple[str, Scalar]], limit: Scalar, creep: Scalar) -> list[Drag]:
    """``f = −limit γ/√(‖γ‖² + creep²)``: opposite to γ in the plane of contact, limit where it slides fast.

    Parameters
    ----------
    velocities : γ, one or two parts [m/s]; a force acts along those that the mechanism can change
    limit : μ p [N]
    creep : speed at which friction is 1/√2 of that [m/s]
    """
    square: Scalar = creep * creep
    for _, velocity in velocities:
        square = square + velocity * velocity
    size: Scalar = maximum(limit, 0.0) / sqrt(square)
    if len(velocities) == 1:
        return [Drag(velocity, -1.0 * size * velocity) for _, velocity in velocities]
    return [Drag(velocity, -1.0 * size * velocity, f"friction.{part}", True) for part, velocity in velocities]
