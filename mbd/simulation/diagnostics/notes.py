"""What a run tells its user in ``stats["notes"]``: what happened on purpose but might surprise."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from mbd.assembly.doubtful import degrees, doubts_of
from mbd.equal import HALF_PRECISION_RTOL
from mbd.equations.equations import Contact
from mbd.kernel.codes import EPS, PULL
from mbd.results.columns import ModelColumns
from mbd.results.record import EventRecord, Record
from mbd.simulation.diagnostics.coarse import coarse_steps, percent
from mbd.simulation.diagnostics.fastest import fastest, resolving_dt, sane_rows
from mbd.simulation.diagnostics.idle_modes import idle_modes
from mbd.simulation.diagnostics.impact_step import dt_of_impacts
from mbd.simulation.diagnostics.redundant import readers_of, redundancy
from mbd.simulation.diagnostics.singular import singular_start
from mbd.simulation.diagnostics.stiff import bounded_by_stability
from mbd.simulation.diagnostics.turning import blocks, unresolved_turns
from mbd.simulation.run.data import RunData
from mbd.simulation.run.stored import record_of
from mbd.topology.doubts import MAX_PLAUSIBLE_ANGLE

MAX_SHARE = 0.02
"""Difference from the balance, over the largest multiplier of the run, above which a run says so [-]."""

Note: TypeAlias = str | Callable[[], list[str]]
"""A sentence, or what finds sentences when somebody reads them, after the run's arrays serve another run."""

RESOLVED_STEPS = 10.0
"""Steps that a penalty contact must last to be resolved at all."""
HALVING_RATIO = 3.0
"""An impact over the time in which half of its speed is gone: half a sine has cos(π/3) = ½ [-]."""


MAX_IMPACTS = 8
"""Impacts of a contact from which the step that resolves them is found."""

RESTARTED = (
    "controllers restarted, with their first state and a sample at the start: they or the state are not those "
    "that the run before ended with"
)
"""Of a run that goes on from another one without what its controllers kept."""

DAMAGED = (
    "what the start remembers of the run before is damaged: {}; the scheme restarted from its positions, velocities "
    "and contacts alone, so that the motion is that of a new run"
)
"""Of a run that goes on from a state whose memory no run has written."""

MIN_MOTION = 0.05
"""Way [m, rad] beyond which rows that still depend on each other do so anywhere."""
STALLED = "n_stalled"
"""Steps of another size than dt for no reason that is counted alone."""
COUNTED = (
    (STALLED, "{count} steps were shortened where Newton's method failed, or forces changed too much, at the full dt"),
    ("n_halved", "{count} steps were halved where no impulses at the end of one obeyed all laws"),
    ("n_sized", "{count} steps got another size, as one would have come too close to a singular configuration"),
    (
        "n_singular_steps",
        "singular configurations were passed: {count} steps next to them held positions alone on the rows; their "
        "velocities and multipliers are less accurate",
    ),
    (
        "n_energetic_impacts",
        "{count} impacts took Stronge's energetic restitution, where the {impact} law would have created energy "
        "or has no solution",
    ),
    (
        "n_endless",
        "{count} Zeno sequences of alternating impacts at one instant; their limit was taken, in which the contacts "
        "close together",
    ),
)
"""Counts of the kernel, and what to say where they are not zero."""


MAX_RATE_ERROR = 1.0
"""Estimated error of a rate, over the rate, in a step that is not resolved, above which a run is in doubt [-]."""
MAX_ENERGY_SHARE = 0.5
"""Share of the energy that a scheme has given or taken above which a run is in doubt [-]."""


def notes_of(run: RunData, record: Record) -> tuple[list[Note], list[str]]:
    """The notes of a run that is over, and those of them that put its result in doubt."""
    equations = run.mechanism.equations
    notes: list[Note] = [*doubts_of(run.model, run.mechanism)]
    if np.maximum.reduce(np.abs(run.start.q), initial=0.0) >= MAX_PLAUSIBLE_ANGLE:
        notes = [*degrees(equations, dict(zip(run.start.names, run.start.q.tolist(), strict=False))), *notes]
    notes += [*run.mechanism.notes, *getattr(run.mechanism.common, "notes", ())]
    notes.append(_redundancy(run, record) if run.stepper.dependent else singular_start(run))
    notes += [DAMAGED.format(run.damage)] if run.damage else []
    if run.boundaries.controllers and not run.carried and run.start.memory is not None:
        notes.append(RESTARTED)
    stalled = int(run.kernel.n_shortened - run.kernel.n_sized - run.kernel.n_halved)
    counts = [(stalled if name == STALLED else int(getattr(run.kernel, name)), text) for name, text in COUNTED]
    notes += [text.format(count=count, impact=run.settings["impact"]) for count, text in counts if count]
    if "nonsmooth_since" in run.settings:
        notes.append(f"{run.settings['contact_reason']}; since then errors of impacts are of the size of dt")
    unresolved = coarse_steps(run, record)
    notes += unresolved
    doubts = _energy_lost(run, record)
    notes += doubts or ([run.energy.note] if run.energy.note else [])
    doubts += [run.energy.note] if run.energy.note and abs(run.energy.share) > MAX_ENERGY_SHARE and not doubts else []
    doubts += unresolved if run.kernel.coarsest_change > MAX_RATE_ERROR else []
    notes += [run.room.note] if run.room.note else []
    spent = float(run.kernel.error_sum)
    if spent > 1e-4 and not run.kernel.adaptive:  # [m/s, rad/s]
        notes.append(
            f"estimated errors of velocities add up to {spent:.2g} m/s or rad/s over all steps: dt is large for the "
            "motion; use a smaller dt, or tol="
        )
    notes += bounded_by_stability(run, record)
    notes += unresolved_turns(run, record)
    notes += _uncounted(run, record)
    columns = ModelColumns(record, equations)
    notes += idle_modes(run, record, columns)
    if getattr(run.integrator, "formulation", "") == "index3":
        v = run.kernel
        size = float(np.max(v.scale[v.n : v.n + v.n_rows], initial=0.0))
        notes.append(partial(_position_level_multipliers, record, columns, size))  # which takes longer than a short run
    turned = _half_turns(columns)
    notes, doubts = [*notes, *turned], doubts + turned
    for number, contact in enumerate(run.manager.contacts):
        short, blind = _short_touch(run, record, number, contact)
        notes += _ignored(run, number, contact)
        if run.kernel.closing_gap[number] < -0.5 * HALF_PRECISION_RTOL:
            notes += _overshot(run, columns, contact)
        notes += short
        if run.kernel.row_bounds[1 + number] > 0.0:
            held = _pulled(record, number, contact)
            notes, doubts = [*notes, *held], doubts + held
        doubts += blind
    slack, short = _pushing(run, columns)
    return [*notes, *slack, *short], doubts + short


def _redundancy(run: RunData, record: Record) -> str:
    """The note on rows that left the solve."""
    equations, dependent = run.mechanism.equations, run.stepper.dependent
    loaded = bool(run.kernel.loaded) or any(friction.contact >= 0 for friction in equations.frictions)
    slid = loaded and any(code.active.given_rows for code in run.stepper.modes)
    moved = any(np.max(np.abs(part - record.q[:1]), initial=0.0) > MIN_MOTION for part in blocks(record.q))
    return redundancy(equations.rows, dependent, slid, moved, _left_singular(run), readers_of(equations, dependent))


def _pushing(run: RunData, columns: ModelColumns) -> tuple[list[str], list[str]]:
    """Muscles that push: out of equilibrium as the run begins, or on a path shorter than their tendon alone."""
    forces = getattr(run.model, "forces", ())
    if not forces:
        return [], []
    slack, short = list[str](), list[str]()
    from mbd.forces.muscles import Muscle

    muscles = [force for force in forces if isinstance(force, Muscle)]
    for name, muscle in ((each.name, each) for each in muscles):
        lengths, tendons = columns.at_rows([f"{name}.length", f"{name}.tendon_length"])
        if muscle.is_elastic and muscle.curves == "millard":  # whose tendon carries nothing where it is slack
            lengths = lengths[:1]
        pushes = np.flatnonzero(lengths < tendons[: len(lengths)])
        asked = [columns.node(f"{name}.{field}") for field in ("force", "max_force")]
        force, most = (float(x[0]) for x in columns.evaluate(asked, columns.part(np.array([0]), asked)))
        if len(pushes):
            row = int(pushes[0])
            when = f" at t = {columns.rows.time[row]:.3g} s" if row else ""
            short.append(
                f"muscle {name!r} pushes{when}: its path is {lengths[row]:.3g} m long and its tendon alone "
                f"{tendons[row]:.3g} m; lengths are in metres, and fibers and tendon together are about as long as the "
                "path"
            )
        elif force < -0.02 * most and muscle.is_elastic:  # less is no push that anyone sees
            slack.append(
                f"muscle {name!r} begins out of equilibrium and pushes with {-force:.3g} N until its fibers have taken "
                f"up the slack; position={{'{name}.fiber_length': muscle.fiber_at(state['{name}.length'], "
                f"activation)}} of mbd.assemble begins in equilibrium"
            )
    return slack, short


def _left_singular(run: RunData) -> bool:
    """Whether rows that depended on each other act still and are independent now: so the configuration was singular."""
    v = run.kernel
    acting = run.manager.active_rows(v.closed[: v.n_contacts], v.sticks[: v.n_frictions])
    held = set(acting)
    return any(row in held and held.issuperset(on) and not v.dropped[row] for row, on in run.stepper.dependent.items())


def _uncounted(run: RunData, record: Record) -> list[str]:
    """The note on angles of cut joints in space that may have made more turns than their rates at the rows tell."""
    if not run.mechanism.equations.wrapped:
        return []
    found = ModelColumns(record, run.mechanism.equations).doubtful_turns()
    text = ", ".join(f"{name!r} after t = {time:.6g} s" for name, time in found)
    return [f"whole turns are a guess of {text}: store more rows, take a smaller dt, or do not cut it"] if found else []


def _energy_lost(run: RunData, record: Record) -> list[str]:
    """The note on the energy with the dt that resolves the fastest motion, where most of the energy is gone."""
    if not run.energy.share < -MAX_ENERGY_SHARE or run.kernel.adaptive:
        return []
    rate = fastest(run, record, sane_rows(run))
    text = f": dt = {run.dt:g} s does not resolve its fastest motion of {rate:.3g} rad/s, dt below "
    return [run.energy.note + (f"{text}{resolving_dt(rate):.2g} s does" if rate * run.dt > 1.0 else "")]


def _ignored(run: RunData, number: int, contact: Contact) -> list[str]:
    """A contact that lay below its surface or went into it while it was left out on purpose."""
    deepest, sinking = run.kernel.deepest[number], run.kernel.sinking[number]
    notes = []
    if deepest < -1e-9:
        notes.append(f"{contact.name!r} lay up to {-deepest:.3g} {contact.unit} below its surface while ignored")
    if np.isfinite(sinking):
        notes.append(f"{contact.name!r} was released at t = {sinking:.6g} s while moving into its surface")
    return notes


def _pulled(record: Record, number: int, contact: Contact) -> list[str]:
    """A foot that stays until another contact closes, and pulled meanwhile, which a ground cannot do."""
    if contact.kind == "penalty" or contact.opens_on != "when" or contact.may_pull or contact.unit != "m":
        return []
    pull = np.where(record.closed[:, number] == 1, record.lam[:, contact.rows[0]], 0.0)
    worst = int(np.argmax(pull)) if len(pull) else 0
    if not len(pull) or not pull[worst] > PULL * float(np.max(np.abs(record.lam[worst]))):
        return []
    pull = np.maximum(pull, 0.0)
    steps = np.diff(record.time)
    when = record.time[pull > 0.0]
    impulse = 0.5 * float(np.sum(steps * (pull[1:] + pull[:-1])))
    return [
        f"{contact.name!r} pulled with up to {pull[worst]:.3g} N at t = {record.time[worst]:.6g} s, {impulse:.3g} N s "
        f"in all from {when[0]:.6g} to {when[-1]:.6g} s, since its When rule alone opens it: may_pull=False lets it "
        "open then too, may_pull=True leaves this note out"
    ]


def _overshot(run: RunData, columns: ModelColumns, contact: Contact) -> list[str]:
    """A located contact that closes below its surface: it was passed in a step too long to see it come."""
    if contact.kind == "penalty" or run.kernel.strategy == 1 or run.kernel.linear == 1:
        return []
    record = columns.record
    last = len(record.time) - 1
    rows = [min(event.row, last) for event in run.events if event.name == contact.name and event.kind == "closed"]
    if not rows:
        return []
    (gaps,) = columns.evaluate([contact.gap], columns.part(np.array(rows), [contact.gap]))
    worst = int(np.argmin(gaps))
    if not gaps[worst] < -HALF_PRECISION_RTOL:
        return []
    return [
        f"{contact.name!r} closed {-gaps[worst]:.2g} {contact.unit} below its surface at t = "
        f"{record.time[rows[worst]]:.6g} s: steps were too long to see it come; use a smaller dt"
    ]


def _short_touch(run: RunData, record: Record, number: int, contact: Contact) -> tuple[list[str], list[str]]:
    """A penalty contact over within a few steps is not resolved: its energy is anyone's guess. (note, doubt)"""
    if contact.kind != "penalty" or run.kernel.adaptive:
        return [], []
    events = [event for event in run.events if event.name == contact.name]
    least = float(run.kernel.least_contact_step[number])
    if least > 0.0:
        safe = dt_of_impacts(run, record, number, _closings(record, events)[:MAX_IMPACTS])
        took = f"{contact.name!r} took steps of down to {least:.2g} s while it was closed"
        softer = "a softer stiffness or mbd.Unilateral needs none of them"
        if not safe < run.dt:
            return [f"{took}, which resolve its impacts; {softer}"], []
        return [f"{took}: dt = {run.dt:g} s has too few for its impacts; dt below {safe:.2g} s has, and {softer}"], []
    spans = [b.time - a.time for a, b in pairwise(events) if (a.kind, b.kind) == ("closed", "opened")]
    shortest = min(spans, default=np.inf)
    text = f"closed for {shortest / run.dt:.2g} steps only"
    if shortest >= RESOLVED_STEPS * run.dt and events and events[-1].kind == "closed":
        half = _halved(run, contact, events[-1].row)
        shortest = HALVING_RATIO * half
        text = f"closed to stay and lost half of its speed within {half / run.dt:.2g} steps"
    if shortest >= RESOLVED_STEPS * run.dt:
        return [], []
    safe = dt_of_impacts(run, record, number, _closings(record, events)[:MAX_IMPACTS])
    safe = safe if np.isfinite(safe) else shortest / RESOLVED_STEPS
    note = (
        f"{contact.name!r} {text}, too few: its peak force and energy are not resolved; use dt below {safe:.2g} s, "
        "a softer stiffness, or mbd.Unilateral"
    )
    # an impact of fewer steps is the scheme's, not the law's: the run's message says so
    return [note], [note] if shortest < 2.0 * run.dt else []


def _closings(record: Record, events: Sequence[EventRecord]) -> list[int]:
    """The rows in which a contact closed."""
    last = len(record.time) - 1
    return [min(event.row, last) for event in events if event.kind == "closed"]


def _halved(run: RunData, contact: Contact, row: int) -> float:
    """Time from the row in which a contact closed until it approaches half as fast, by the rows stored [s].

    Infinite where that takes longer than a resolved impact, or the run ends before.
    """
    table = run.table[row : min(run.stored, row + 2 + int(RESOLVED_STEPS))]
    table = table[table[:, 0] <= table[0, 0] + RESOLVED_STEPS / HALVING_RATIO * run.dt]
    if len(table) < 2:
        return np.inf
    columns = ModelColumns(replace(record_of(run, table), parameter_changes=[]), run.mechanism.equations)
    (rate,) = columns.evaluate([contact.gap_rate], columns.rows)
    slow = np.flatnonzero(rate > 0.5 * rate[0])
    if rate[0] >= 0.0 or not len(slow):
        return np.inf
    k = int(slow[0])
    share = (rate[k - 1] - 0.5 * rate[0]) / (rate[k - 1] - rate[k])
    return float(table[k - 1, 0] - table[0, 0] + share * (table[k, 0] - table[k - 1, 0]))


def _half_turns(columns: ModelColumns) -> list[str]:
    """A doubt on each spring of a rotation vector (`Spherical`, `Bushing`) that came beyond half a turn.

    ``V = ½ k θ²`` has a kink at θ = π, where there are two shortest ways back; a step across it loses its accuracy.
    """
    found = []
    if len(columns.record.time) < 2:
        return []
    for spring, names in _rotation_vectors(columns):
        vectors = np.column_stack(columns.at_rows(names))
        jumped = np.linalg.norm(np.diff(vectors, axis=0), axis=1) > np.pi
        if jumped.any():
            time = columns.record.time[int(np.argmax(jumped)) + 1]
            found.append(
                f"{spring!r} was turned beyond half a turn at t = {time:.6g} s, where its torque jumps from "
                "one way back to the other within a step: energy is not kept there; give it a stop like mbd.cone, "
                "or a law that is smooth there, such as an mbd.Potential of the parts of the quaternion"
            )
    return found


def _rotation_vectors(columns: ModelColumns) -> list[tuple[str, list[str]]]:
    """Springs with the names of the parts of their rotation vectors, which are looked for once."""
    memory = columns.equations.memory
    if "rotation vectors" not in memory:
        stems = [
            (effect.name, stem) for effect in columns.equations.effects if effect.potential is not None
            for stem in dict.fromkeys((effect.name, effect.name.removesuffix(" spring")))
        ]  # fmt: skip
        named = [(spring, [f"{stem}.rotation_vector.{axis}" for axis in "xyz"]) for spring, stem in stems]
        memory["rotation vectors"] = [pair for pair in named if all(map(columns.knows, pair[1]))]
    found: list[tuple[str, list[str]]] = memory["rotation vectors"]
    return found


def _position_level_multipliers(record: Record, columns: ModelColumns, size: float) -> list[str]:
    """The note of index 3 on rows whose multipliers differ from what the balance of forces has at the same state.

    A scheme of order 2 that holds ``h(q₁) = 0`` alone takes the error of its own position formula, O(dt³), for an
    acceleration: multipliers err by O(dt) in the first steps after a start or an event (Arnold, Brüls, Cardona 2015,
    Numerische Mathematik 129, 149-179). So it does with the round-off of positions, O(1/dt²).

    size : of the largest terms of rows on positions [m, rad]
    """
    if len(record.time) < 3:
        return []
    rows = columns.rows.part(np.arange(1, min(16, len(record.time))))  # few rows after the start tell it
    solved = columns.balance.solve(rows)
    known = solved.sound & solved.unique
    off = np.max(np.abs(rows.lam - solved.lam)[known], axis=0, initial=0.0)
    share = off / np.maximum(np.max(np.abs(record.lam), axis=0, initial=0.0), 1e-300)
    steps = np.diff(record.time[: len(rows.lam) + 1])
    blurred = 16.0 * EPS * size / max(float(np.max(steps)), 1e-300) ** 2  # what rows may miss, as an acceleration
    fastest_change = float(np.max(np.abs(record.a), initial=0.0))
    is_brief = blurred > 0.05 * MAX_SHARE * fastest_change
    worst = [
        k
        for k, row in enumerate(columns.equations.rows)
        if not row.is_velocity and row.friction < 0 and share[k] > (0.05 if is_brief else 1.0) * MAX_SHARE
    ]
    if not worst:
        return []
    k = max(worst, key=lambda k: float(share[k]))
    row = columns.equations.rows[k]
    if is_brief:
        return [
            f"multipliers are off, of {row.owner!r} by {percent(float(share[k]))} % of its largest: steps of "
            f"{float(np.max(steps)):.2g} s are so short that index 3 takes round-off of positions for accelerations "
            f"of up to {blurred:.2g} m/s² or rad/s²; use a larger dt, or formulation='ggl'"
        ]
    return [
        f"multipliers of the first steps are off, of {row.owner!r} by {percent(float(share[k]))} % of its largest: "
        "index 3 has them with an error of first order in dt after the start and each event, until its damping has "
        "taken that away; formulation='ggl' has them with order 2"
    ]
