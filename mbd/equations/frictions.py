"""Dry friction that truly sticks: along the tangent of a contact, and in joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from mbd.equations.derivation_scope import DerivationScope, Generalized
from mbd.equations.dynamics import Work
from mbd.equations.equations import Effect, Friction, Row
from mbd.equations.laws import Laws
from mbd.errors import CapabilityError
from mbd.joints.base import Joint
from mbd.tape.derivatives import substitute
from mbd.tape.functions import sqrt
from mbd.tape.node import Node, Scalar

__all__ = ["dry_friction", "dry_joint", "sliding_contact"]


def sliding_contact(
    found: Laws,
    scope: DerivationScope,
    dynamics: Generalized,
    name: str,
    numbers: Sequence[int],
    limits: Sequence[tuple[int, Any]],
    captured: dict[int, Node],
) -> None:
    """Friction along the tangent of a contact, ``|λ_T| ≤ limit(p)``; the direction is that at the point of now."""
    tangents = [(row, limit) for row, limit in limits if row >= 0]
    if len(tangents) != 1 or len(numbers) != 2:
        raise CapabilityError(
            f"'{name}': friction needs one direction of sliding, but its point can slide in {len(numbers) - 1}; "
            "friction is solved in planar models: in space use friction=None (it sticks) or 0"
        )
    ((row, law),) = tangents
    here = {scope.tape.input("anchor", k): value for k, value in captured.items()}
    view = substitute(scope.rates([found.viewed[row]]), here)[0]
    limit = scope.tape.lift(law(-scope.tape.input("lam", numbers[0])) if callable(law) else law)
    _add(found, scope, dynamics, name, row, found.rows[row].contact, view, limit)


def dry_friction(
    found: Laws, scope: DerivationScope, dynamics: Generalized, name: str, row: int, contact: int, limit: Node
) -> None:
    """Dry friction along a row on velocities, ``|λ| ≤ limit``."""
    _add(found, scope, dynamics, name, row, contact, found.viewed[row], limit)


def dry_joint(found: Laws, scope: DerivationScope, dynamics: Generalized, joint: Joint) -> None:
    """Set-valued losses of a joint: a row on each of its rates, held while ``|λ| ≤ limit``."""
    rates: Sequence[Scalar] | None = None
    for place, owner, loss in joint.losses():
        load = _pin_load(found, scope, joint) if loss.needs_reaction else 0.0
        limit = loss.dry(load, scope, owner)
        if (isinstance(limit, float) and limit == 0.0) or (isinstance(limit, Node) and limit.is_zero):
            continue
        rates = scope.joint(joint.name).rates if rates is None else rates
        view = scope.tape.lift(rates[place])
        name = joint.name if len(joint.freedoms) == 1 else f"{joint.name}.{joint.freedoms[place].name}"
        unit = joint.freedoms[place].unit
        found.rows.append(Row(name, "dry", scope.tape.zero, scope.real(view), unit=unit, kind="velocity"))
        found.viewed.append(view)
        _add(found, scope, dynamics, name, len(found.rows) - 1, -1, view, scope.tape.lift(limit))


def _pin_load(found: Laws, scope: DerivationScope, joint: Joint) -> Node:
    """Resultant of the reaction at a cut joint [N]; rounded below 1e-9 N, where it has no direction."""
    square = scope.tape.lift(1e-18)
    for k, row in enumerate(found.rows):
        if row.owner == joint.name and row.contact < 0 and row.unit == "m" and not row.is_velocity:
            square = square + scope.tape.input("lam", k) * scope.tape.input("lam", k)
    return scope.tape.lift(sqrt(square))


def _add(
    found: Laws,
    scope: DerivationScope,
    dynamics: Generalized,
    name: str,
    row: int,
    contact: int,
    view: Node,
    limit: Node,
) -> None:
    """A direction of dry friction, its row marked as held by it, and its loss as an effect."""
    number = len(found.frictions)
    rate = scope.real(view)
    found.rows[row] = replace(found.rows[row], friction=number)
    found.frictions.append(Friction(name, row, contact, rate, scope.change(view), limit))
    found.sliding.append(view)
    multiplier = scope.tape.input("lam", row)
    work = Work()
    work.on_velocity(view, multiplier)
    found.effects.append(
        Effect(
            f"{name} friction", "loss",
            lambda: (*dynamics.generalized(work), *[scope.tape.zero] * len(scope.states)), -(multiplier * rate),
            column="friction",
        )
    )  # fmt: skip
