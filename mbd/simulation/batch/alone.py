"""Runs of a batch that Python makes: those whose start, end or energy asks for the judgement of `simulate`."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.assembly.given_state import MAX_ANGLE
from mbd.compile.mechanism import Mechanism
from mbd.compile.python import array_function
from mbd.dataclass import dataclass
from mbd.errors import MbdError
from mbd.kernel import codes
from mbd.results.trajectory import Trajectory
from mbd.simulation.diagnostics.energy import REPORTED_SHARE, UNDRIVEN, kinds_of
from mbd.simulation.interrupted import stopped
from mbd.simulation.many_runs import Ends
from mbd.simulation.simulate import simulate
from mbd.state import State

NAMES = {
    getattr(codes, name): name.lower().replace("_", " ")
    for name in (
        "NOT_FINITE", "NOT_CONVERGED", "SINGULAR", "STAGNATED", "CHATTER", "NO_IMPACT", "DEPENDENT", "CONFLICT",
        "NO_LOCATION", "ENERGY_GAIN", "NO_FORCE", "TOO_TIGHT", "TOO_NEAR", "TOO_SMALL", "SINGULAR_ROWS_MOVE",
        "OUTGROWN", "GAINED", "TOO_BRIEF", "AT_POSE", "LEAPT", "ILL_CONDITIONED", "JUMPED", "ENDLESS_TRANSITIONS",
        "UNSTABLE", "NO_DERIVATIVE",
    )
}  # fmt: skip
"""Outcomes of runs that failed, by the kernel's codes."""


@dataclass(frozen=True, eq=False)
class Alone:
    """A run that was made alone: its outcome, its end (None if its start is none), and its sentence."""

    outcome: str
    state: State | None
    stopped_by: str
    message: str
    run: Trajectory | None


def made_alone(model: Any, start: State, arguments: dict[str, Any], terminal: frozenset[str]) -> Alone:
    """One run by `simulate`; whatever goes wrong is its outcome, but that somebody interrupts it (KeyboardInterrupt).

    terminal : names of the events that end runs
    """
    try:
        run = simulate(model, start, progress=False, on_failure="return", **arguments)
    except MbdError as error:
        return Alone("refused", None, "", str(error), None)
    if stopped(run):
        raise KeyboardInterrupt
    if not run.success:
        waited = isinstance(arguments["until"], str) and run.message.startswith(
            f"{arguments['until']!r} did not happen"
        )
        return Alone("no event" if waited else "failed", run.final, "", run.message, run)
    if run.status != 1:
        return Alone("end", run.final, "", run.message, run)
    last = [e.name for e in run.events if e.kind in ("closed", "event") and e.name in terminal]
    return Alone("event", run.final, last[-1] if last else "", run.message, run)


def needs_judgement(
    mechanism: Mechanism, starts: dict[str, Matrix], ends: dict[str, Matrix], found: Ends, parameters: Vector | Matrix
) -> NDArray[np.bool_]:
    """Which runs `simulate` has to judge (N,): angles beyond all, joints the wrong way round, energy from nowhere.

    Of the energy the start and the end are compared, in mechanisms that nothing drives.
    """
    doubtful = found.status >= codes.DOUBTFUL_START
    whole = ~doubtful & (found.status <= codes.LAST)
    doubtful |= whole & ~(np.max(np.abs(ends["q"]), axis=1, initial=0.0) <= MAX_ANGLE)
    equations = mechanism.equations
    if equations.facings:
        with equations.tape.lock:
            cosines = array_function([facing.cosine for facing in equations.facings])
        for inputs in (starts, ends):
            doubtful |= np.min(cosines(inputs, parameters), axis=0) < 0.0
    if mechanism.layout.n_v and kinds_of(mechanism) <= UNDRIVEN:
        kinetic, potential = (np.stack(pair) for pair in zip(*[
            mechanism.energies(inputs, parameters) for inputs in (starts, ends)
        ], strict=True))  # fmt: skip
        rise = np.diff(kinetic + potential, axis=0)[0]
        owned = kinetic[0] + np.maximum(potential[0] - potential[1], 0.0)
        noise = 1e-9 * np.max(np.abs(kinetic) + np.abs(potential), axis=0)
        doubtful |= whole & ~(rise <= REPORTED_SHARE * owned + noise)
    return doubtful
