"""Smooth friction of contacts by rows: forces along the tangents that follow the normal force and the slip."""

from __future__ import annotations

from dataclasses import replace

from mbd.constraints.law import Rubbing
from mbd.equations.derivation_scope import DerivationScope, Generalized
from mbd.equations.dynamics import Work
from mbd.equations.effects import drag_effect
from mbd.equations.equations import Effect
from mbd.equations.laws import Laws
from mbd.tape.derivatives import substitute
from mbd.tape.node import Node

__all__ = ["rubbing_contact"]

Drags = tuple[tuple[str, Node, Node], ...]


def rubbing_contact(
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
