"""Derivatives by increments where coordinates do not add."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mbd.equations.equations import Equations
from mbd.equations.inputs import Inputs
from mbd.tape.derivatives import jvps
from mbd.tape.node import Node, Scalar

__all__ = ["chart_columns"]


def chart_columns(equations: Equations, values: Sequence[Node]) -> list[list[Node]]:
    """∂values/∂x (n_v lists): at the center of a chart those along velocities, as tangents are here."""
    inputs = Inputs.of(equations)
    known: Sequence[Any] = [{} for _ in range(len(inputs.x))]
    if equations.geometry is not None:
        known = equations.geometry.partials(values)
    moving = inputs.by_increments(known)
    seeds: list[dict[Node, Scalar]] = [{x: 1.0, **moving[j]} for j, x in enumerate(inputs.x)]
    return jvps(values, seeds)
