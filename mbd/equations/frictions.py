"""Dry friction that truly sticks: along the tangent of a contact, and in joints."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from mbd.constraints.law import Equation
from mbd.equal import MIN_SQUARED_SPEED
from mbd.equations.derivation_scope import DerivationScope, Generalized
from mbd.equations.dynamics import Work
from mbd.equations.equations import Effect, Friction, Row
from mbd.equations.laws import Laws
from mbd.equations.states import with_states
from mbd.errors import CapabilityError
from mbd.joints.base import Joint
from mbd.tape.derivatives import substitute
from mbd.tape.functions import sqrt
from mbd.tape.node import Node, Scalar

SPIN = ("spin", "rad")
"""Part and unit of the row that holds the spin of a contact about its normal."""


def sliding_contact(
    found: Laws,
    scope: DerivationScope,
    dynamics: Generalized,
    name: str,
    numbers: Sequence[int],
    limited: Sequence[tuple[int, Equation]],
    captured: dict[int, Node],
) -> None:
    """Friction of a contact: along its tangents, ``‖λ_T‖ ≤ limit(p)``, and of its spin, ``|λ_ω| ≤ limit(p)``.

    Directions are those at the point of now. Spin is friction along one direction, with a switch of its own.
    """
    spinning = [(row, word.limit or 0.0) for row, word in limited if row >= 0 and (word.part, word.unit) == SPIN]
    along = [(row, word) for row, word in limited if (word.part, word.unit) != SPIN]
    if along:
        acting = [(row, word) for row, word in along if row >= 0]
        _slide(found, scope, dynamics, name, len(numbers) - 1 - len(spinning), numbers[0], acting, captured)
    for row, law in spinning:
        limit = scope.tape.lift(law(-scope.tape.input("lam", numbers[0])) if callable(law) else law)
        dry_friction(found, scope, dynamics, f"{name} spin", row, found.rows[row].contact, limit)


def _slide(
    found: Laws,
    scope: DerivationScope,
    dynamics: Generalized,
    name: str,
    ways: int,
    normal: int,
    tangents: Sequence[tuple[int, Equation]],
    captured: dict[int, Node],
) -> None:
    """Friction along one tangent, or along two that slide together, of all the `ways` in which the point can slide."""
    if len(tangents) not in (1, 2) or ways != len(tangents):
        raise CapabilityError(
            f"'{name}': friction needs a direction of sliding, or two, but its point can slide in {ways}; "
            "use friction=None (it sticks) or 0"
        )
    here = {scope.tape.input("anchor", k): value for k, value in captured.items()}
    first = len(found.frictions)
    push, views = -scope.tape.input("lam", normal), []
    for row, _ in tangents:
        anchored = [found.viewed[row]] if found.rows[row].is_velocity else scope.rates([found.viewed[row]])
        views.append(substitute(anchored, here)[0])
    speed = _speed(scope, views, first)
    for place, (row, word) in enumerate(tangents):
        limit = scope.tape.lift(word.limit(push) if callable(word.limit) else word.limit or 0.0)
        sliding = struck = limit
        if word.sliding is not None:
            sliding = scope.tape.lift(word.sliding(push, speed))
            struck = scope.tape.lift(word.sliding(push, _size(scope, views)))
        group = () if len(tangents) == 1 else (first, first + 1)
        _add(found, scope, name, row, found.rows[row].contact, views[place], limit, sliding, struck, group)
    _add_loss(found, scope, dynamics, name, range(first, len(found.frictions)))


def dry_friction(
    found: Laws,
    scope: DerivationScope,
    dynamics: Generalized,
    name: str,
    row: int,
    contact: int,
    limit: Node,
    sliding: Callable[[Scalar], Scalar] | None = None,
) -> None:
    """Dry friction along a row on velocities, ``|λ| ≤ limit``; `sliding` is the limit at a speed."""
    view = found.viewed[row]
    moving = limit if sliding is None else scope.tape.lift(sliding(_speed(scope, [view], len(found.frictions))))
    _add(found, scope, name, row, contact, view, limit, moving, moving)
    _add_loss(found, scope, dynamics, name, [len(found.frictions) - 1])


def dry_joint(found: Laws, scope: DerivationScope, dynamics: Generalized, joint: Joint) -> None:
    """Set-valued losses of a joint: a row on each rate, held while ``|λ| ≤ limit``; those of a ball joint together."""
    if joint.is_isotropic:
        _dry_ball(found, scope, dynamics, joint)
        return
    rates: Sequence[Scalar] | None = None
    for place, owner, loss in joint.losses():
        load = _pin_load(found, scope, joint) if loss.needs_reaction else 0.0
        limit = loss.dry(load, scope, owner)
        if (isinstance(limit, float) and limit == 0.0) or (isinstance(limit, Node) and limit.is_zero):
            continue
        rates = scope.joint(joint.name).rates if rates is None else rates
        view = scope.tape.lift(rates[place])
        name = joint.name if len(joint.freedoms) == 1 else f"{joint.name}.{joint.freedoms[place].name}"
        _add_row(found, scope, name, view, joint.freedoms[place].unit)
        sliding = partial(loss.sliding, load, scope=scope, owner=owner)
        dry_friction(found, scope, dynamics, name, len(found.rows) - 1, -1, scope.tape.lift(limit), sliding)


def _dry_ball(found: Laws, scope: DerivationScope, dynamics: Generalized, joint: Joint) -> None:
    """The set-valued part of the one loss of a joint against its ω, ``‖λ‖ ≤ limit``, sliding ``λ = limit ω/‖ω‖``."""
    _, owner, loss = joint.losses()[0]
    load = _pin_load(found, scope, joint) if loss.needs_reaction else 0.0
    limit = scope.tape.lift(loss.dry(load, scope, owner))
    if limit.is_zero:
        return
    views = [scope.tape.lift(rate) for rate in scope.joint(joint.name).rates]
    first = len(found.frictions)
    moving = scope.tape.lift(loss.sliding(load, _size(scope, views), scope, owner))
    group = tuple(range(first, first + len(views)))
    for view, label in zip(views, joint.freedoms, strict=True):
        _add_row(found, scope, f"{joint.name}.{label.name}", view, label.unit)
        _add(found, scope, joint.name, len(found.rows) - 1, -1, view, limit, moving, moving, group)
    _add_loss(found, scope, dynamics, joint.name, group)


def _add_row(found: Laws, scope: DerivationScope, name: str, view: Node, unit: str) -> None:
    """A row that holds a rate of a joint while its friction sticks."""
    found.rows.append(Row(name, "dry", scope.tape.zero, scope.real(view), unit=unit, kind="velocity"))
    found.viewed.append(view)


def _speed(scope: DerivationScope, views: Sequence[Node], first: int) -> Node:
    """‖γ‖ while friction slides along these velocities, the first of which is that of friction `first`.

    Along one direction it is slip · γ, smooth where the end of a step lies beyond rest, and 0 where nothing slides.
    """
    rates = [scope.real(view) for view in views]
    if len(rates) == 1:
        return scope.tape.input("slip", first) * rates[0]
    return _size(scope, views)


def _size(scope: DerivationScope, views: Sequence[Node]) -> Node:
    """‖γ‖ of these velocities."""
    rates = [scope.real(view) for view in views]
    return scope.tape.lift(sqrt(sum((rate * rate for rate in rates), scope.tape.lift(MIN_SQUARED_SPEED))))


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
    name: str,
    row: int,
    contact: int,
    view: Node,
    limit: Node,
    sliding: Node,
    struck: Node,
    group: tuple[int, ...] = (),
) -> None:
    """A direction of dry friction, and its row marked as held by it."""
    rate = scope.real(view)
    found.rows[row] = replace(found.rows[row], friction=len(found.frictions))
    found.frictions.append(Friction(name, row, contact, rate, scope.change(view), limit, sliding, struck, group))
    found.sliding.append(view)


def _add_loss(found: Laws, scope: DerivationScope, dynamics: Generalized, name: str, numbers: Sequence[int]) -> None:
    """The loss in some directions of one dry friction, as one effect."""
    work, power = Work(), scope.tape.zero
    for number in numbers:
        multiplier = scope.tape.input("lam", found.frictions[number].row)
        work.on_velocity(found.sliding[number], multiplier)
        power = power - multiplier * found.frictions[number].rate
    found.effects.append(
        Effect(
            f"{name} friction", "loss",
            lambda: with_states(scope, dynamics.generalized(work)), power, column="friction",
        )
    )  # fmt: skip
