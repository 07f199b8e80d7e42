"""Rows, contacts and guards: what holds, what opens and closes, and what is watched."""

from __future__ import annotations

from collections.abc import Sequence

from mbd.constraints.base import Measure, VelocityConstraint
from mbd.constraints.bilateral import Bilateral
from mbd.constraints.event import Event
from mbd.constraints.penalty import Penalty
from mbd.constraints.unilateral import Unilateral
from mbd.equations.derivation_scope import DerivationScope, Generalized
from mbd.equations.dynamics import Work
from mbd.equations.effects import penalty_effect
from mbd.equations.equations import Contact, Guard, Row
from mbd.equations.frictions import dry_joint, sliding_contact
from mbd.equations.laws import Laws
from mbd.joints.base import Joint, row_unit
from mbd.tape.derivatives import gradient, live
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Node, Scalar

__all__ = ["anchors_held", "laws"]

FITS = 1e-9
"""Misfit of unmoving parts that counts as none [m, rad]: above the round-off of users' sums, far below a tolerance."""


def laws(
    scope: DerivationScope,
    dynamics: Generalized,
    joints: Sequence[Joint],
    bilaterals: Sequence[Bilateral | VelocityConstraint],
    contacts: Sequence[Unilateral | Penalty],
    events: Sequence[Event],
    before: Laws | None = None,
) -> Laws:
    """Cut joints, what always acts (positions first), dry joints, contacts and events, in the order of the model.

    They are added to those `before`.
    """
    found = Laws() if before is None else before
    for joint in scope.cuts:
        for part, value in scope.cut_rows(joint)[0]:
            if _row(found, scope, joint.name, part, value, unit=row_unit(part), may_fold=True) < 0:
                found.idle.append((joint.name, part))
    for constraint in bilaterals:
        if isinstance(constraint, VelocityConstraint):
            _velocity_rows(found, scope, constraint, contacts)
            continue
        _row(found, scope, constraint.name, "", constraint.residual(scope), unit=constraint.measure.unit)
    for joint in joints:
        dry_joint(found, scope, dynamics, joint)
    for number, contact in enumerate(contacts):
        if isinstance(contact, Penalty):
            _penalty(found, scope, dynamics, contact, number)
        else:
            _unilateral(found, scope, dynamics, contact, number)
    for event in events:
        found.guards.append(_guard(scope, event))
    return found


def anchors_held(scope: DerivationScope, contacts: Sequence[Unilateral | Penalty]) -> int:
    """How many values all contacts store as they close."""
    zero = scope.tape.zero
    return sum(len(law.captured(zero) if isinstance(law, Penalty) else _captured(scope, law)) for law in contacts)


def _captured(scope: DerivationScope, law: Unilateral) -> Sequence[Scalar]:
    """What a contact that holds its place stores as it closes."""
    return law.measure.captured(scope) if law.sticks or law.slides else ()


def _row(
    found: Laws,
    scope: DerivationScope,
    owner: str,
    part: str,
    value: Scalar,
    *,
    unit: str,
    contact: int = -1,
    may_fold: bool = False,
) -> int:
    """Add a row and give its number, or −1 for one that holds by itself."""
    view = scope.tape.lift(value)
    node, rate = scope.views.real([view, *scope.rates([view])])
    title = f"'{owner}'" + (f", row '{part}'" if part else "")
    kinds = {other.data[0] for other in live([node]) if other.op == "input"}
    if kinds & {"v", "z"}:
        found.faults.append(f"{title} depends on velocities or states; a constraint may depend on positions and t only")
    elif "x" not in kinds:
        found.faults += _idle(scope, node, title, kinds, unit, may_fold)
        return -1
    found.rows.append(Row(owner, part, node, rate, contact, unit))
    found.viewed.append(view)
    return len(found.rows) - 1


def _velocity_rows(
    found: Laws, scope: DerivationScope, law: VelocityConstraint, contacts: Sequence[Unilateral | Penalty]
) -> None:
    """Rows ``a(q, t) · v + b(q, t) = 0``, with what is wrong with them; some hold while a contact is closed."""
    numbers = [k for k, contact in enumerate(contacts) if contact.name == law.contact]
    number = numbers[0] if numbers else -1
    if number >= 0 and isinstance(contacts[number], Penalty):
        found.faults.append(
            f"'{law.name}': only_while='{law.contact}' is a penalty contact, whose impacts take time; name a Unilateral"
        )
    for part, value in law.rates(scope):
        view = scope.tape.lift(value)
        rate = scope.real(view)
        title = f"'{law.name}'" + (f", row '{part}'" if part else "")
        slopes = gradient(rate, scope.inputs.v)
        if {other.data[0] for other in live([rate]) if other.op == "input"} & {"z", "s", "a"}:
            found.faults.append(f"{title} depends on states; it may depend on velocities, positions and t only")
        elif any(other.op == "input" and other.data[0] == "v" for other in live(slopes)):
            found.faults.append(
                f"{title} is not linear in velocities; give a row a(q) · v + b(t), a sum of rates times functions of "
                "positions and t"
            )
        elif all(slope.is_zero for slope in slopes):
            found.faults.append(
                f"{title} holds no velocity, so it constrains nothing; let rates such as 'body.x.rate' enter it, or "
                "use mbd.Bilateral for positions"
            )
        else:
            found.rows.append(
                Row(law.name, part, scope.tape.zero, rate, unit=law.unit, kind="velocity", contact=number)
            )
            found.viewed.append(view)


def _idle(scope: DerivationScope, node: Node, title: str, kinds: set[str], unit: str, may_fold: bool) -> list[str]:
    """What is wrong with a row that no motion changes."""
    if "anchor" in kinds:
        return []
    if "t" in kinds:
        return [f"{title} prescribes in time what no motion changes; let it depend on the posture"]
    given: dict[Node | tuple[str, int], float] = {
        ("p", k): parameter.value for k, parameter in enumerate(scope.parameters.found)
    }
    (size,) = evaluate([node], given)
    if abs(size) > FITS:
        return [f"{title} is {size:.6g} {unit} whatever the motion, so it can never be 0"]
    return [] if may_fold else [f"{title} is 0 whatever the motion, so it constrains nothing; remove it"]


def _unilateral(found: Laws, scope: DerivationScope, dynamics: Generalized, law: Unilateral, number: int) -> None:
    """A normal row, and tangent rows that hold the place of touchdown where and while it sticks."""
    gap = scope.tape.lift(law.measure.gap(scope))
    unit = law.measure.unit
    numbers = [_row(found, scope, law.name, "normal", gap, unit=unit, contact=number)]
    held_by = law.sticks or law.slides
    captured, anchors = _anchored(found, scope, _captured(scope, law))
    if held_by:
        held = [scope.tape.input("anchor", k) for k in anchors]
        for part, value in law.measure.tangents(scope, held):
            numbers.append(_row(found, scope, law.name, part, value, unit="m", contact=number, may_fold=True))
    if law.slides:
        sliding_contact(found, scope, dynamics, law, numbers, dict(zip(anchors, captured, strict=True)))
    condition = law.only_while
    gap, rate = scope.views.real([gap, *scope.rates([gap])])
    found.contacts.append(
        Contact(
            law.name, law.kind, gap, rate, tuple(k for k in numbers if k >= 0), captured, anchors,
            opens_on=law.opens_on, when=tuple((rule.other, rule.after_impact) for rule in law.releases),
            only_while=scope.real(condition.gap(scope)) if isinstance(condition, Measure) else condition,
            restitution=law.restitution, unit=unit, may_pull=any(rule.may_pull for rule in law.releases),
        )
    )  # fmt: skip


def _anchored(
    found: Laws, scope: DerivationScope, values: Sequence[Scalar]
) -> tuple[tuple[Node, ...], tuple[int, ...]]:
    """What a contact stores as it closes, and the numbers of its anchors."""
    captured = tuple(scope.real(value) for value in values)
    first = sum(len(contact.anchors) for contact in found.contacts)
    return captured, tuple(range(first, first + len(captured)))


def _penalty(found: Laws, scope: DerivationScope, dynamics: Generalized, law: Penalty, number: int) -> None:
    """A force law on a gap: −p ∂g/∂q on the left-hand side while it acts."""
    gap = scope.tape.lift(law.measure.gap(scope))
    if not any(node.op == "input" and node.data[0] == "x" for node in live([scope.real(gap)])):
        found.faults.append(f"the gap of '{law.name}' is the same whatever the motion; let it depend on the posture")
    rate = scope.rates([gap])[0]
    captured, anchors = _anchored(found, scope, law.captured(rate))
    force = scope.tape.lift(law.force(gap, rate, scope, *[scope.tape.input("anchor", k) for k in anchors]))
    generalized = (*dynamics.generalized(Work([gap], [-force])), *[scope.tape.zero] * len(scope.states))
    found.penalties.append((number, gap, force))
    energy = law.elastic_energy(gap, scope)
    elastic = None if energy is None else scope.real(energy)
    gap, rate, force = scope.views.real([gap, rate, force])
    found.contacts.append(
        Contact(
            law.name, law.kind, gap, rate, captured=captured, anchors=anchors, force=force, generalized=generalized,
            opens_on=law.opens_on, unit=law.measure.unit,
        )
    )  # fmt: skip
    found.effects.append(penalty_effect(law.name, number, gap, rate, force, generalized, scope, elastic))


def _guard(scope: DerivationScope, event: Event) -> Guard:
    """A user's event; its measure may depend on velocities."""
    value = event.guard.gap(scope)
    return Guard(event.name, scope.real(value), scope.change(value), event.direction, event.terminal, event.reset)
