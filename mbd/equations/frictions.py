"""Dry friction that truly sticks: along the tangent of a contact, and in joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mbd.constraints.unilateral import Unilateral
from mbd.equations.derivation_scope import DerivationScope, Generalized
from mbd.equations.dynamics import Work
from mbd.equations.equations import Effect, Friction, Row
from mbd.equations.laws import Laws
from mbd.errors import CapabilityError
from mbd.joints.base import Joint
from mbd.tape.derivatives import substitute
from mbd.tape.functions import maximum, sqrt
from mbd.tape.node import Node, Scalar

__all__ = ["dry_joint", "sliding_contact"]


def sliding_contact(
    found: Laws,
    scope: DerivationScope,
    dynamics: Generalized,
    law: Unilateral,
    numbers: list[int],
    captured: dict[int, Node],
) -> None:
    """Coulomb friction along the tangent of a contact, ``|λ_T| ≤ μ p``; the direction is that at the point of now."""
    normal, *tangents = [k for k in numbers if k >= 0]
    if len(tangents) != 1:
        raise CapabilityError(
            f"Unilateral '{law.name}': friction {law.friction:g} needs one direction of sliding, but its point can "
            f"slide in {len(tangents)}; friction is solved in planar models: in space use friction=None (it sticks) or "
            "0"
        )
    (row,) = tangents
    here = {scope.tape.input("anchor", k): value for k, value in captured.items()}
    view = substitute(scope.rates([found.viewed[row]]), here)[0]
    coefficient = scope.parameter(law.name, "mu", law.friction or 0.0)
    push = -scope.tape.input("lam", normal)
    limit = coefficient * (maximum(push, 0.0) if law.opens_on == "when" else push)  # none while a rule lets it pull
    _add(found, scope, dynamics, law.name, row, found.rows[row].contact, view, limit)


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
        name = joint.name if len(joint.labels) == 1 else f"{joint.name}.{joint.labels[place].name}"
        unit = joint.labels[place].unit
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
