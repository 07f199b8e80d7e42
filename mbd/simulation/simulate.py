"""The front of a run: arguments checked, then driven to its end."""

from __future__ import annotations

import platform
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from typing import Any, Literal

from mbd.assembly import named_numbers
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.errors import CapabilityError, ModelError, SimulationError
from mbd.integrators import HHT, Integrator
from mbd.kernel.active_set import ActiveSetManager
from mbd.simulation.arguments import callbacks, choices, end_of, fits, numbers
from mbd.simulation.capabilities import refusals
from mbd.simulation.run import Run
from mbd.simulation.strategy import chosen
from mbd.state import State
from mbd.trajectory import Trajectory

__all__ = ["prepared", "simulate"]

REST_SPEED = 1e-6
"""Approach speed [m/s, rad/s] below which a contact closes without rebound and releases nobody: ends Zeno sequences."""


def simulate(
    model: Any,
    start: State,
    integrator: Integrator | None = None,
    dt: float | None = None,
    tol: None = None,
    *,
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
    backend: str = "auto",
) -> Trajectory:
    """Integrate a model from a state.

    Steps of dt follow each other until a guard fires; its instant is located, an impact law applied where contacts
    close, and the scheme restarted consistently from there with full steps again.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    start : from `mbd.assemble`, or `Trajectory.final` of an earlier run
    integrator : default ``HHT(alpha=0.05)``
    dt : step [s]
    tol : error control is not available yet; steps are fixed
    until : end time [s]; or the name of a contact or event, at whose first closing or crossing the run ends;
        or (name, latest time)
    contact : 'events' locates the instants at which contacts close, open, stick and slip, which keeps the order of the
        scheme; 'nonsmooth' takes fixed steps and corrects positions and velocities at their ends, of first order at
        impacts but of bounded work whatever happens; 'auto' takes 'events' up to 16 contacts, and says why in
        ``run.settings["contact_reason"]``
    impact : law of restitution over all contacts of an instant: 'newton' on gap rates, 'poisson' on impulses,
        'sequential' one contact after the other; where it would create energy, Stronge's law takes its place
    locate : 'root' finds event instants to round-off; 'linear' by one linear interpolation back, second order
    parameters : values that differ from the model's, by name
    store : keep every store-th step; rows at events and the last row are always kept
    observers : called as ``observer(time, state)`` at intervals of about 0.1 s of wall time and at the end
    progress : True for a progress bar on a terminal, or ``progress(t, until)``
    on_failure : 'raise' a `SimulationError` whose ``run`` has everything computed, or 'return' it with success False
    rest_speed : approach speed below which a contact rests [m/s, rad/s]
    backend : 'auto', 'llvm' or 'python' (the plain twin, slow)

    Returns
    -------
    Trajectory

    Raises
    ------
    ModelError, UnknownNameError, CapabilityError
        for arguments that cannot be honoured, all before the first step.
    SimulationError
        if the run cannot go on, or if the scheme itself has more than doubled the energy of the mechanism.
    """
    scheme = integrator if integrator is not None else HHT(alpha=0.05)
    words = {"contact": contact, "impact": impact, "locate": locate, "on_failure": on_failure}
    faults = choices(words) + numbers(scheme, start, dt, tol, until, store, rest_speed)
    faults += callbacks(observers, progress) + named_numbers(parameters, "parameters")
    if faults:
        raise ModelError(faults)
    assert dt is not None
    changed = {**start.parameters, **(parameters or {})}
    options = {
        "contact": contact, "impact": impact, "locate": locate, "store": store, "rest_speed": rest_speed,
        "backend": backend,
    }  # fmt: skip
    run = prepared(model, start, scheme, float(dt), until, changed, options)
    end = run.end
    run.observe(observers, _bar(progress, start.time, end))
    trajectory, problem = run.complete()
    if problem and on_failure == "raise":
        raise SimulationError(problem, trajectory) from run.cause
    return trajectory


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
    mechanism = mechanism_of(model, options["backend"], changed)
    manager = ActiveSetManager(mechanism.equations)
    fits(start, mechanism.equations, manager)
    end, stop = end_of(until, manager, dt, start.time)
    strategy, reason = chosen(options["contact"], manager, options["locate"])
    options = {**options, "contact": strategy}
    refused = refusals(mechanism.equations, scheme, options)
    if refused:
        raise CapabilityError(refused)
    settings = {
        "model": getattr(model, "name", ""), "integrator": repr(scheme), "dt": dt, "until": until, **options,
        "contact_reason": reason, "backend": mechanism.backend.name, "versions": dict(_versions()),
    }  # fmt: skip
    own = {name: options[name] for name in ("contact", "impact", "locate", "store", "rest_speed")}
    return Run(
        model, mechanism if watch is None else watch(mechanism), manager, scheme, start, dt, end, stop, changed, own,
        settings,
    )  # fmt: skip


@cache
def _versions() -> dict[str, str]:
    from importlib.metadata import PackageNotFoundError, version

    found = {"python": platform.python_version()}
    for package in ("mbd", "numpy", "llvmlite"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def _bar(progress: Any, begin: float, end: float) -> Callable[[float, float], None] | None:
    """A progress callback; True makes a bar that shows only on a terminal."""
    if progress is None or progress is False:
        return None
    if callable(progress):
        return progress  # type: ignore[no-any-return]
    if find_spec("tqdm") is None:
        return None
    from tqdm import tqdm

    bar = tqdm(
        total=end - begin,
        unit="s",
        disable=None,
        bar_format="{l_bar}{bar}| {n:.2f}/{total:.2f} s [{elapsed}<{remaining}]",
    )

    def show(t: float, until: float) -> None:
        bar.update(t - begin - bar.n)
        if t >= until:
            bar.close()

    return show
