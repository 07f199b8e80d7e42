"""What lets a run go on as if it had never been cut: written into its final state, read by the run that goes on."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from operator import itemgetter

import numpy as np

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import makes_late
from mbd.kernel.records import TABLE
from mbd.results.record import EventRecord
from mbd.simulation.run.data import RunData
from mbd.simulation.run.remembered import damage, out_of_range, sealed
from mbd.state import Memory, State

OPTIONS = ("dt", "tol", "allowed", "longest", "contact", "impact", "locate", "rest_speed", "backend")
"""Settings that a memory depends on."""
_options = itemgetter(*OPTIONS)


class Unseen:
    """A memory as its run has left it, which has a digest and a seal from when somebody looks at it.

    Until then nobody can have changed it, so that a run of the same mechanism takes it up unexamined.
    """

    def __init__(self, memory: Memory, mechanism: Mechanism, now: float, acting: Sequence[int]) -> None:
        self.memory, self.mechanism, self.now, self.acting = memory, mechanism, now, acting

    def __call__(self) -> Memory:
        memory, (q, y) = self.memory, np.split(self.memory.place, [self.mechanism.layout.n_q])
        block = self.mechanism.block(self.now, q, y, memory.anchors, self.acting)
        vars(memory)["digest"] = _digest(self.mechanism, block, memory.parameters)
        return sealed(memory)


def memory_of(run: RunData, time: float) -> Unseen:
    """The memory of the accepted state, which must be settled; `time` is what its state says."""
    stepper = run.stepper
    run.count_turns()
    parameters, reals, integers = run.kernel.params.copy(), stepper.reals.copy(), stepper.integers.copy()
    place = _place(run)
    for array in (parameters, reals, integers, place):
        array.flags.writeable = False
    memory = Memory(
        belongs(run), "", time, parameters, reals, integers, stepper.plain.memory,
        run.boundaries.remembered(), tuple((event.kind, event.name) for event in run.pending), place,
        run.manager.mode(run.kernel.closed[: run.kernel.n_contacts]),
        run.kernel.anchors[: run.kernel.n_anchors].copy(),
    )  # fmt: skip
    return Unseen(memory, run.mechanism, run.now, run.manager.penalties(run.kernel.closed[: run.kernel.n_contacts]))


def _place(run: RunData) -> Vector:
    """(q, v, z) as the kernel has them."""
    v = run.kernel
    return np.concatenate([v.q[: v.n_q], v.y[: v.n]])


def belongs(run: RunData, contact: str = "") -> tuple[str, ...]:
    """Words that two runs must share for the memory of one to be of use to the other.

    contact : the strategy, by default the one that the run takes now
    """
    integrator, equations = run.stepper.integrator, run.mechanism.equations
    kind, settings = type(integrator), run.settings if not contact else {**run.settings, "contact": contact}
    asked = tuple(map(repr, _options(settings)))
    known = run.stepper.words  # the rest follows from the stepper
    if asked not in known:
        words = [f"{kind.__module__}.{kind.__qualname__}", repr(integrator), f"compiled {run.stepper.compiled}"]
        words += [*map(" ".join, zip(OPTIONS, asked, strict=True)), f"mbd {settings['versions']['mbd']}"]
        words += [f"{name} {len(getattr(run.kernel, name))}" for name in (*TABLE.kept_reals, *TABLE.kept_integers)]
        words += [row.title for row in equations.rows] + run.manager.names
        known[asked] = (*words, *(guard.name for guard in run.manager.guards))
    return (*known[asked], *_controllers(run))


def _controllers(run: RunData) -> tuple[str, ...]:
    """The words of controllers, the last ones of `belongs`."""
    return tuple(f"{c.name} {c.period!r} {c.on!r}" for c in run.boundaries.controllers)


def _block(run: RunData) -> Vector:
    """The inputs of the equations at the accepted state."""
    v = run.kernel
    acting = run.manager.penalties(v.closed[: v.n_contacts])
    return run.mechanism.block(run.now, v.q[: v.n_q], v.y[: v.n], v.anchors[: v.n_anchors], acting)


def _digest(mechanism: Mechanism, block: Vector, parameters: Vector) -> str:
    """Of masses, forces, rows and guards at a state: a model that was changed there has another one."""
    digest = hashlib.sha256()
    for program in (mechanism.accelerations, mechanism.common["guards"]):
        out = np.zeros(max(program.size, 1))
        if program.size:
            program(block, parameters, out)
        digest.update(out.tobytes())
    return digest.hexdigest()


def take_up(run: RunData, start: State) -> bool:
    """Go on from the memory of a state, if it is one of this run; whether it was."""
    unseen = makes_late(start, "memory")
    known = unseen is not None and unseen.mechanism is run.mechanism
    memory = unseen.memory if known else start.memory
    if memory is None:
        return False
    run.damage = "" if known else damage(memory)
    if run.damage or len(memory.parameters) != len(run.kernel.params):
        return False  # other values of parameters may make other run-time inputs, which is no damage
    unlocated = bool(run.kernel.auto) and memory.belongs == belongs(run, "nonsmooth")
    if memory.belongs != belongs(run) and not unlocated:
        return False
    run.damage = "" if known else out_of_range(run, memory)
    if run.damage:
        return False
    stepper, v = run.stepper, run.kernel
    fresh = stepper.reals.copy(), stepper.integers.copy()
    stepper.reals[:], stepper.integers[:] = memory.reals, memory.integers
    taken = not unlocated or run.kernel.fallback > 0  # it came to them by itself
    same = taken and _is_of(run, memory, start)
    if not (same and (known or memory.digest == _digest(run.mechanism, _block(run), run.kernel.params))):
        stepper.reals[:], stepper.integers[:] = fresh
        return False
    stepper.plain.memory = memory.scheme
    run.boundaries.take_up(memory.controllers, run.now)
    run.pending = tuple(EventRecord(run.now, kind, name) for kind, name in memory.pending)
    v.n_stored = v.n_logged = 0
    v.mode_id, v.order_start = -1, 0
    _store_first_row(run, start.time)
    return True


def _store_first_row(run: RunData, time: float) -> None:
    """The state that was taken up as a row, between which and the next the grid of rows goes on."""
    stepper, v = run.stepper, run.kernel
    phase = int(v.steps_since_row)
    stepper.hold()
    stepper.store_row()
    v.store[0] = time
    v.steps_since_row = phase
    stepper.resumed_at = run.now


def carry_on(run: RunData, start: State) -> bool:
    """Let controllers go on with their samples and states, where a scheme has restarted at a state; whether they do.

    What they keep belongs to the mechanism, not to how it is integrated: another dt, or the trial runs of a tolerance,
    must not make another motion.
    """
    own = _controllers(run)
    memory = start.memory if own else None
    if memory is None or run.damage or memory.belongs[-len(own) :] != own:
        return False
    if set(memory.controllers["samples"]) != set(run.boundaries.samples):
        return False
    if memory.time != start.time or not np.array_equal(memory.place, _place(run)):
        return False
    run.boundaries.take_up(memory.controllers, run.now)
    return True


def memory_of_end(run: RunData, start: State) -> Memory | None:
    """The memory of a state, which is in the kernel's arrays, if it is the end of an earlier run as that left it."""
    memory = start.memory
    if memory is None or damage(memory) or memory.time != start.time or memory.mode != start.mode:
        return None
    same = np.array_equal(memory.place, _place(run)) and np.array_equal(memory.anchors, start.anchors)
    return memory if same else None


def without_memory(state: State) -> State:
    """The same state, from which a scheme starts afresh; that a run has ended in it is still known."""
    return state if state.memory is None else replace(state, memory=sealed(replace(state.memory, belongs=())))


def _is_of(run: RunData, memory: Memory, start: State) -> bool:
    """Whether a state and the parameters are those of a memory, to the bit; the memory is in the kernel's arrays."""
    v, manager = run.kernel, run.manager
    n_contacts, n_anchors = v.n_contacts, v.n_anchors
    pairs = (
        (v.q[: v.n_q], start.q),
        (v.y[: v.n], np.concatenate([start.v, start.z])),
        (v.closed[:n_contacts], manager.flags(start.mode.closed)),
        (v.armed[:n_contacts] == 1, manager.flags(start.armed or ()) == 1),
        (v.anchors[:n_anchors], start.anchors if n_anchors else v.anchors[:n_anchors]),
        (v.params, memory.parameters),
    )
    return memory.time == start.time and all(np.array_equal(one, other) for one, other in pairs)
