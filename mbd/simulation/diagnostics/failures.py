"""What a failed run says: time, rows, sizes, names, and what to try."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mbd.arrays import Vector
from mbd.assembly.inertia import lost_inertia
from mbd.assembly.not_finite import first_cause, tape_inputs
from mbd.assembly.posture import Posture
from mbd.integrators.base import Point
from mbd.kernel import codes
from mbd.results.failure import Failure
from mbd.results.record import EventRecord
from mbd.simulation.diagnostics.grip import lost_grip
from mbd.simulation.diagnostics.jamming import may_jam
from mbd.simulation.diagnostics.redundant import clash
from mbd.simulation.diagnostics.round_off import remainder
from mbd.simulation.run.data import RunData
from mbd.simulation.run.plain import PlainScheme
from mbd.simulation.run.stepper import Stepper
from mbd.state import State
from mbd.tape.evaluate import evaluate

__all__ = ["attempt", "crowded", "explanation"]

RUSHING = 3.0
"""Change of a rate in a step over the largest so far, above which dt is reported not to resolve the motion [-]."""
SLOW = 1e-3
"""Largest rate so far [m/s, rad/s] below which that is not asked: a start from rest is no motion that runs away."""
MOST_EVENTS = 5000
"""Events within one dt above which a run stops: they follow each other ever faster, or are located too roughly [-]."""

STALLED = frozenset({codes.NOT_CONVERGED, codes.SINGULAR, codes.STAGNATED, codes.TOO_TIGHT, codes.TOO_NEAR,
codes.TOO_SMALL, codes.DEPENDENT,
                     codes.OUTGROWN, codes.GAINED})  # fmt: skip
"""What steps fail with where friction locks a motion."""
LATEST = 12
"""Events that a failure tells."""


def attempt(run: RunData) -> Callable[[str, State], Failure]:
    """What a run has just tried, noted before it is taken back; the failure, given its sentence and the state kept."""
    v = run.kernel
    newton = v.failure_time > run.now and v.block_time == v.failure_time
    time = max(float(v.failure_time), run.now)
    candidate = _iterate(run, time) if newton else run.state()
    residuals = residuals_of(run.stepper, v.block) if newton else {}
    residual = float(v.failure_size) if newton else 0.0
    happened = tuple(run.events)

    def failure(problem: str, final: State) -> Failure:
        return Failure(
            problem, final.time, time, final, candidate, residuals, residual, run.tried, run.dt,
            run.stepper.integrator, run.settings, dict(run.changed),
            (*run.earlier, *run.events)[-LATEST:], happened[len(run.events) :], run.model,
        )  # fmt: skip

    return failure


def _iterate(run: RunData, time: float) -> State:
    """Newton's last iterate, which is in the block."""
    block, layout, system = run.kernel.block, run.mechanism.layout, run.stepper.system
    y = block[layout.v : layout.a].copy()
    q = system.compose(block[layout.q : layout.x].copy(), block[layout.x : layout.v].copy())
    return replace(run.state(), time=time, q=q, v=y[: layout.n_v], z=y[layout.n_v :])


def residuals_of(stepper: Stepper, block: Vector) -> dict[str, float]:
    """The balance by coordinate, and the rows that are closed with their rates, at the inputs in a block."""
    mode = int(stepper.kernel.mode_id)
    if mode < 0:
        return {}
    code, n = stepper.modes[mode], stepper.kernel.n
    out = np.zeros(n + 2 * len(code.rows) + 1)
    with np.errstate(all="ignore"):
        program = getattr(code.residual, "program", code.residual)  # a replay watches that of the step
        program(block, stepper.kernel.params, out)
    return dict(zip(residual_names(stepper, code.rows), out.tolist(), strict=False))


def residual_names(stepper: Stepper, rows: Sequence[int]) -> list[str]:
    """Names of the balance and of rows in the order in which a mode's code gives them."""
    equations = stepper.mechanism.equations
    names = [name.removesuffix(".rate") for name in equations.velocity_names]
    names += [state.name for state in equations.states]
    titles = [equations.rows[row].title for row in rows]
    return names + titles + ([f"{title} (rate)" for title in titles] if stepper.stabilized else [])


def explanation(
    stepper: Stepper, status: int, events: Sequence[EventRecord] = (), places: Mapping[str, str] | None = None,
    swiftest: float = 0.0, beyond: str = "",
) -> str:  # fmt: skip
    """A sentence for a failure status of the kernel.

    Parameters
    ----------
    places : the frames that forces act on, by their names
    swiftest : largest rate of a coordinate in any row so far [m/s, rad/s]
    beyond : what `out_of_reach` says: the cause of whatever else is found
    """
    values = stepper.kernel
    now = float(values.time)
    time = float(values.failure_time) if values.failure_time > now else now
    names = sorted(stepper.manager.mode(values.closed[: values.n_contacts]).closed)
    closed = f" with {', '.join(map(repr, names))} closed" if names else ""
    what = beyond or _what(stepper, status, closed, events, places or {}, _rushing(stepper, swiftest))
    if status in STALLED and not beyond:
        what = may_jam(stepper) + what
    return f"t = {time:.9g} s (last accepted {now:.9g} s): {what}"


def _what(
    stepper: Stepper, status: int, closed: str, events: Sequence[EventRecord], places: Mapping[str, str], rushing: str
) -> str:
    """What went wrong and what to try; `closed` and `rushing` tell in words which contacts are, and what runs away."""
    if status == codes.NOT_FINITE:
        return f"{_not_finite(stepper, places)}{closed}; nothing after the last accepted step is kept"
    if status in (codes.NOT_CONVERGED, codes.STAGNATED, codes.TOO_TIGHT):
        return _no_end(stepper, status, closed, rushing)
    if status in (codes.OUTGROWN, codes.GAINED, codes.LEAPT, codes.UNSTABLE):
        return _unresolved(stepper, status, closed)
    if status in (codes.SINGULAR, codes.TOO_NEAR):
        return f"the Newton matrix is singular at {_unknown(stepper)}{closed}; {_why_singular(stepper)}"
    if status == codes.TOO_BRIEF:
        name = stepper.manager.names[int(stepper.kernel.failure_index)]
        return (
            f"{name!r} is so stiff that its impact asks for steps below {float(stepper.kernel.failure_step):.2g} s, a "
            f"millionth of dt{closed}; use a softer stiffness, mbd.Unilateral, or a smaller dt"
        )
    if status in (codes.TOO_SMALL, codes.SINGULAR_ROWS_MOVE):
        return _no_size(stepper, status, closed)
    if status == codes.JUMPED:
        name = stepper.manager.names[int(stepper.kernel.failure_index)]
        return (
            f"the angle of {name!r} jumps past zero{closed}, as a twist does at half a turn: there is no instant at "
            "which it closes; keep the motion away from there, stop it before, or measure an angle that does not jump"
        )
    if status == codes.ILL_CONDITIONED:
        error, who = float(stepper.kernel.lost_digits), _unknown(stepper).removeprefix("the motion of ")
        return (
            f"accelerations have no correct digits{closed}: ones that are known are found with a relative error of "
            f"{error:.1g} at {who}, as the inertia of some motion is a small difference of large ones; give light and "
            "slender bodies an inertia about their own center, put fewer of them into one chain, or try cut='all'"
        )
    if status in (codes.DEPENDENT, codes.CONFLICT):
        if int(stepper.kernel.failure_index) < stepper.kernel.n:
            lost = lost_inertia(_accepted(stepper))
            if lost:
                return f"{lost}{closed}"
            return f"neither mass nor rows determine {_unknown(stepper)}{closed}; give it a mass, or lock it"
        return (
            f"{_clashing(stepper, status)}{closed}; leave one out, hold fewer contacts closed, or, where they do so in "
            "this singular configuration only, start beside it"
        )
    if status == codes.ENDLESS_TRANSITIONS:
        return (
            f"transitions follow each other without end at one instant: {_last_events(events)}; one of the modes needs "
            "another cause, or an only_while= that ends them"
        )
    if status in (codes.CHATTER, codes.NO_IMPACT, codes.ENERGY_GAIN, codes.NO_FORCE):
        return _no_contact(stepper, status, closed, events)
    return f"the instant of an event could not be isolated{closed}{_worst(stepper)}; try a smaller dt"


def _no_end(stepper: Stepper, status: int, closed: str, rushing: str) -> str:
    """A Newton iteration that does not come to its end."""
    worst, residual = _worst(stepper), float(stepper.kernel.failure_size)
    if status != codes.NOT_CONVERGED:
        left = remainder(stepper)
        how = "stagnated" if rushing else "stagnated at round-off"
        return (
            f"{how}: residual {left.residual:.3g}, attainable {left.attainable:.3g} of the forces{closed}{worst}"
            f"{rushing or '; use a larger tolerance= of the integrator or a larger dt'}"
        )
    if residual < 0.0:
        return (
            f"a step would miss an angle by more than half a radian, down to a tenth of dt{closed}"
            f"{worst}: the motion is too fast to be resolved; use a smaller dt"
        )
    message = stepper.scheme.report.message if isinstance(stepper.scheme, PlainScheme) else ""
    if residual <= 1.0 and message:
        return (
            f"steps fail down to a tenth of dt; {type(stepper.scheme.integrator).__name__} says: {message}"
            f"{closed}{worst}; try a smaller dt{rushing}"
        )
    if residual <= 1.0 and stepper.kernel.n_active == 0:
        return (
            f"steps fail down to a tenth of dt{closed}{worst}: a force changes too much within dt; try a smaller dt, "
            f"such as {stepper.kernel.dt / 10.0:.1g} s{rushing}"
        )
    if residual <= 1.0:
        return (
            f"steps fail or leave the branch continuous in velocity, down to a tenth of dt{closed}"
            f"{worst}: next to a singular configuration, or in a force too steep for dt; try a smaller dt, or, "
            f"at such a pose, {_passing(stepper)}{rushing}"
        )
    own = f" ({message})" if message else ""
    return (
        f"Newton stalled at {residual:.3g} times the tolerance after "
        f"{stepper.kernel.max_iterations} "
        f"iterations{own}{closed}{worst}; try a smaller dt or softer stiffness; a force that jumps with "
        "the state (mbd.where, sign) must be made continuous, or be switched by an Event or Controller"
        f"{rushing}"
    )


def _unresolved(stepper: Stepper, status: int, closed: str) -> str:
    """A step whose change cannot be that of the motion: which rate, from what to what, and what to try."""
    values = stepper.kernel
    h, growth, dt = float(values.failure_step), float(values.unforeseen_change), float(values.step)
    who = int(values.failure_index)
    change = (
        f"a step of {h:.2g} s takes the rate of {_unknown(stepper).removeprefix('the motion of ')} from "
        f"{values.y[who]:.3g} to {values.y1[who]:.3g}{closed}"
    )
    if status == codes.OUTGROWN:
        return (
            f"{change}, by forces that grow with the motion: in a step of dt a change that nothing predicted grows by "
            f"{growth:.2g} of itself. dt does not resolve the motion, or a force lets it run away; try a smaller dt, "
            f"such as {0.1 * dt / max(growth, 1.0):.1g} s"
        )
    if status == codes.UNSTABLE:
        scheme, limit = type(stepper.integrator).__name__, stepper.own.abilities.stability
        return (
            f"{change}, by forces that are stiff there: ω dt = {growth:.3g}, but {scheme} is stable up to {limit:g}; "
            "beyond that errors grow from step to step; use a smaller dt, tol= or mbd.RadauIIA()"
        )
    if status == codes.LEAPT:
        return (
            f"{change}, over a place where forces are over a hundred times those before and after it, such as the pole "
            "of 1/x: the scheme sees nothing of them; use a smaller dt to see what happens there, or a force that is "
            "bounded wherever the motion goes"
        )
    shorter = "" if values.explicit else ", as do steps down to a tenth of dt"
    return (
        f"{change}, more than the forces along the way can do{shorter}: dt does not resolve a force that is steep "
        f"there; try a smaller dt, such as {0.05 * dt:.1g} s, or a softer force"
    )


def _no_size(stepper: Stepper, status: int, closed: str) -> str:
    """A step for which no size is right: by its estimated error, or at a singular configuration."""
    residual, h, misfit = stepper.kernel.failure_size, stepper.kernel.failure_step, stepper.kernel.misfit
    if status == codes.TOO_SMALL:
        return (
            f"steps fell below {h:.2g} s without an error of "
            f"{stepper.kernel.allowed:.2g} per second{closed}; a force that jumps with the state (mbd.where, sign) "
            "must be made continuous, or be switched by an Event or Controller; or ask for less by tol="
        )
    explicit = stepper.kernel.explicit
    others = "mbd.GeneralizedAlpha, mbd.HHT or mbd.RadauIIA" if explicit else "mbd.GeneralizedAlpha or mbd.HHT"
    source = f"round-off, or the {misfit:.1g} by which redundant rows do not fit," if misfit > 1e-14 else "round-off"
    return (
        f"a singular configuration, at {_unknown(stepper)}{closed}: {source} would make "
        f"{residual:.1g} of the velocities in a step of {h:.2g} s over it; use {others}, or longer steps (a larger "
        "dt= or tol=)"
    )


def _no_contact(stepper: Stepper, status: int, closed: str, events: Sequence[EventRecord]) -> str:
    """Contacts and frictions that have no forces, no impulses, or no end of switching."""
    grip = lost_grip(stepper, events) if status in (codes.CHATTER, codes.NO_IMPACT) else ""
    if grip:
        return grip
    if status == codes.CHATTER:
        most = stepper.kernel.max_switches
        many = max(stepper.kernel.n_switches, stepper.kernel.n_repeats) > most
        message = f"more than {most} switches" if many else "the same switches again and again"
        return (
            f"{message} at one instant: {_last_events(events)}; they "
            f"follow each other without motion; {_undamped(stepper)}{_sticking(stepper, events)}"
            "give a contact a release rule, friction or a penalty law, or an event a reset that leaves zero"
        )
    if status == codes.NO_IMPACT:
        return (
            f"no forces or impulses let every contact push or open{_touching(stepper)}: one that sticks "
            "whatever its force may have none, where it pulls closed and would sink in open; give it friction=mu, with "
            "which it slips there, or 0, a release rule or a penalty contact"
        )
    if status == codes.ENERGY_GAIN:
        return (
            f"the impact law would create energy{_touching(stepper)}, and Stronge's in its place as well: a "
            "restitution above 1 does; use one from 0 to 1"
        )
    name = stepper.manager.names[int(stepper.kernel.failure_index)]
    return (
        f"Painlevé: no consistent contact force at {name!r}, which slides with friction so that a push "
        f"makes it approach{closed}; rigid bodies with Coulomb friction have no motion there: lower the "
        "friction coefficient, or make the contact compliant with mbd.Penalty"
    )


def _undamped(stepper: Stepper) -> str:
    """What to try where nothing damps contact forces that alternate from step to step."""
    v = stepper.kernel
    if v.explicit or v.estimates or v.gamma != 0.5 or v.alpha_m != v.alpha_f:
        return ""
    return "nothing in the scheme damps forces that alternate: take mbd.HHT(0.05); "


def _why_singular(stepper: Stepper) -> str:
    """What makes a Newton matrix singular, and what to try: rows, the mass matrix, or the step."""
    v, system = stepper.kernel, stepper.system
    if int(v.n_active) > 0:
        return "rows depend on each other: leave one out, or try another dt"
    mode = stepper.manager.mode(v.closed[: v.n_contacts])
    zero, y, layout = np.zeros(v.n_v), v.y[: v.n], stepper.mechanism.layout
    time, q = float(v.time), v.q[: v.n_q]
    if v.block_time > time:  # what the step was tried at
        y, time = v.block[layout.v : layout.a].copy(), float(v.block_time)
        q = system.compose(v.block[layout.q : layout.x].copy(), v.block[layout.x : layout.v].copy())
    with np.errstate(all="ignore"):
        terms = system.evaluate(Point(time, q, zero, y, np.zeros(v.n), np.zeros(0)), mode, (0.0, 0.0))
        M = np.asarray(terms.S)
        size = np.sqrt(np.abs(np.diag(M)))
        sizes = np.linalg.svd(M / np.outer(size, size), compute_uv=False) if np.all(size > 0.0) else np.zeros(1)
    if not np.isfinite(sizes).all() or sizes[-1] < 1e-12:
        return "no row acts there, so its mass matrix is: nothing resists that motion; give what it moves a mass"
    return (
        "no row acts there and its mass matrix is regular: dt is too large for a force that grows along the motion "
        "(a negative stiffness or damping); use a smaller dt"
    )


def crowded(events: Sequence[EventRecord], now: float, dt: float) -> str:
    """A sentence if there were too many events within the last dt, '' otherwise."""
    if len(events) <= MOST_EVENTS or events[-MOST_EVENTS].time < now - dt:
        return ""
    return (
        f"t = {now:.9g} s: more than {MOST_EVENTS} events within one dt: {_last_events(events)}; use a smaller dt, "
        "or where it applies a softer stiffness, a larger rest_speed or locate='root'"
    )


def _accepted(stepper: Stepper) -> Posture:
    """The accepted state with the constraints that are active."""
    K = stepper.kernel
    q, y, flags, anchors = K.q[: K.n_q].copy(), K.y[: K.n].copy(), K.closed[: K.n_contacts], K.anchors[: K.n_anchors]
    return Posture(stepper.mechanism, stepper.manager, K.params, q, y, flags, anchors.copy(), time=float(K.time))


def _clashing(stepper: Stepper, status: int) -> str:
    """Which rows depend on each other or conflict."""
    clashing = clash(stepper.mechanism.equations.rows, stepper.kernel)
    what = "depend on each other" if status == codes.DEPENDENT else "conflict"
    return f"rows {what}: {clashing}" if clashing else f"rows {what} at {_unknown(stepper)}"


def _worst(stepper: Stepper) -> str:
    """Where the residual of the step that failed is largest, in words; '' where that is not known."""
    values = stepper.kernel
    if values.block_time != values.failure_time:
        return ""
    sizes = {name: abs(size) for name, size in residuals_of(stepper, values.block).items() if np.isfinite(size)}
    if not sizes:
        return ""
    worst = max(sizes, key=lambda name: sizes[name])
    return f", furthest from balance at {worst if worst.startswith(chr(39)) else repr(worst)}"


def _sticking(stepper: Stepper, events: Sequence[EventRecord]) -> str:
    """A clause on the contact that opens and closes alternately and sticks whatever its force, '' if there is none."""
    equations = stepper.mechanism.equations
    limited = {friction.contact for friction in stepper.manager.frictions}
    for name in dict.fromkeys(event.name for event in events[-6:] if event.kind == "opened"):
        contact = stepper.manager.names.index(name)
        if len(equations.contacts[contact].rows) > 1 and contact not in limited:
            return (
                f"{name!r} sticks whatever its force, and may pull closed and sink in open: with friction=mu it slips "
                "there; else "
            )
    return ""


def _touching(stepper: Stepper) -> str:
    """The contacts that are closed or about to close, and the frictions of joints, in words."""
    values, names = stepper.kernel, stepper.manager.names
    near = [name for c, name in enumerate(names) if values.closed[c] == 1 or values.closing[c] != 0]
    near += [friction.name for friction in stepper.manager.frictions if friction.contact < 0]
    return f" at {', '.join(map(repr, near))}" if near else ""


def _unknown(stepper: Stepper) -> str:
    """The coordinate or row behind a column of the KKT matrix."""
    equations, values = stepper.mechanism.equations, stepper.kernel
    column, n = int(values.failure_index), values.n
    if column < equations.n_v:
        return f"the motion of {equations.velocity_names[column].removesuffix('.rate')!r}"
    if column < n:
        return f"the state {equations.states[column - equations.n_v].name!r}"
    row = equations.rows[int(values.rows[min(column - n, values.n_rows - 1)])]
    return row.title


def _passing(stepper: Stepper) -> str:
    """What passes singular configurations where a scheme did not."""
    explicit = stepper.kernel.explicit
    return "mbd.GeneralizedAlpha or mbd.RadauIIA" if explicit else "formulation='index3' with a damped scheme"


def _last_events(events: Sequence[EventRecord]) -> str:
    """The last switches, oldest first."""
    shown = [f"{event.name!r} {'crossed' if event.kind == 'event' else event.kind}" for event in events[-6:]]
    return ", ".join(shown) or "no contact changed"


def _not_finite(stepper: Stepper, places: Mapping[str, str]) -> str:
    """The first cause whose force is not finite where the step failed."""
    equations, values = stepper.mechanism.equations, stepper.kernel
    inputs = tape_inputs(stepper.mechanism, values.block, values.params)
    cause = first_cause(equations, inputs, places)
    if cause is None and not np.isfinite(evaluate(list(equations.balance), inputs)).all():
        return "the inertia forces are not finite (velocities have run away)"
    return cause or "a derivative of a force or constraint is not finite"


def _rushing(stepper: Stepper, swiftest: float) -> str:
    """What a fixed step makes of velocities, where that is far more than any has been so far; '' elsewhere."""
    values = stepper.kernel
    if values.adaptive or swiftest < SLOW:
        return ""
    gains = np.abs(values.rate[: values.n_v]) * values.dt
    times = float(np.max(gains, initial=0.0)) / swiftest
    if not RUSHING < times < np.inf:
        return ""
    name = stepper.mechanism.equations.velocity_names[int(np.argmax(gains))]
    return (
        f"; in a step of dt {name!r} changes by {times:.2g} times the largest rate so far: dt does not resolve the "
        f"motion, or a force lets it run away; try dt = {0.1 * values.dt / times:.1g} s"
    )
