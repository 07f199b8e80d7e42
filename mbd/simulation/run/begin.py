"""How a run begins: the start put into the kernel's arrays, contacts and guards told on which side they are."""

from collections.abc import Iterable

import numpy as np

from mbd.arrays import Vector
from mbd.assembly.consistency import residuals
from mbd.assembly.inertia import undetermined
from mbd.assembly.machines import first_anchors, store_first
from mbd.assembly.orientation import reversed_joints
from mbd.assembly.pose import Posture
from mbd.errors import ModelError
from mbd.kernel.events.guards import is_watched
from mbd.kernel.stepping.begin_run import MAX_START_DEPTH
from mbd.simulation.run.data import RunData
from mbd.simulation.run.memory import memory_of_end
from mbd.simulation.run.parameters import residuals_now, violations_now
from mbd.state import State


def notify(run: RunData) -> None:
    """Of which contacts and events Python must hear."""
    notify = run.kernel.notify
    ends = {run.stop} | {name for controller in run.boundaries.controllers for name in controller.on}
    for c, contact in enumerate(run.manager.contacts):
        notify[c] = int(contact.name in ends)
    instants = run.manager.instants
    ended = {e for name in ends if name is not None for e in instants.get(name, ())}
    for e, guard in enumerate(run.manager.guards):
        wanted = guard.terminal or guard.reset is not None or e in ended
        notify[run.kernel.n_contacts + e] = int(wanted)


def begin(run: RunData, start: State) -> None:
    """Put a start that is not the end of an earlier run into the kernel's arrays."""
    v = run.kernel
    v.q[: v.n_q] = start.q
    v.y[: v.n] = np.concatenate([start.v, start.z])
    if len(start.anchors) == v.n_anchors:  # else all contacts are open, and store theirs as they close
        v.anchors[: v.n_anchors] = start.anchors
    elif run.mechanism.equations.machines:
        v.anchors[: v.n_anchors] = first_anchors(run.mechanism, v.params)
        store_first(run.mechanism, start.time, start.q, v.y[: v.n], v.params, v.anchors[: v.n_anchors])
    n_contacts, n_guards = v.n_contacts, v.n_guards
    v.closed[:n_contacts] = run.manager.flags(start.mode.closed)
    armed: Iterable[str] = set(run.manager.names) - start.mode.closed if start.armed is None else start.armed
    v.armed[:n_contacts] = run.manager.flags(armed)
    jump = run.boundaries.ahead
    if jump is not None and jump.left <= start.time:  # the motion is that behind it
        run.boundaries.place += 1
        run.begins_behind_jump = True
    v.time = v.grid_start = jump.right if run.begins_behind_jump and jump is not None else start.time
    v.last_switch = -np.inf
    if _is_judged(run):
        v.restart_due, v.mode_id = 1, -1
        return
    require_consistent(run, start)
    v.restart_due, v.mode_id = 1, -1
    guards = guard_values(run)
    inside = _touch(run, start, guards)
    if inside:
        raise ModelError(inside)
    for e in range(n_guards):
        set_side(run, e, guards)


def _is_judged(run: RunData) -> bool:
    """Whether compiled code finds that the start holds its rows, and notes on which sides of all guards it lies.

    What it doubts, or knows nothing of, is judged here, in the same way and in words.
    """
    if not run.stepper.judges_starts or run.begins_behind_jump or run.mechanism.equations.facings:
        return False
    return run.stepper.judge_start() == 0


def require_consistent(run: RunData, start: State) -> None:
    """A start must satisfy the rows that are active in it, as far as the run that it is the end of left them.

    Raises
    ------
    ModelError
        with the rows that it violates, and how far.
    """
    v, mechanism = run.kernel, run.mechanism
    if not run.manager.active_rows(v.closed[: v.n_contacts]):
        return
    q, y, anchors = v.q[: v.n_q], v.y[: v.n], v.anchors[: v.n_anchors]
    usual, memory = None, memory_of_end(run, start)
    if memory is not None and len(memory.parameters) == len(v.params):
        usual = residuals(mechanism, start.time, q, y, memory.parameters, anchors)[:2]
    faults = violations_now(run, residuals_now(run), usual)
    faults += reversed_joints(mechanism, start.time, q, v.params, anchors)
    if faults:
        advice = (
            "mbd.project(model, state) gives the nearest state that does, mbd.assemble(model, …) one of named values"
        )
        if run.changed != start.parameters:
            advice += "; give it the parameters= of the run too"
        raise ModelError([f"the start does not satisfy its constraints: {'; '.join(faults)}. {advice}"])


def _touch(run: RunData, start: State, guards: Vector) -> list[str]:
    """Note which contacts touch at the start; complaints of those that are open inside their surface."""
    v, inside = run.kernel, []
    n_contacts = v.n_contacts
    if n_contacts == 0:
        return []
    rates = run.mechanism.acceleration_terms(start.time, start.q, v.y[: v.n], v.params, v.anchors[: v.n_anchors]).rate
    for c in range(n_contacts):
        close, slow = abs(guards[c]) <= 1e-8, abs(guards[n_contacts + c]) <= 1e-9
        ready = v.armed[c] == 1 and is_watched(v, c, guards)
        held = [row for row in run.manager.contacts[c].rows if run.mechanism.equations.rows[row].friction < 0]
        still = all(abs(rates[row]) <= 1e-9 for row in held)
        v.touched[c] = int(ready and v.kind[c] == 0 and close and slow and still)
        if ready and v.closed[c] == 0 and guards[c] < -MAX_START_DEPTH:
            contact = run.manager.contacts[c]
            inside.append(
                f"{contact.name!r} starts {-guards[c]:.6g} {contact.unit} inside its surface; assemble the start "
                "with it in closed=[…] or open=[…]"
            )
    return inside


def check_rank(run: RunData, start: State, parameters: Vector) -> None:
    """Values of parameters may take away what determines the motion."""
    v = run.kernel
    y, flags = np.concatenate([start.v, start.z]), v.closed[: v.n_contacts]
    posture = Posture(run.mechanism, run.manager, parameters, start.q, y, flags, v.anchors, time=start.time)
    faults = undetermined(posture)
    if faults:
        raise ModelError(faults)


def guard_values(run: RunData) -> Vector:
    """Gaps, their rates and users' guards at the accepted state, in the order of the kernel."""
    v = run.kernel
    out = np.zeros(max(v.n_watched, 1))
    if v.n_watched:
        q, y, anchors = v.q[: v.n_q], v.y[: v.n], v.anchors[: v.n_anchors]
        run.mechanism.common["guards"](run.mechanism.block(v.time, q, y, anchors), v.params, out)
    return out


def set_side(run: RunData, e: int, guards: Vector) -> None:
    """The sign from which a user's guard will cross next: that of its value, however near to zero, so that a start
    just before its surface fires it. At zero itself, and where the value is round-off, its rate decides; where that
    leads nowhere in a step, the first steps that do.
    """
    n_contacts, n_guards = run.kernel.n_contacts, run.kernel.n_guards
    value, rate = guards[4 * n_contacts + e], guards[4 * n_contacts + n_guards + e]
    doubt = run.stepper.guard_round_off(e)
    v, timed = run.kernel, int(run.kernel.guard_timed[e]) if run.manager.machines else 0
    late = timed % 4 == 3 and value > 0.0 and int(v.anchors[v.machine_start[v.guard_machine[e]]]) == v.guard_source[e]
    begins = timed % 2 == 1 and v.anchors[v.machine_start[v.guard_machine[e]] + 1] == v.time  # with this state
    if late or (abs(value) <= doubt and timed >= 4) or begins:
        value = -1.0  # a timer that is due, or was before a parameter or the time was changed
    elif abs(value) <= doubt:
        value = rate if abs(rate) * run.kernel.step > doubt else 0.0
    run.kernel.side[e] = float(np.sign(value))
