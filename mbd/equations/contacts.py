"""Rows, contacts and guards: what holds, what opens and closes, and what is watched."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial

from mbd.bodies.promises import called
from mbd.constraints.base import Constraint
from mbd.constraints.event import Event
from mbd.constraints.law import Closing, Equation, Law, Rubbing
from mbd.constraints.machine import state_of
from mbd.constraints.measure import Measure, gap_of
from mbd.equal import EQUAL_RTOL
from mbd.equations.derivation_scope import DerivationScope, Generalized
from mbd.equations.dynamics import Work
from mbd.equations.effects import drag_effect, penalty_effect
from mbd.equations.equations import Contact, Effect, Guard, Row
from mbd.equations.frictions import dry_friction, dry_joint, sliding_contact
from mbd.equations.gathered import Gathered
from mbd.equations.law_of import Holding, law_of
from mbd.equations.laws import Laws
from mbd.equations.states import with_states
from mbd.joints.base import Joint, row_unit
from mbd.tape.derivatives import gradient, live, substitute
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Node, Scalar

Drags = tuple[tuple[str, Node, Node], ...]


def laws(
    scope: DerivationScope,
    dynamics: Generalized,
    joints: Sequence[Joint],
    always: Sequence[Constraint],
    contacts: Sequence[Constraint],
    events: Sequence[Event],
    gathered: Gathered,
    before: Laws | None = None,
    written: Collection[str] = (),
) -> Laws:
    """Cut joints, what always acts (positions first), dry joints, contacts and events, in the order of the model.

    They are added to those `before`; errors are `gathered`. Parameters that controllers have `written` may make an
    event happen.
    """
    found = Laws() if before is None else before
    for joint in scope.cuts:
        for part, value in scope.cut_rows(joint)[0]:
            if _row(found, scope, joint.name, Equation(value, part, row_unit(part), may_fold=True)) < 0:
                found.idle.append((joint.name, part))
    for word in always:
        with gathered.catch(word.name):
            _always(found, scope, dynamics, word, contacts)
    for joint in joints:
        with gathered.catch(joint.name):
            dry_joint(found, scope, dynamics, joint)
    for number, word in enumerate(contacts):
        with gathered.catch(word.name):
            _contact(found, scope, dynamics, word, number, contacts)
    for event in events:
        with gathered.catch(event.name):
            found.guards.append(_guard(scope, event))
            found.faults += _never(scope, found.guards[-1], written)
    found.contacts = [
        replace(contact, generalized=with_states(scope, contact.generalized)) if contact.generalized else contact
        for contact in found.contacts
    ]
    gathered.add(found.faults)
    return found


def anchors_held(scope: DerivationScope, contacts: Sequence[Constraint]) -> int:
    """How many values all contacts store as they close."""
    return sum(called(word, "anchors", "act(scope, hold)", scope) for word in contacts)


def _always(
    found: Laws, scope: DerivationScope, dynamics: Generalized, word: Constraint, contacts: Sequence[Constraint]
) -> None:
    """Rows that act at all times, or as long as another contact is closed."""
    law = law_of(word, Holding(scope, 0), contacts)
    found.rates += law.rates
    numbers = [k for k, contact in enumerate(contacts) if contact.name == law.while_closed]
    number = numbers[0] if numbers else -1
    if number >= 0 and contacts[number].kind == "penalty":
        found.faults.append(
            f"'{word.name}': only_while='{law.while_closed}' is a penalty contact, whose impacts take time; name a "
            "Unilateral"
        )
    for row in law.rows:
        if row.level == "position" and row.limit is None:
            _row(found, scope, word.name, row)
            continue
        if _velocity_row(found, scope, word.name, row, number) and row.limit is not None:
            name = f"{word.name}.{row.part}" if row.part else word.name
            limit = row.limit(scope.tape.zero) if callable(row.limit) else row.limit
            sliding = None if row.sliding is None else partial(row.sliding, scope.tape.zero)
            dry_friction(found, scope, dynamics, name, len(found.rows) - 1, number, scope.tape.lift(limit), sliding)


def _row(found: Laws, scope: DerivationScope, owner: str, row: Equation, contact: int = -1) -> int:
    """Add a row of positions and give its number, or −1 for one that holds by itself."""
    part, unit = row.part, row.unit
    view = scope.tape.lift(row.value)
    node, rate = scope.views.real([view, *scope.rates([view])])
    title = f"'{owner}'" + (f", row '{part}'" if part else "")
    kinds = {other.data[0] for other in live([node]) if other.op == "input"}
    if kinds & {"v", "z"}:
        found.faults.append(f"{title} depends on velocities or states; a constraint may depend on positions and t only")
    elif "x" not in kinds:
        found.faults += _idle(scope, node, title, kinds, unit, row.may_fold)
        return -1
    found.rows.append(Row(owner, part, node, rate, contact, unit, reaction=row.reaction, wraps=row.wraps))
    found.viewed.append(view)
    return len(found.rows) - 1


def _velocity_row(found: Laws, scope: DerivationScope, owner: str, row: Equation, contact: int) -> bool:
    """Add a row ``a(q, t) · v + b(q, t) = 0``, or what is wrong with it; whether it was added."""
    view = scope.tape.lift(row.value)
    rate = scope.real(view)
    title = f"'{owner}'" + (f", row '{row.part}'" if row.part else "")
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
        found.rows.append(Row(owner, row.part, scope.tape.zero, rate, unit=row.unit, kind="velocity", contact=contact))
        found.viewed.append(view)
        return True
    return False


def _idle(scope: DerivationScope, node: Node, title: str, kinds: set[str], unit: str, may_fold: bool) -> list[str]:
    """What is wrong with a row that no motion changes."""
    if "anchor" in kinds:
        return []
    if "t" in kinds:
        return [f"{title} prescribes in time what no motion changes; let it depend on the posture"]
    asked = [each.data for each in live([node]) if each.op == "input"]
    given: dict[Node | tuple[str, int], float] = {
        (kind, k): scope.parameters.found[k].value for kind, k in asked if kind == "p"
    }
    (size,) = evaluate([node], given)
    if abs(size) > EQUAL_RTOL:
        return [f"{title} is {size:.6g} {unit} whatever the motion, so it can never be 0"]
    empty = f"{title} is 0 whatever the motion, so it constrains nothing; remove it, or check the axes of its joints"
    return [] if may_fold else [empty]


def _contact(
    found: Laws, scope: DerivationScope, dynamics: Generalized, word: Constraint, number: int,
    contacts: Sequence[Constraint],
) -> None:  # fmt: skip
    """A law that closes and opens, by rows or by a force."""
    holding = Holding(scope, scope.first_anchor + sum(len(contact.anchors) for contact in found.contacts))
    law = law_of(word, holding, contacts)
    found.rates += _rates_of_contact(scope, law, number)
    if law.contact is not None:
        by = _by_force if law.push is not None else _by_rows
        found.contacts.append(by(found, scope, dynamics, word, law, law.contact, holding, number))


def _rates_of_contact(scope: DerivationScope, law: Law, number: int) -> list[tuple[Node, Scalar]]:
    """The rates of its states while it is closed, and while it is open."""
    if law.rates_while_open is True:
        return list(law.rates)
    open_rates: Sequence[Scalar] = [0.0] * len(law.rates) if law.rates_while_open is False else law.rates_while_open
    switch = scope.tape.input("switch", number)
    return [
        (state, alone + switch * (rate - alone)) for (state, rate), alone in zip(law.rates, open_rates, strict=True)
    ]


def _by_rows(
    found: Laws, scope: DerivationScope, dynamics: Generalized, word: Constraint, law: Law, at: Closing,
    holding: Holding, number: int,
) -> Contact:  # fmt: skip
    """A normal row, and tangent rows that hold a place, or resist sliding up to a limit."""
    numbers = [
        _row(found, scope, word.name, row, number) if row.level == "position"
        else (len(found.rows) - 1 if _velocity_row(found, scope, word.name, row, number) else -1)
        for row in law.rows
    ]  # fmt: skip
    acting = tuple(k for k in numbers if k >= 0)
    captured = dict(zip(holding.anchors, holding.captured, strict=True))
    limited = [(k, row) for k, row in zip(numbers, law.rows, strict=True) if row.limit is not None]
    if limited:
        sliding_contact(found, scope, dynamics, word.name, acting, limited, captured)
    drags = (
        _rubbing_contact(found, scope, dynamics, word.name, number, numbers[0], law.rubbing, captured)
        if law.rubbing is not None and numbers[0] >= 0
        else ()
    )
    condition = at.only_while
    gap = scope.tape.lift(at.gap)
    gap, rate = scope.views.real([gap, *scope.rates([gap])])
    others = [rule for rule in at.releases if state_of(rule.other, scope.modes) is None]
    return Contact(
        word.name, word.kind, gap, rate, acting, tuple(holding.captured), holding.anchors, opens_on=at.opens_on,
        when=tuple((rule.other, rule.after_impact) for rule in others),
        released_in=tuple(rule.other for rule in at.releases if rule not in others),
        only_while=_watched(condition, scope),
        restitution=at.restitution, unit=at.unit, may_pull=any(rule.may_pull for rule in at.releases), drags=drags,
        undefined=_undefined(word),
    )  # fmt: skip


def _watched(condition: str | Measure | None, scope: DerivationScope) -> str | Node | None:
    """The contact that must be closed, or what must be positive; of a state of a mode, as long as it lasts."""
    if isinstance(condition, Measure):
        return scope.real(gap_of(condition, scope))
    found = None if condition is None else state_of(condition, scope.modes)
    if found is None:
        return condition
    name, state = found
    return scope.tape.lift(0.5 - abs(scope.named(name) - float(state)))


def _by_force(
    found: Laws, scope: DerivationScope, dynamics: Generalized, word: Constraint, law: Law, at: Closing,
    holding: Holding, number: int,
) -> Contact:  # fmt: skip
    """A force law: −p ∂g/∂q on the left-hand side while it acts, −p ∂g/∂v where g is a velocity, and its drags."""
    lift = scope.tape.lift
    gap, force = lift(at.gap), lift(law.push if law.push is not None else 0.0)
    inside = {node.data[0] for node in live([scope.real(gap)]) if node.op == "input"}
    fast = "v" in inside
    if not inside & {"x", "v"}:
        found.faults.append(f"the gap of '{word.name}' is the same whatever the motion; let it depend on the posture")
    work = Work([], [], [gap], [-force]) if fast else Work([gap], [-force])
    generalized = tuple(dynamics.generalized(work))
    found.penalties.append((number, gap, force))
    elastic = None if law.elastic is None else scope.real(law.elastic)
    rate = scope.change(gap) if fast else scope.rates([gap])[0]
    gap, rate, force = scope.views.real([gap, rate, force])
    found.effects.append(penalty_effect(word.name, number, gap, rate, force, generalized, scope, elastic, fast))
    drags: list[tuple[str, Node, Node]] = []
    for drag in law.drags:
        velocity, resistance = lift(drag.velocity), lift(drag.force)
        if drag.may_fold and all(slope.is_zero for slope in gradient(scope.real(velocity), scope.inputs.v)):
            continue
        found.drags.append((number, velocity, resistance))
        speed, size = scope.views.real([velocity, resistance])
        drags.append((drag.part, speed, size))
    for title in dict.fromkeys(part.partition(".")[0] for part, _, _ in drags):  # of all its directions
        own = [k for k, (part, _, _) in enumerate(drags) if part.partition(".")[0] == title]
        views = [found.drags[k - len(drags)] for k in own]
        work = Work([], [], [velocity for _, velocity, _ in views], [-force for _, _, force in views])
        moving = [drags[k][1:] for k in own]
        along = dynamics.generalized(work)
        column = "friction" if title == "friction" else "penalty"
        found.effects.append(drag_effect(f"{word.name} {title}", number, moving, along, scope, column))
    return Contact(
        word.name, word.kind, gap, rate, captured=tuple(holding.captured), anchors=holding.anchors, force=force,
        generalized=generalized, opens_on=at.opens_on, unit=f"{at.unit}/s" if fast else at.unit, drags=tuple(drags),
        only_while=_watched(at.only_while, scope), is_velocity=fast, undefined=_undefined(word),
        foot=_foot(law, scope, number),
    )  # fmt: skip


def _foot(law: Law, scope: DerivationScope, number: int) -> tuple[Node, ...]:
    """The place of what touches, by the switch of the contact; none where a body tells it."""
    if law.foot is None:
        return ()
    switch = scope.tape.input("switch", number)
    pairs = zip(*law.foot, strict=True)
    return tuple(switch * scope.real(down) + (1.0 - switch) * scope.real(up) for down, up in pairs)


def _undefined(word: Constraint) -> str:
    """What it means where its gap is no number."""
    return str(getattr(getattr(word, "measure", word), "undefined", ""))


def _guard(scope: DerivationScope, event: Event) -> Guard:
    """A user's event; its measure may depend on velocities."""
    assert event.guard is not None
    value = gap_of(event.guard, scope)
    return Guard(event.name, scope.real(value), scope.change(value), event.direction, event.terminal, event.reset)


def _never(scope: DerivationScope, guard: Guard, written: Collection[str]) -> list[str]:
    """What is wrong with an event whose measure nothing changes."""
    inputs = [node.data for node in live([guard.value]) if node.op == "input"]
    if any(kind != "p" or scope.parameters.found[k].name in written for kind, k in inputs):
        return []
    return [
        f"the guard of Event '{guard.name}' never changes, so the event cannot happen; let it depend on a "
        "coordinate, a rate, a force, the time 't', or a parameter that a controller writes"
    ]


def _rubbing_contact(
    found: Laws,
    scope: DerivationScope,
    dynamics: Generalized,
    name: str,
    number: int,
    normal: int,
    rubbing: Rubbing,
    captured: dict[int, Node],
) -> Drags:
    """(part, velocity, force) of the smooth friction of contact `number`, whose normal row is `normal`.

    Velocities are those of the slips at the place of now. A slip that no motion changes has no friction. The forces
    follow the multiplier of the normal row, which is zero while the contact is open.
    """
    here = {scope.tape.input("anchor", k): value for k, value in captured.items()}
    parts, speeds = [], []
    for row in rubbing.slips:
        view = scope.tape.lift(row.value)
        rate = view if row.level == "velocity" else scope.rates([view])[0]
        speed = substitute([rate], here)[0]
        if not speed.is_constant:
            parts.append(row.part)
            speeds.append(speed)
    forces = [scope.tape.lift(force) for force in rubbing.forces(-scope.tape.input("lam", normal), speeds)]
    if not parts:
        return ()
    found.drags += [(number, speed, force) for speed, force in zip(speeds, forces, strict=True)]
    work = Work([], [], speeds, [-force for force in forces])
    generalized = dynamics.generalized(work)
    real, sizes = scope.views.real(speeds), scope.views.real(forces)
    moving = list(zip(real, sizes, strict=True))
    _add_effect(found, drag_effect(f"{name} friction", -1, moving, generalized, scope))
    return tuple((part, speed, force) for part, (speed, force) in zip(parts, moving, strict=True))


def _add_effect(found: Laws, effect: Effect) -> None:
    """One effect of all friction of a contact, that which sticks included."""
    places = [place for place, other in enumerate(found.effects) if other.name == effect.name]
    if not places:
        found.effects.append(effect)
        return
    first, second = found.effects[places[0]], effect

    def generalized() -> list[Node]:
        return [a + b for a, b in zip(first.generalized(), second.generalized(), strict=True)]

    power = None if first.power is None or second.power is None else first.power + second.power
    found.effects[places[0]] = replace(first, power=power, generalized=generalized)
