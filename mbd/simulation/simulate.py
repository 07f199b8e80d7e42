"""The front of a run: arguments checked, then driven to its end."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Literal

import numpy as np

from mbd.assembly.given_state import belongs
from mbd.assembly.machines import begun_in, require_past, stored_anew
from mbd.assembly.manager import manager_of
from mbd.assembly.turns import directed
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError, MemoryLimitError, ModelError, SimulationError, UnknownNameError
from mbd.integrators import HHT, Integrator
from mbd.integrators.extension import extension_of
from mbd.later import later
from mbd.notes import called_from_outside, doubt, is_heard, note
from mbd.progress import run_bar
from mbd.results.driving import driving_rows
from mbd.results.trajectory import Trajectory
from mbd.simulation.arguments import check_arguments, end_of
from mbd.simulation.capabilities import refusals
from mbd.simulation.marching import Run
from mbd.simulation.run.control import reset_faults
from mbd.simulation.run.data import RunData
from mbd.simulation.run.idle import keep_idle
from mbd.simulation.run.strategy import chosen
from mbd.state import State, of_model

FIRST_STEP_SHARE = 0.1
"""Longest step that follows its error in a first run, over the length of the run [-]."""
MIN_STEP_LIMIT_RATIO = 0.01
"""Least by which that shrinks where less error is allowed: it bounds the steps of a motion that needs none [-]."""
BRIEF_TIME_SHARE = 1e-3
"""A short time where steps follow their error, over the length of the run or 1 s: for differences, and as `dt` [-]."""
REST_SPEED = 1e-6
"""Approach speed [m/s, rad/s] below which a contact closes without rebound and releases nobody: ends Zeno sequences."""


def simulate(
    model: Any,
    start: State,
    integrator: Integrator | None = None,
    dt: float | None = None,
    tol: float | None = None,
    *,
    tol_of: Sequence[str] | None = None,
    until: float | str | tuple[str, float],
    contact: Literal["auto", "events", "nonsmooth"] = "auto",
    impact: Literal["newton", "poisson", "sequential"] = "newton",
    locate: Literal["root", "linear"] = "root",
    parameters: Mapping[str, float] | None = None,
    store: int = 1,
    observers: Sequence[Callable[[float, State], None]] = (),
    progress: Callable[[float, float], None] | bool | None = None,
    on_failure: Literal["raise", "return"] = "raise",
    rest_speed: float = REST_SPEED,
    wrt: Sequence[str | Mapping[str, Mapping[str, float]]] | None = None,
    controllers: Literal["held"] | None = None,
    backend: str = "auto",
) -> Trajectory:
    """Integrate a model from a state.

    Steps of dt follow each other until a guard fires; its instant is located, an impact law applied where contacts
    close, and the scheme restarted consistently from there with full steps again. With `tol` steps follow their own
    error instead, and trial runs tell the error of the whole run, of which one that agrees with `tol` is returned.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    start : from `mbd.assemble`, or `Trajectory.final` of an earlier run
    integrator : default ``HHT(alpha=0.05)``
    dt : step [s]
    tol : in place of dt: the largest error of any coordinate [m, rad] over the whole run; where drives prescribe
        motion, also of their forces and torques, over the largest in the run. It is estimated from two to five runs at
        different tolerances (nine while each comes nearer), see ``run.stats["tolerance"]``; what controllers and
        observers do besides answering happens in each of them. A tolerance that cannot be reached is a
        `SimulationError`
    tol_of : names of the results that `tol` holds for, each in its own unit, at rows and between them: forces,
        reactions, multipliers, rates or energies too, or coordinates without one that does not matter, such as the
        angle of a fast spin; by default every coordinate
    until : end time [s]; or (name, latest time), name that of a contact or event, at whose first closing or crossing
        the run ends if it happens before; or the name alone: a run in which it does not happen in 10⁶ steps has failed
    contact : 'events' locates the instants at which contacts close, open, stick and slip, which keeps the order of the
        scheme; 'nonsmooth' takes fixed steps and corrects positions and velocities at their ends, of first order at
        impacts but of bounded work whatever happens; 'auto' takes 'events', and non-smooth steps from where
        located instants crowd or cannot be located; ``run.settings["contact_reason"]`` says why, and a note when
    impact : law of restitution over all contacts of an instant: 'newton' on gap rates, 'poisson' on impulses,
        'sequential' one contact after the other; where it would create energy, Stronge's law takes its place
    locate : 'root' finds event instants to round-off; 'linear' by one linear interpolation back, second order
    parameters : values that differ from the model's, by name
    store : keep every store-th step; rows at events and the last row are always kept; 1 with `tol`
    observers : called as ``observer(time, state)`` at intervals of about 0.1 s of wall time and at the end
    progress : True for a progress bar on a terminal, False for none, or ``progress(t, until)``; None: a bar where plain
        Python takes more than some seconds
    on_failure : 'raise' a `SimulationError` whose ``run`` has everything computed, or 'return' it with success False
    rest_speed : approach speed below which a contact rests [m/s, rad/s]
    wrt : what the final state and its instant are differentiated by, into `run.sensitivities`: coordinates and rates of
        the start, parameters, rates of several parameters by one quantity; see `mbd.sensitivities`, which takes
        functions of parameters and other results too. Contacts are then treated by 'events'
    controllers : with `wrt`: 'held' differentiates with what controllers wrote held as it was, without their feedback;
        by default their models have no derivatives. They act in the run whatever this is
    backend : 'auto', 'llvm' or 'python' (all of it interpreted, slow)

    Returns
    -------
    Trajectory

    Raises
    ------
    ModelError, UnknownNameError, CapabilityError
        for arguments that cannot be honoured, all before the first step. Where a run has no derivatives by `wrt`, it is
        in ``error.run`` of the `CapabilityError`.
    SimulationError
        if the run cannot go on, or if the scheme itself has more than doubled the energy of the mechanism; a
        `MemoryLimitError` if its rows fill a quarter of the memory that was free as it grew long.
    """
    scheme = HHT(alpha=0.05) if integrator is None else integrator
    options = {
        "contact": contact, "impact": impact, "locate": locate, "store": store, "rest_speed": rest_speed,
        "backend": backend,
    }  # fmt: skip
    check_arguments(scheme, start, dt, tol, tol_of, until, parameters, options, on_failure, observers, progress)
    changed = {**start.parameters, **(parameters or {})}
    by_user = called_from_outside()
    asked: Any = None
    if wrt is not None:
        asked = later("simulate: derivatives")(wrt, controllers)
        model, start = asked.differentiable(model, start, changed, options)
    elif controllers is not None:
        raise ModelError("controllers= is for derivatives by wrt=; controllers act in every run; leave it out")
    motion = _Motion(
        model, start, scheme, until, changed, options, observers, "late" if by_user and progress is None else progress,
        Run if asked is None else asked.begun,
    )  # fmt: skip
    run, trajectory, problem = motion.run(dt) if dt is not None else motion.to_tolerance(float(tol or 0.0), tol_of)
    of_model(trajectory.final, model)
    if by_user:
        _tell(trajectory, run.doubts)
    if problem and on_failure == "raise":
        raise _failure(problem, trajectory, run.cause)
    if asked is not None and not problem:
        asked.conclude(trajectory, run, model, scheme)
    if dt is not None and not problem:
        keep_idle(run.stepper)
    return trajectory


def _tell(trajectory: Trajectory, doubts: Sequence[str]) -> None:
    """Doubts about a result as warnings; other notes of the run to the logger, where somebody listens."""
    if trajectory.success:
        doubt(*doubts)
    for sentence in trajectory.stats["notes"] if is_heard() else ():
        if not (trajectory.success and sentence in doubts):
            note(f"{trajectory.name or 'model'}: {sentence}")


@dataclass(frozen=True)
class _Motion:
    """What `simulate` was asked for, but for the size of steps."""

    model: Any
    start: State
    scheme: Integrator
    until: Any
    changed: Mapping[str, float]
    options: Mapping[str, Any]
    observers: Sequence[Callable[[float, State], None]]
    progress: Any
    kind: Callable[..., Run] = Run

    def run(
        self, step: float, more: Mapping[str, Any] | None = None, most: float = np.inf
    ) -> tuple[Run, Trajectory, str]:
        """A run with steps of one size, or from one on, that ends where it has taken `most` seconds."""
        options = {**self.options, **(more or {})}
        run = laid_out(
            self.model, self.start, self.scheme, float(step), self.until, self.changed, options, kind=self.kind
        )
        require_past(self.model, run.mechanism, self.start)
        run = run.at_start()
        run.room.patience = most
        with run_bar(self.progress, run.mechanism.backend.name == "python", self.start.time, run.end) as bar:
            run.observe(self.observers, bar)
            return run, *run.complete()

    def to_tolerance(self, tol: float, tol_of: Sequence[str] | None) -> tuple[RunData, Trajectory, str]:
        """The run whose error agrees with a tolerance; where an event ends it, the first guess is that it takes 1 s."""
        from mbd.simulation.tolerance.calibrate import calibrated, first_allowed
        from mbd.simulation.tolerance.judged import judged
        from mbd.simulation.tolerance.search import MAX_STEP_SHARE
        from mbd.simulation.tolerance.trials import Trial

        equations = mechanism_of(self.model, self.options["backend"], self.changed).equations
        names, scheme, driven = judged(equations, tol_of), self.scheme, bool(driving_rows(equations))
        length = 1.0 if isinstance(self.until, str | tuple) else (float(self.until) - self.start.time) or 1.0
        finer = scheme.order() / scheme.error_order()  # power of the allowed error with which that of the run falls
        first, power = first_allowed(tol, length, finer), 1.0 / scheme.error_order()
        longest = FIRST_STEP_SHARE * length

        def trial(allowed: float, most: float = np.inf) -> Trial:
            # shrinks and grows as steps do, so that runs of a motion so easy that its steps are the longest have others
            share = min(max((allowed / first) ** power, MIN_STEP_LIMIT_RATIO), MAX_STEP_SHARE / FIRST_STEP_SHARE)
            more = {"tol": tol, "tol_of": names, "driven": driven, "allowed": allowed, "longest": longest * share}
            run, trajectory, problem = self.run(BRIEF_TIME_SHARE * min(length, 1.0), more, most)
            if self.kind is Run and not problem:
                keep_idle(run.stepper)
            return Trial(allowed, trajectory, problem, run, run.room, widest=share == MAX_STEP_SHARE / FIRST_STEP_SHARE)

        found = calibrated(trial, tol, first, finer, scheme.order(), names)
        trajectory = found.trial.run
        if found.problem and trajectory.success:  # no run failed, but none is good enough
            trajectory = Trajectory(replace(trajectory.record, success=False, message=found.problem))
        elif found.doubt and trajectory.success:
            trajectory.stats["notes"].append(found.doubt)
            found.trial.source.doubts.append(found.doubt)
            trajectory = Trajectory(replace(trajectory.record, message=f"{trajectory.message}; {found.doubt}"))
        return found.trial.source, trajectory, found.problem


def _failure(problem: str, trajectory: Trajectory, cause: BaseException | None) -> SimulationError:
    """The error that a run ends with; how memory ran out is in its sentence."""
    full = isinstance(cause, MemoryLimitError)
    error = (MemoryLimitError if full else SimulationError)(problem, trajectory)
    error.__cause__ = None if full else cause
    return error


def prepared(
    model: Any,
    start: State,
    scheme: Integrator,
    dt: float,
    until: Any,
    changed: Mapping[str, float],
    options: Mapping[str, Any],
    watch: Callable[[Mechanism], Any] | None = None,
) -> Run:
    """A run ready to be completed; `watch` may put something in the place of the mechanism."""
    return laid_out(model, start, scheme, dt, until, changed, options, watch).at_start()


def laid_out(
    model: Any,
    start: State,
    scheme: Integrator,
    dt: float,
    until: Any,
    changed: Mapping[str, float],
    options: Mapping[str, Any],
    watch: Callable[[Mechanism], Any] | None = None,
    kind: Callable[..., Run] = Run,
) -> Run:
    """The same before its start is put into the kernel's arrays."""
    mechanism = mechanism_of(model, options["backend"], changed)
    values = mechanism.parameters_of(model, changed)
    manager = manager_of(mechanism, values)
    belongs(start, mechanism.equations, manager)
    start = directed(mechanism, start)
    if changed != start.parameters or start.begins or len(start.anchors) != mechanism.layout.n_anchors:
        start, begun = begun_in(model, mechanism, start)
        start = stored_anew(mechanism, start, values, begun)
    end, stop = end_of(until, manager, dt, start.time)
    tol = options.get("tol")
    strategy, reason = chosen(options["contact"], manager, options["locate"], tol is not None)
    auto = options["contact"] == "auto" and bool(reason) and tol is None
    options = {**options, "contact": strategy}
    auto = auto and not refusals(mechanism.equations, scheme, {**options, "contact": "nonsmooth"})
    refused = refusals(mechanism.equations, scheme, options)
    if refused:
        raise CapabilityError(refused)
    strange = reset_faults(mechanism.equations)
    if strange:
        raise UnknownNameError(strange)
    adaptive = {name: options.get(name) for name in ("tol", "allowed", "longest", "driven")}
    settings = {
        "model": getattr(model, "name", ""), "integrator": repr(scheme), "dt": dt if tol is None else None,
        "until": until, **options, **adaptive, "tol_of": list(options.get("tol_of", ())),
        "contact_reason": reason, "between": extension_of(scheme.between).name, "backend": mechanism.backend.name,
        "versions": dict(_versions()),
    }  # fmt: skip
    own = {name: options[name] for name in ("contact", "impact", "locate", "store", "rest_speed")}
    own["auto"] = auto
    own |= {name: value for name, value in adaptive.items() if value is not None}
    watched = mechanism if watch is None else watch(mechanism)
    return kind(model, watched, manager, scheme, start, dt, end, stop, changed, own, settings)


@cache
def _versions() -> dict[str, str]:
    """What computes: told by the packages themselves, as asking for their metadata takes 50 ms."""
    import mbd

    found = {"python": sys.version.split()[0], "mbd": mbd.__version__, "numpy": np.__version__}
    llvmlite = import_module("llvmlite") if find_spec("llvmlite") else None
    return {**found, "llvmlite": getattr(llvmlite, "__version__", "not installed")}
