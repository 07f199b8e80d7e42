"""The energy ledger: where the energy of a mechanism goes during a run.

``ΔE = Δ(T + V) = Σ_effects ∫ P dt + Σ_rows ∫ λ h_t dt + Σ_impacts (T⁺ − T⁻) + … + numerical``

A surface that moves with time does work through its contact: λ h_t of a closed one, −p ∂g/∂t of a penalty (whose own
part is p ġ, that of the motion against the surface), and Λ h_t in an impact, apart from what the impact loses.

Every physical part is integrated on its own, by Simpson's rule with the run's own cubic interpolation between the
rows, which is more accurate than a second-order scheme; `numerical` is what is left: the integrator's own gain or loss,
which falls with dt at the scheme's order.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.results.columns import ModelColumns
from mbd.results.ledger import Ledger, Part

if TYPE_CHECKING:
    from mbd.equations.equations import Equations
    from mbd.tape.node import Node, Scalar

__all__ = ["doubted_ledger", "kinds_of_work", "ledger"]

ROUND_OFF = 1e-12
"""A part without a name of its own that stays below this share of the largest energy is not listed [-]."""


def ledger(columns: ModelColumns) -> Ledger:
    """The energy ledger of a run.

    Parameters
    ----------
    columns : the run's states with the model's equations
    """
    return doubted_ledger(columns)[0]


def doubted_ledger(columns: ModelColumns) -> tuple[Ledger, Matrix]:
    """The ledger, and how far the sum of its works may be off at every row (2, R) [J]: of those that give, and of all.

    The doubt is Σ |Simpson − trapezoid| over all intervals and works: generous where the rows resolve the powers, and
    as large as the works where they do not, as with rows many steps apart.
    """
    equations = columns.equations
    with equations.tape.lock:
        shares = 2.0 * equations.kinetic - _momentum_power(equations)
        powers = _powers(equations)
    kinetic, potential, moving = columns.evaluate([equations.kinetic, equations.potential, shares], columns.rows)
    total = kinetic + potential
    works, doubt = _integrals(columns, [power for _, _, power in powers])
    named = [Part(name, kind, work) for (name, kind, _), work in zip(powers, works, strict=True)]
    moved = np.cumsum(np.where(_after_switch(columns), 0.0, np.diff(moving, prepend=moving[:1])))
    driven = any(kind == "drive" for _, kind, _ in powers)
    unnamed = [Part("moving coordinates", "drive", moved), *_jumps(columns, total, driven)]
    least = ROUND_OFF * float(np.max(np.abs(kinetic) + np.abs(potential), initial=0.0))
    kept = [part for part in unnamed if np.max(np.abs(part.energy), initial=0.0) > least]
    stride = columns.record.settings.get("store", 1)
    return Ledger(columns.record.time, kinetic, potential, (*named, *kept), stride), doubt


def kinds_of_work(equations: Equations) -> frozenset[str]:
    """The kinds of everything that may change T + V while the mechanism moves smoothly: 'loss', 'applied', 'drive', …

    Empty where nothing does; what belongs to moving coordinates is told as far as it depends on time explicitly.
    """
    with equations.tape.lock:
        return frozenset(kind for _, kind, _ in _powers(equations))


def _momentum_power(equations: Equations) -> Node:
    """v·∂T/∂v, which is 2T unless coordinates move with time."""
    from mbd.tape.derivatives import gradient

    tape = equations.tape
    v = [tape.input("v", k) for k in range(equations.n_v)]
    total = tape.zero
    for rate, momentum in zip(v, gradient(equations.kinetic, v), strict=True):
        total = total + rate * momentum
    return total


def _powers(equations: Equations) -> list[tuple[str, str, Node]]:
    """(name, kind, power on the tape) of everything that changes T + V while the mechanism moves smoothly.

    Effects give their own power; a row with h_t ≠ 0 does the work ``λ h_t``; with
    ``dT/dt = Q·v − ∂T/∂t + d/dt(2T − v·∂T/∂v)`` and ``dV/dt = v·∂V/∂q + ∂V/∂t + ∂V/∂z·ż`` a kinetic energy or a
    potential that depends on time or on first-order states adds the rest.
    """
    from mbd.tape.derivatives import jvp, substitute

    tape = equations.tape
    found: dict[tuple[str, str], Node] = {}

    def add(name: str, kind: str, power: Node) -> None:
        found[name, kind] = found.get((name, kind), tape.zero) + power

    for effect in equations.effects:
        if effect.power is not None:
            switch = tape.one if effect.contact < 0 else tape.input("switch", effect.contact)
            add(effect.name, effect.kind, switch * effect.power)
    still = {tape.input("v", k): 0.0 for k in range(equations.n_v)}
    for number, row in enumerate(equations.rows):
        speed = substitute([row.rate], still)[0]
        if not speed.is_zero:
            add(row.owner, "drive", tape.input("lam", number) * speed)
    clock: dict[Node, Scalar] = {tape.input("t"): 1.0}
    for number, contact in enumerate(equations.contacts):
        speed = jvp([contact.gap], clock)[0]
        if contact.force is not None and not speed.is_zero:
            work = tape.input("switch", number) * contact.force * speed
            add(contact.name, "penalty", work)
            add(f"surface of {contact.name}", "drive", -work)
    states: dict[Node, Scalar] = {tape.input("z", k): tape.input("s", k) for k in range(equations.n_z)}
    for name, power in (
        ("moving coordinates, explicit", -jvp([equations.kinetic], clock)[0]),
        ("changing potential", jvp([equations.potential], clock | states)[0]),
    ):
        if not power.is_zero:
            add(name, "drive", power)
    return [(name, kind, power) for (name, kind), power in found.items()]


def _integrals(columns: ModelColumns, powers: Sequence[Node]) -> tuple[list[Vector], Matrix]:
    """∫ P dt from the first row to each, by Simpson's rule, and their doubts; nothing is added across a switch."""
    begin, places = columns.grid.middles()
    ends, middles = columns.evaluate(powers, columns.rows), columns.evaluate(powers, columns.between(places))
    found, doubt = [], np.zeros((2, len(columns.record.time)))
    for end, middle in zip(ends, middles, strict=True):
        steps = np.zeros(len(columns.record.time))
        steps[begin + 1] = places.step / 6.0 * (end[begin] + 4.0 * middle + end[begin + 1])
        off = np.abs(steps[begin + 1] - places.step / 2.0 * (end[begin] + end[begin + 1]))
        gives = max(np.max(end, initial=0.0), np.max(middle, initial=0.0)) > 0.0
        doubt[0 if gives else 1 :, begin + 1] += off
        found.append(np.cumsum(steps))
    return found, np.cumsum(doubt, axis=1)


def _after_switch(columns: ModelColumns) -> Any:
    """Whether each row is the right side of a switch, (R,) booleans."""
    time = columns.record.time
    return np.diff(time, prepend=-np.inf) <= 0.0


def _jumps(columns: ModelColumns, total: Vector, driven: bool) -> list[Part]:
    """Changes of energy at an instant: impacts where a contact closed, resets elsewhere.

    Where something is `driven` an impact gives what its events do not lose: the work of the drives and surfaces.
    """
    record = columns.record
    jumps = np.where(_after_switch(columns), np.diff(total, prepend=total[:1]), 0.0)
    closings = [event for event in record.events if event.kind == "closed"]
    struck = np.isin(record.time, [record.time[event.row] for event in closings])
    given = np.where(struck, jumps, 0.0)
    resets = Part("resets", "reset", np.cumsum(np.where(struck, 0.0, jumps)))
    if not driven:
        return [Part("impacts", "impact", np.cumsum(given)), resets]
    lost = np.zeros(len(given))
    np.add.at(lost, [event.row for event in closings], [-event.energy_loss for event in closings])
    return [
        Part("impacts", "impact", np.cumsum(lost)),
        Part("drives at impacts", "drive", np.cumsum(given - lost)),
        resets,
    ]
