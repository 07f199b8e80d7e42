"""What a failed run says: time, rows, sizes, names, and what to try."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from mbd.kernel import codes
from mbd.results.failure import Failure
from mbd.results.record import EventRecord
from mbd.simulation.diagnostics.circular import NEARLY_SINGULAR_RTOL, circular_laws
from mbd.simulation.run.data import RunData
from mbd.simulation.run.stepper import Stepper
from mbd.state import State

MAX_EVENTS_PER_STEP = 5000
"""Events within one dt above which a run stops: they follow each other ever faster, or are located too roughly [-]."""

STALLED = frozenset({codes.NOT_CONVERGED, codes.SINGULAR, codes.STAGNATED, codes.TOO_TIGHT, codes.TOO_NEAR,
codes.TOO_SMALL, codes.DEPENDENT, codes.OUTGROWN, codes.GAINED})  # fmt: skip
"""What steps fail with where friction locks a motion."""


def attempt(run: RunData) -> Callable[[str, State], Failure]:
    """What a run has just tried, noted before it is taken back; the failure, given its sentence and the state kept."""
    from mbd.simulation.diagnostics.residuals import residuals_of

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
            (*run.earlier, *run.events)[-12:], happened[len(run.events) :], run.model,  # the latest twelve
        )  # fmt: skip

    return failure


def _iterate(run: RunData, time: float) -> State:
    """Newton's last iterate, which is in the block."""
    block, layout, system = run.kernel.block, run.mechanism.layout, run.stepper.system
    y = block[layout.v : layout.a].copy()
    q = system.compose(block[layout.q : layout.x].copy(), block[layout.x : layout.v].copy())
    return replace(run.state(), time=time, q=q, v=y[: layout.n_v], z=y[layout.n_v :])


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
    from mbd.simulation.diagnostics.causes import Words, cause_of
    from mbd.simulation.diagnostics.jamming import may_jam

    values = stepper.kernel
    now = float(values.time)
    time = float(values.failure_time) if values.failure_time > now else now
    what = beyond or cause_of(Words(stepper, status, events, places or {}, swiftest), status)
    if status in STALLED and not beyond:
        what = may_jam(stepper) + what
    if circular := circular_laws(stepper, NEARLY_SINGULAR_RTOL):
        what = f"{circular}; {what}"
    return f"t = {time:.9g} s (last accepted {now:.9g} s): {what}"


def crowded(events: Sequence[EventRecord], now: float, dt: float) -> str:
    """A sentence if there were too many events within the last dt, '' otherwise."""
    if len(events) <= MAX_EVENTS_PER_STEP or events[-MAX_EVENTS_PER_STEP].time < now - dt:
        return ""
    from mbd.simulation.diagnostics.causes import last_events

    return (
        f"t = {now:.9g} s: more than {MAX_EVENTS_PER_STEP} events within one dt: {last_events(events)}; use a "
        "smaller dt, or where it applies a softer stiffness, a larger rest_speed or locate='root'"
    )
