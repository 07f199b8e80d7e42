"""Whether the scheme itself has put energy into a mechanism: what no other test of a run tells.

With E = T + V, the first row 0 and row k, what a mechanism has by right is

``S_k = T_0 + max_{j ≤ k} (V_0 − V_j) + G_k``,  ``G_k = Σ_parts max_{j ≤ k} W_part,j``

its energy of motion at the start, the potential that it has given off, and the works of forces, motors, drives, resets
and impacts where they have given any. Where ``E_k − E_0 − G_k > S_k``, the scheme has more than doubled that: an error.
Losses do not enter, so that one that rows integrate roughly cannot pass for a gain; nor does the work of a penalty
contact that was open at the start, which gives back less than it took, but in an impact of few rows adds up to
anything. The doubt about the other works is taken off.

In non-smooth steps impacts hide what their steps gain, ``m g`` times the depth out of which a body is lifted: there a
note tells the largest gain with all losses taken into account, less the doubt about every work.

A glance at E in some of the rows comes first, and at its rise in steps that end with an impact. Only where that looks
strange is the ledger of all rows made.
"""

from collections.abc import Container
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL
from mbd.equations.equations import Contact
from mbd.results.columns import ModelColumns
from mbd.results.ledger import Ledger
from mbd.simulation.run.data import EnergyFindings, RunData
from mbd.simulation.run.stored import inputs_of, record_of, whole_record
from mbd.tape.derivatives import live

SPREAD, EARLY = 30, tuple(2**k for k in range(10))
"""Rows of a look: so many from the last look to now, and the first rows of a run at these numbers."""
REPORTED_SHARE = 0.1
"""Share of the energy that a mechanism has, above which a note tells what the scheme gained or lost [-]."""
REPORTED_NONSMOOTH_GAIN = 0.02
"""The same of a gain in non-smooth steps, whose errors are of the size of dt [-]."""
MAX_GAIN_RATIO = 1e6
"""Gain of energy over all that there was before, above which a single row is a verdict [-]."""
MIN_MOTION = 1e-6
"""Way of the fastest coordinate [m, rad] below which a mechanism is at rest, and its energy round-off."""
UNDRIVEN = frozenset({"joint loss", "damper", "friction", "penalty"})
"""Kinds of works that take energy, or give back what they took."""

KINDS: WeakKeyDictionary[Mechanism, frozenset[str]] = WeakKeyDictionary()
"""What may change the energy of a mechanism, found when it is first looked at."""


@dataclass(frozen=True)
class Judgement:
    """What the ledger says of a scheme.

    row : the first row from which on the energy is the scheme's own, −1 if there is none
    numerical : the most that the scheme has given (positive) or taken at a time [J]
    owned : what the mechanism has by right at that row, or in all [J]
    """

    row: int
    numerical: float
    owned: float

    @property
    def share(self) -> float:
        """numerical / owned [-]; infinite where nothing is owned, 0 where neither is anything."""
        if self.owned > 0.0:
            return self.numerical / self.owned
        return float(np.copysign(np.inf, self.numerical)) if self.numerical != 0.0 else 0.0


def judgement(
    ledger: Ledger, doubt: Matrix, way: Vector, lending: Container[str] = (), hidden: bool = False
) -> Judgement:
    """Judge a scheme by the ledger, its doubts (2, R) [J] and the largest way of a coordinate since the start (R,).

    lending : names of the parts that only give back what they took
    hidden : whether losses may hide a gain, which then counts, too, though not as a verdict

    A row alone, as next to a singular configuration, is no verdict: of those from the first one on, at least two
    and at least half must say the same, unless its gain is `MAX_GAIN_RATIO` times all energy until then.
    """
    givers = [part.energy for part in ledger.parts if part.name not in lending and not part.withheld]
    given = sum((np.maximum.accumulate(np.maximum(energy, 0.0)) for energy in givers), np.zeros(len(way)))
    fallen = np.maximum.accumulate(ledger.potential[0] - ledger.potential)
    owned = ledger.kinetic[0] + fallen + given
    noise = EQUAL_RTOL * np.maximum.accumulate(np.abs(ledger.kinetic) + np.abs(ledger.potential))
    moves = np.maximum.accumulate(way) > MIN_MOTION
    gain = np.where(moves, np.maximum(ledger.total - ledger.total[0] - given - noise - doubt[0], 0.0), 0.0)
    loss = np.where(moves, np.maximum(-ledger.numerical - noise - doubt[1], 0.0), 0.0)
    bad = gain > owned
    rest = np.cumsum(bad[::-1])[::-1]  # bad rows from each on
    size = np.abs(ledger.kinetic) + np.abs(ledger.potential)
    before = np.maximum.accumulate(np.concatenate([[0.0], size[:-1]]))
    known = np.maximum(owned, before)
    absurd = (known > 0.0) & (gain > MAX_GAIN_RATIO * known)
    firm = absurd | (bad & (rest >= 2) & (2 * rest >= np.arange(len(bad), 0, -1)))
    if firm.any():
        row = int(np.argmax(firm))
        return Judgement(row, float(np.max(gain[row:])), float(owned[row]))
    if hidden:
        gain = np.maximum(gain, np.where(moves, ledger.numerical - noise - doubt[1], 0.0))
    most, least = float(np.max(gain)), float(np.max(loss))
    return Judgement(-1, most if most >= least else -least, float(owned[-1]))


class EnergyWatch(EnergyFindings):
    """Looks at the energy of a run now and then.

    Attributes
    ----------
    rows, ledgers : rows in which T + V was evaluated, and ledgers made
    """

    def __init__(self) -> None:
        super().__init__()
        self.rows = self.ledgers = 0
        # a run that goes on is looked at then, and at four times as many
        self._due, self._judgements, self._upto = 20000, 0, 0
        self._seen = np.zeros((0, 3))  # T, V and the way of the fastest coordinate, of the rows looked at so far
        self._cleared = 0.0  # a rise of energy that a ledger has explained

    def is_due(self, run: RunData) -> bool:
        """Whether a run that goes on is to be looked at now."""
        return run.stored >= self._due and self._judgements < 4

    @np.errstate(all="ignore")
    def judge(self, run: RunData) -> str:
        """Look at the run as far as it is stored; a sentence if the energy is the scheme's own, '' otherwise."""
        if self.problem or run.stored < 2 or run.kernel.n_v == 0:
            return self.problem
        self._look(run)
        if not np.isfinite(self._seen).all():
            if np.isinf(self._seen[:, 0]).any():
                self._overflow(run)
                return self.problem
            if np.isnan(self._seen[:, 1]).any():
                self._undefined(run)
                return self.problem
        if not self._is_suspicious(run):
            return ""
        from mbd.results.energy import doubted_ledger  # few runs come here

        columns = ModelColumns(whole_record(run), run.mechanism.equations)
        lending = _lending(run)
        ledger, doubt = doubted_ledger(columns, lending)
        way, hidden = _way(columns.record.q, columns.record.q[0]), run.kernel.strategy == 1
        found = judgement(ledger, doubt, way, lending, hidden)
        self.ledgers += 1
        self._cleared = float(np.nanmax(ledger.total - ledger.total[0]))
        if found.row >= 0:
            self.problem, self.row = _sentence(run, found), found.row
        elif abs(found.share) > REPORTED_SHARE or found.share > _telling_gain(run):
            self.note, self.share = _note(found), found.share
        return self.problem

    def _look(self, run: RunData) -> None:
        """Evaluate T and V at some rows that were not looked at yet."""
        last = run.stored - 1
        first, early = min(self._upto, last), EARLY if self._judgements == 0 else ()
        if last - first < SPREAD:  # all of them
            chosen: slice | NDArray[np.intp] = slice(first, last + 1)
        else:
            spread = {first + k * (last - first) // (SPREAD - 1) for k in range(SPREAD)}
            chosen = np.array(sorted(spread.union(row for row in early if row <= last)), dtype=np.intp)
        kinetic, potential = self._energies(run, chosen)
        places = run.table[chosen, 1 : 1 + run.kernel.n_q]
        seen = np.empty((len(places), 3))
        seen[:, 0], seen[:, 1] = kinetic, potential
        seen[:, 2] = _way(places, run.table[0, 1 : 1 + run.kernel.n_q])
        self._seen = np.concatenate([self._seen, seen]) if len(self._seen) else seen
        self._upto, self._due, self._judgements = run.stored, 4 * max(self._due, run.stored // 4), self._judgements + 1

    def _lifted(self, run: RunData) -> float:
        """What non-smooth steps that end with an impact have gained until it, in all [J]."""
        struck = sorted({event.row for event in run.events if event.kind == "closed" and 2 <= event.row < run.stored})
        if not struck:
            return 0.0
        chosen = np.concatenate([np.array(struck) - 2, np.array(struck) - 1])
        kinetic, potential = self._energies(run, chosen)
        before, until = np.split(kinetic + potential, 2)
        return float(np.sum(np.maximum(until - before, 0.0)))

    def _energies(self, run: RunData, chosen: slice | NDArray[np.intp]) -> tuple[Vector, Vector]:
        """T and V at stored rows [J], a slice or an array of their numbers."""
        table, parameters = run.table[chosen], run.first_parameters
        if run.parameter_changes:
            parameters = record_of(run, table).parameters_at(np.arange(len(run.table))[chosen])
        self.rows += len(table)
        energies = run.mechanism.energies
        kinetic, potential = energies(inputs_of(run, table, energies.kinds), parameters)
        return kinetic, potential

    def _overflow(self, run: RunData) -> None:
        """Energies beyond the largest number: the scheme's own where the run began with less, else not judged."""
        top = float(np.max(np.abs(run.table[run.stored - 1, 1 + run.kernel.n_q :][: run.kernel.n_v])))
        if np.isfinite(self._seen[0, 0]):
            setting = "the tolerance" if run.kernel.adaptive else f"dt = {run.dt:g} s"
            self.problem = (
                f"t = {run.now:.9g} s: the energy has grown beyond the largest number, at speeds of {top:.2g}: "
                f"{setting} does not resolve the motion; use a smaller one, or slower motion"
            )
        else:
            self.note = (
                f"speeds of {top:.2g} at the start make an energy beyond the largest number: energies cannot be "
                "determined, and the run was not judged by them; use larger units"
            )

    def _undefined(self, run: RunData) -> None:
        """A potential that has no value where the motion has got: it has passed a pole, which no motion does."""
        columns = ModelColumns(whole_record(run), run.mechanism.equations)
        effects = run.mechanism.equations.effects
        known = {effect.name: effect.potential for effect in effects if effect.potential is not None}
        energies = zip(known, columns.evaluate(list(known.values()), columns.rows), strict=True)
        bad = {name: int(np.argmax(np.isnan(energy))) for name, energy in energies if np.isnan(energy).any()}
        self.row = min(bad.values())
        names = ", ".join(f"'{name}'" for name, row in bad.items() if row == self.row)
        self.problem = (
            f"t = {run.table[self.row, 0]:.9g} s: from here on the potential of {names} is not a number, though its "
            "force is one: a step has passed a place where it has no value, such as the pole of a logarithm; use a "
            "smaller dt to see what happens there, or a potential that is defined wherever the motion goes"
        )

    def _is_suspicious(self, run: RunData) -> bool:
        """Whether only the ledger can tell that the energies seen are right."""
        kinetic, potential, way = self._seen.T
        if np.maximum.reduce(way) <= MIN_MOTION:
            return False
        total = kinetic + potential
        noise = EQUAL_RTOL * np.maximum.reduce(np.abs(self._seen[:, :2]), axis=None)
        rise = total - total[0]
        if run.kernel.strategy == 0 and np.maximum.reduce(np.abs(rise)) <= noise:
            return False
        fallen = np.maximum.accumulate(potential[0] - potential)
        owned = kinetic[0] + fallen
        risen = ~(rise <= np.maximum(_telling_gain(run) * owned + noise, 2.0 * self._cleared))  # NaN is strange too
        sunk = rise < -REPORTED_SHARE * owned[-1] - noise
        if run.kernel.strategy == 1 and self._lifted(run) > REPORTED_NONSMOOTH_GAIN * float(np.max(owned)) + noise:
            return True
        if not (risen | sunk).any():
            return False
        kinds = kinds_of(run.mechanism)
        if kinds <= UNDRIVEN:
            sudden = bool(run.parameter_changes) or any(event.kind in ("closed", "event") for event in run.events)
            return bool(risen.any()) or not (kinds or sudden)
        swing = kinetic[0] + _swing(kinetic) + _swing(potential)
        large_rise = rise[1:] > 100.0 * swing[:-1]  # strange where something is driven
        return bool(np.any(large_rise[3:] & risen[4:]))


def _telling_gain(run: RunData) -> float:
    """Share of the energy that a mechanism has, above which a note tells what the scheme gained [-]."""
    return REPORTED_NONSMOOTH_GAIN if run.kernel.strategy == 1 else REPORTED_SHARE


def _way(q: Vector, start: Vector) -> Vector:
    """The largest way of a coordinate from the start, at each row (R,) [m, rad]."""
    return np.asarray(np.maximum.reduce(np.abs(q - start), axis=1, initial=0.0))


def _swing(values: Vector) -> Vector:
    """Highest less lowest value up to each row."""
    return np.asarray(np.maximum.accumulate(values) - np.minimum.accumulate(values))


def kinds_of(mechanism: Mechanism) -> frozenset[str]:
    if mechanism not in KINDS:
        from mbd.results.energy import kinds_of_work

        KINDS[mechanism] = kinds_of_work(mechanism.equations)
    return KINDS[mechanism]


def _lending(run: RunData) -> frozenset[str]:
    """Penalty contacts that were open at the start and whose numbers did not change, nor follow modes."""
    equations = run.mechanism.equations
    held = {anchor for machine in equations.machines for anchor in machine.anchors}
    contacts = () if run.parameter_changes else equations.contacts
    return frozenset(
        each.name for each in contacts
        if each.kind == "penalty" and each.name not in run.start.mode and not (held and held & _anchors_of(each))
    )  # fmt: skip


def _anchors_of(contact: Contact) -> set[int]:
    """Numbers of the anchors that the gap and the force of a contact depend on."""
    nodes = live([node for node in (contact.gap, contact.force) if node is not None])
    return {int(node.data[1]) for node in nodes if node.op == "input" and node.data[0] == "anchor"}


def _sentence(run: RunData, found: Judgement) -> str:
    """Since when, how much, which coordinate moves fastest, and what to try."""
    v = run.kernel
    table = run.table[: found.row + 1]
    first = 1 + v.n_q
    speeds = np.abs(table[:, first : first + v.n_v])
    changes = np.abs(table[:, first + v.n : first + v.n + v.n_v])
    fastest = int(np.argmax(np.nan_to_num(speeds[-1])))
    name = run.mechanism.equations.velocity_names[fastest].removesuffix(".rate")
    top = float(np.max(speeds[:, fastest]))
    turn = run.dt * float(np.max(changes[:, fastest])) / top if top > 0.0 else 1.0  # share of v that a step changes
    way, finer = speeds[-1, fastest] * run.dt, 0.1 * run.dt / max(1.0, turn)
    setting = "the tolerance" if run.kernel.adaptive else f"dt = {run.dt:g} s"
    remedy = "a smaller one" if run.kernel.adaptive else f"dt below {finer:.1g} s"
    return (
        f"t = {table[-1, 0]:.9g} s: numerical energy gain {found.numerical:.3g} J (the mechanism's own energy: "
        f"{found.owned:.3g} J), so the results from here on are wrong; {setting} does not resolve the motion, whose "
        f"fastest coordinate {name!r} moves by {way:.3g} in one step; try {remedy}, or a larger mass or a softer "
        "stiffness there"
    )


def _note(found: Judgement) -> str:
    done = "gain" if found.numerical > 0.0 else "loss"
    share = f" ({100.0 * abs(found.share):.2g} %)" if np.isfinite(found.share) else ""
    return (
        f"numerical energy {done} {abs(found.numerical):.3g} J{share} in a mechanism that has {found.owned:.3g} J; "
        "see run.energy.numerical, and use a smaller dt"
    )
