"""The energy ledger: where the energy of a mechanism goes during a run.

``ΔE = Δ(T + V) = Σ_effects ∫ P dt + Σ_rows ∫ λ h_t dt − Σ_impacts ½ Σ −Λ (γ⁻ + γ⁺) + … + numerical``

A surface that moves with time does work through its contact: λ h_t of a closed one, −p ∂g/∂t of a penalty (whose own
part is p ġ, that of the motion against the surface), and Λ h_t in an impact, apart from what the impact loses.

Every physical part is integrated on its own, with an error of order 8 (`mbd.results.quadrature`; long steps of
schemes of high order from states within them, `mbd.results.within`), and an impact takes what its impulses say;
`numerical` is what is left: the integrator's own gain or loss, which falls with dt at the scheme's order. Projections
onto rows and what non-smooth steps lift out of surfaces stand there too.
"""

from collections import defaultdict
from collections.abc import Container, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.equal import HALF_PRECISION_RTOL, ROUND_OFF_RTOL, SMALL_SUM_RTOL
from mbd.equations.equations import Equations
from mbd.results.columns import ModelColumns
from mbd.results.ledger import SPENT, Ledger, Part
from mbd.results.powers import Lost, Power, moving_share, powers
from mbd.results.quadrature import cumulative
from mbd.results.record import EventRecord, Rows
from mbd.results.within import readable, within
from mbd.tape.node import Node


def ledger(columns: ModelColumns) -> Ledger:
    """The energy ledger of a run.

    Parameters
    ----------
    columns : the run's states with the model's equations
    """
    return doubted_ledger(columns)[0]


@np.errstate(all="ignore")
def doubted_ledger(columns: ModelColumns, lending: Container[str] = ()) -> tuple[Ledger, Matrix]:
    """The ledger, and how far the sum of its works may be off at every row (2, R) [J]: of those that give, and of all.

    Those that only give back what they took, by the names in `lending`, count among all.

    The doubt is Σ |work − trapezoid| over all intervals and works: generous where the rows resolve the powers, and as
    large as the works where they do not, as with rows many steps apart.
    """
    equations, record = columns.equations, columns.record
    with equations.tape.lock:
        found, share = powers(equations), moving_share(equations)
    holders = [(effect, effect.potential) for effect in equations.effects if effect.potential is not None]
    kinetic, potential, moving, *energies = columns.evaluate(
        [equations.kinetic, equations.potential, share, *(energy for _, energy in holders)],
        columns.rows,
    )
    pairs = zip(holders, energies, strict=True)
    stored = tuple(
        Part(effect.name, effect.column if effect.power is None else "potential", energy)
        for (effect, _), energy in pairs
    )
    least = ROUND_OFF_RTOL * float(np.max(np.abs(kinetic) + np.abs(potential), initial=0.0))
    named, moved, doubt = _works(columns, found, moving, least, lending)
    driven = any(power.kind == "constraint" for power in found)
    unnamed = [*moved, *_jumps(columns, kinetic + potential, driven)]
    kept = [part for part in unnamed if np.max(np.abs(part.energy), initial=0.0) > least]
    marks = tuple((event.time, event.name) for event in record.events if event.kind != "opened")
    stride = record.settings.get("store", 1)
    return Ledger(record.time, kinetic, potential, (*named, *kept), stride, stored, marks), doubt


def kinds_of_work(equations: Equations) -> frozenset[str]:
    """The kinds of everything that may change T + V while the mechanism moves smoothly: 'joint loss', 'force', …

    Empty where nothing does; what belongs to moving coordinates is reported as far as it depends on time explicitly.
    """
    with equations.tape.lock:
        return frozenset(power.kind for power in powers(equations))


def _works(
    columns: ModelColumns, found: list[Power], moving: Vector, least: float, lending: Container[str]
) -> tuple[list[Part], list[Part], Matrix]:  # fmt: skip
    """The integrals of powers: those of elements, and that of coordinates that move with time, with its 2T − v·∂T/∂v.

    The third is their doubt, see `doubted_ledger`.

    Powers are asked a little inside of the smooth stretch on either side of a switch, where signals may jump.
    """
    record, after = columns.record, _after_switch(columns)
    values = columns.evaluate([power.value for power in found], _inside(columns, 0.0))
    asked_rates = [power.rate for power in found if power.rate is not None]
    rates = iter(columns.evaluate(asked_rates, _inside(columns, HALF_PRECISION_RTOL)))
    named, moved = [], [Part("moving coordinates", "constraint", np.cumsum(np.where(after, 0.0, _steps(moving))))]
    doubt = np.zeros((2, len(record.time)))
    asked = [
        (power.value, value, None if power.rate is None else next(rates))
        for power, value in zip(found, values, strict=True)
    ]
    works = _refined(columns, asked, least)
    for power, value, work in zip(found, values, works, strict=True):
        trapezoid = _trapezoid(record.time, value)
        unsure = np.abs(np.diff(work) - trapezoid)
        if power.lost is not None:
            work = _of_stop(columns, power.lost, value, work, unsure, least)
        elif power.kind in SPENT:
            work = never_giving(work, value, trapezoid)
        if power.name == "moving coordinates":
            moved = [Part(power.name, power.kind, moved[0].energy + work)]
        else:
            part = Part(power.name, power.kind, work)
            is_own_law = power.kind == "penalty" and power.lost is None and not _shares_its_energy(power, found)
            named.append(_withheld_if_unsure(part, float(np.sum(unsure)), least) if is_own_law else part)
        gives = power.name not in lending and np.max(value, initial=0.0) > 0.0
        doubt[0 if gives else 1 :, 1:] += unsure
    return named, moved, np.cumsum(doubt, axis=1)


def _inside(columns: ModelColumns, share: float) -> Rows:
    """The rows, those at the ends of smooth stretches moved into these by a share of the interval there.

    As contacts close and open their gap is zero up to a round-off, whose sign must not say whether a force grows.
    """
    rows, length = columns.rows, np.diff(columns.record.time)
    ends = np.diff(columns.record.time, prepend=-np.inf, append=np.inf) <= 0.0
    ends[[0, -1]] = True
    forward = np.where(ends[:-1], np.append(length, 0.0), 0.0)
    backward = np.where(ends[1:], np.insert(length, 0, 0.0), 0.0)
    move = share * (forward - backward)
    time = rows.time + move
    before = ends[1:] & (backward > 0.0)
    time[before] = np.minimum(time, np.nextafter(rows.time, -np.inf))[before]
    way = move[:, None]
    return replace(rows, time=time, q=rows.q + way * columns.q_rate, v=rows.v + way * rows.a, z=rows.z + way * rows.s)


def _shares_its_energy(power: Power, found: list[Power]) -> bool:
    """Whether a penalty contact acts along other directions too: 'leg' may give what 'leg thrust' takes."""
    others = [other.name for other in found if other.kind == "penalty" and other.name != power.name]
    return any(name.startswith(f"{power.name} ") or power.name.startswith(f"{name} ") for name in others)


def _trapezoid(time: Vector, power: Vector) -> Vector:
    """h/2 (P₀ + P₁) of each interval (R − 1,) [J]."""
    return np.asarray(np.diff(time) * (power[:-1] + power[1:]) / 2.0)


def never_giving(work: Vector, power: Vector, trapezoid: Vector) -> Vector:
    """A work whose power is nowhere positive, with the trapezoid where a polynomial through it overshoots."""
    if np.max(power, initial=0.0) > ROUND_OFF_RTOL * np.max(np.abs(power), initial=0.0):
        return work
    steps = np.diff(work)
    return np.concatenate([[0.0], np.cumsum(np.where(steps > 0.0, np.minimum(trapezoid, 0.0), steps))])


def _withheld_if_unsure(part: Part, doubt: float, least: float) -> Part:
    """A penalty contact of a law of the user's, withheld where it seems to give energy that may be an error."""
    gain = float(np.max(part.energy - part.energy[:1], initial=0.0))
    if not least < gain <= 10.0 * doubt:  # up to ten times its error a gain is not told
        return part
    reason = (
        f"its power, added up over the rows, gives {gain:.3g} J, with an error of up to {doubt:.3g} J; impacts of so "
        "few steps do not tell its work: use a smaller dt, or define elastic_energy of its law"
    )
    return replace(part, energy=np.full(len(part.energy), np.nan), withheld=reason)


def _of_stop(
    columns: ModelColumns, lost: Lost, given: Vector, direct: Vector, unsure: Vector, least: float
) -> Vector:  # fmt: skip
    """Work of a penalty contact: ∫ p ġ dt of the impacts whose rows tell it, else −U(g) and what was lost.

    ∫ p ġ dt is the more accurate where rows resolve an impact, as they balance forces; of a few rows it may be
    anything. What a contact still holds as it opens, and what it holds as it closes, as rubber that was struck before,
    is its own: neither is given to the mechanism at that instant. Where what pushes is met between two rows, as the
    surface of rubber that comes back, the power p ġ `given` has a kink there, and −U(g) tells the work.
    """
    time, closed = columns.record.time, columns.record.closed[:, lost.contact].astype(bool)
    elastic, power = columns.evaluate([lost.elastic, lost.value], columns.rows)
    rate = None if lost.rate is None else columns.evaluate([lost.rate], _inside(columns, HALF_PRECISION_RTOL))[0]
    (work,) = _refined(columns, [(lost.value, power, rate)], least)
    work = never_giving(work, power, _trapezoid(time, power))
    held = np.where(closed, elastic, 0.0)
    steps = -np.diff(held)
    steps[closed[:-1] != closed[1:]] = 0.0
    # what a mode or an event puts into it at an instant, as it moves the rest of a leg, comes from outside
    put_in = np.where((np.diff(time) <= 0.0) & closed[:-1] & closed[1:], np.diff(held), 0.0)
    steps += put_in + np.diff(work)
    begins = closed & ~np.concatenate([[False], closed[:-1]])
    if not begins.any():
        return direct
    episode = np.maximum(np.cumsum(begins) - 1, 0)  # that of each row, or the last before it
    since = np.where(closed, direct - direct[np.flatnonzero(begins)][episode], 0.0)
    size, doubt, gain = (np.zeros(episode[-1] + 1) for _ in range(3))
    np.maximum.at(size, episode, np.abs(since))
    np.maximum.at(gain, episode, since)
    np.add.at(doubt, episode[1:], unsure)
    allowed = ROUND_OFF_RTOL * size
    allowed += held[begins]
    np.add.at(allowed, episode[1:], np.maximum(put_in, 0.0))
    is_known = (doubt <= 0.05 * size) & (gain <= allowed)  # up to a twentieth rows tell the work of an impact
    is_met = (given[:-1] == 0.0) & (given[1:] != 0.0) & (held[:-1] > 0.0)
    return np.concatenate([[0.0], np.cumsum(np.where(is_known[episode[1:]] & ~is_met, np.diff(direct), steps))])


def _refined(
    columns: ModelColumns, asked: Sequence[tuple[Node, Vector, Vector | None]], least: float
) -> list[Vector]:  # fmt: skip
    """Works of powers, of which values and rates at the rows are given: ∫ P dt from the first row to each one.

    Long intervals are integrated again from states within them, in runs of high order: those in which a work differs
    by more than `least` [J] from ``h/2 (P₀ + P₁) + h²/12 (Ṗ₀ − Ṗ₁)``.
    """
    time = columns.record.time
    works = cumulative(time, [(value, rate) for _, value, rate in asked])
    known = readable(columns)
    if not known.any():
        return works
    long = [_long(time, value, rate, work, known, least) for (_, value, rate), work in zip(asked, works, strict=True)]
    again = within(columns, [(power, lower) for (power, *_), lower in zip(asked, long, strict=True)])
    for k, (lower, better) in enumerate(zip(long, again, strict=True)):
        if len(lower):
            steps = np.diff(works[k])
            steps[lower] = better
            works[k] = np.concatenate([[0.0], np.cumsum(steps)])
    return works


def _long(
    time: Vector, value: Vector, rate: Vector | None, work: Vector, known: NDArray[np.bool_], least: float
) -> NDArray[np.intp]:  # fmt: skip
    """The rows that begin intervals whose work is integrated again, among those that are `known`."""
    step, steps = np.diff(time), np.diff(work)
    plain = step * (value[:-1] + value[1:]) / 2.0
    if rate is not None:
        plain += step**2 * (rate[:-1] - rate[1:]) / 12.0
    differ = np.where(known, np.abs(steps - plain), 0.0)
    # few rows make both the same: the trapezoid, or where rates are known a step between two switches
    few = known if rate is None else known & (np.append(0.0, step)[:-1] <= 0.0) & (np.append(step, 0.0)[1:] <= 0.0)
    differ[few & (differ <= SMALL_SUM_RTOL * np.max(np.abs(work)))] = np.inf
    long = np.sort(np.argsort(-differ, kind="stable")[:20000])
    return np.asarray(long[differ[long] > least])


def _steps(column: Vector) -> Vector:
    """Change to each row from the one before."""
    return np.diff(column, prepend=column[:1])


def _after_switch(columns: ModelColumns) -> Any:
    """Whether each row is the right side of a switch, (R,) booleans."""
    return np.diff(columns.record.time, prepend=-np.inf) <= 0.0


def _jumps(columns: ModelColumns, total: Vector, driven: bool) -> list[Part]:
    """Changes of energy at an instant: by contacts that strike, and where a user's event or a controller sets values.

    A contact takes ``−½ Σ Λ (γ⁻ + γ⁺)`` over its rows, and its share of what joints and contacts that were closed take.
    What an impact changes beyond that is the work of drives and surfaces where something is `driven`, else numerical.
    """
    record, after = columns.record, _after_switch(columns)
    left = np.where(after, _steps(total), 0.0)
    hits = [
        event
        for event in record.events
        if event.kind in ("closed", "stuck") and event.impulse.any() and after[event.row]
    ]
    together: dict[int, list[EventRecord]] = {}
    for event in hits:
        together.setdefault(event.row, []).append(event)
    impacts: dict[str, Vector] = defaultdict(lambda: np.zeros(len(left)))
    kicks: dict[str, Vector] = defaultdict(lambda: np.zeros(len(left)))
    for event in record.events:
        if event.kind == "pushed" and after[event.row]:
            kicks[event.name][event.row] -= event.energy_loss
            left[event.row] += event.energy_loss
    for row, struck in sorted(together.items()):
        for name, loss in _losses(struck).items():
            impacts[name][row] -= loss
            left[row] += loss
    reset = _resets(columns.equations, record, len(left))
    at_impacts = [*together, *(row for given in kicks.values() for row in np.flatnonzero(given).tolist())]
    beyond = np.zeros(len(left))
    beyond[at_impacts] = left[at_impacts]
    beyond[reset] = 0.0
    parts = [Part(name, "force", np.cumsum(given)) for name, given in kicks.items()]
    parts += [Part(f"{name} impact", "impact", np.cumsum(taken)) for name, taken in impacts.items()]
    parts.append(Part("resets", "reset", np.cumsum(np.where(reset, left, 0.0))))
    return [*parts, Part("drives at impacts", "constraint", np.cumsum(beyond))] if driven else parts


def _losses(struck: list[EventRecord]) -> dict[str, float]:
    """What the contacts of one impact took, by name; together where one of them would seem to give.

    ``−½ Σ Λ (γ⁻ + γ⁺)`` is right in all, and for a contact as far as its speed changes in proportion to its impulse:
    where impacts follow each other, as through a row of balls, that of the second has none before.
    """
    total = sum(event.energy_loss for event in struck)
    least = ROUND_OFF_RTOL * sum(abs(event.energy_loss) for event in struck)
    if len(struck) < 2 or min(event.energy_loss for event in struck) >= -least:
        return {event.name: event.energy_loss for event in struck}
    return {" and ".join(event.name for event in struck): total}


def _resets(equations: Equations, record: Any, rows: int) -> Any:
    """Where a user's event set values or a controller changed parameters, (R,) booleans."""
    found = np.zeros(rows, dtype=bool)
    setting = {guard.name for guard in equations.guards if guard.reset is not None}
    if equations.machines:  # which may move what springs store their energy by
        from mbd.tape.derivatives import live

        with equations.tape.lock:
            inputs = [node.data for node in live([equations.potential]) if node.op == "input"]
        held = {number for kind, number in inputs if kind == "anchor"}
        moved = {m for m, machine in enumerate(equations.machines) if held & set(machine.anchors)}
        taken = ((guard.name, guard.transition) for guard in equations.guards)
        setting |= {name for name, each in taken if each is not None and each.machine in moved}
    late = {guard.name for guard in equations.guards if guard.reset is not None and guard.transition is not None}
    places = [
        event.row + (event.name in late) for event in record.events if event.kind == "event" and event.name in setting
    ]
    places = [row for row in places if row < rows]  # a run may end with the event
    places += [row for row, _ in record.parameter_changes if row < rows]
    found[places] = True
    return found
