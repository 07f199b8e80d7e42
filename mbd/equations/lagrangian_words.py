"""The constraints, events and forces that were added to a mechanism given by its energies: their faults, and a page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from mbd.constraints.expressions import quantities_in
from mbd.equations.coordinate_scope import CoordinateScope
from mbd.errors import nearest
from mbd.topology.check import rule_faults
from mbd.topology.describe import described_constraint, listed

if TYPE_CHECKING:
    from mbd.constraints.base import Constraint
    from mbd.equations.energy_description import EnergyDescription
    from mbd.forces.base import Force

__all__ = ["described", "parts", "word_faults"]


def word_faults(system: EnergyDescription, scope: CoordinateScope) -> list[str]:
    """What is wrong with its words, one sentence each."""
    words: list[Force | Constraint] = [*system.applied, *system.words]
    found = [fault for word in words for fault in (*word.faults(), *word.value_faults(word.parameters()))]
    names = [word.name for word in (*words, *system.controllers, *system.observations)]
    names += [*system.rows, *system.nonholonomic, *(coordinate.name for coordinate in system.coordinates)]
    for name in dict.fromkeys(name for name in names if names.count(name) > 1):
        found.append(f"the name {name!r} is used {names.count(name)} times; give each its own name")
    owners = {force.name for force in system.applied}
    for word in words:
        for mention in word.mentions():
            if not isinstance(mention, str):
                found.append(
                    f"{word.name!r} refers to {mention.name!r} of a body or joint, which a Lagrangian has not; give an "
                    "expression of its coordinates"
                )
            elif not scope.knows(mention) and mention.rpartition(".")[0] not in owners:
                found.append(f"{word.name!r}: " + nearest(mention, scope.known, "quantity", "Known are"))
    for event in system.events:
        values = event.reset.values() if isinstance(event.reset, dict) else ()
        unknown = [
            name for name in quantities_in([v for v in values if hasattr(v, "free_symbols")]) if not scope.knows(name)
        ]
        found += [
            f"the reset of {event.name!r}: " + nearest(name, scope.known, "quantity", "Known are") for name in unknown
        ]
    return list(dict.fromkeys(found + rule_faults(system)))


def described(system: EnergyDescription, faults: Sequence[str]) -> str:
    """Coordinates, energies, parameters, forces, constraints and faults."""
    return listed(f"{system.name}: given by its energies", parts(system, faults))


def parts(system: EnergyDescription, faults: Sequence[str]) -> dict[str, list[str]]:
    """The same by title, an entry a line."""
    energies = {"T": system.kinetic, "V": system.potential, "D": system.dissipation}
    forces = [f"{name} force: {_said(force)}" for name, force in system.generalized.items()]
    forces += [f"{force.name}: {type(force).__name__}, {force.kind}" for force in system.applied]
    rows = [f"{name}: {_said(h)} = 0" for name, h in (*system.rows.items(), *system.nonholonomic.items())]
    return {
        "coordinates": [f"{c.name} [{c.unit}]" for c in system.coordinates],
        "energies": [f"{letter} = {_said(value)}" for letter, value in energies.items()],
        "parameters": [f"{name} = {value:.6g}" for name, value in system.own_parameters.items()],
        "forces": forces,
        "constraints": [*rows, *(described_constraint(word) for word in system.words)],
        "controllers": [controller.name for controller in system.controllers],
        "observations": [f"{each.name} [{each.unit or '-'}]" for each in system.observations],
        "faults": list(faults),
    }


def _said(expression: object) -> str:
    """An expression, or the name of a function."""
    return str(getattr(expression, "__name__", expression)) if callable(expression) else str(expression)
