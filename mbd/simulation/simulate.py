"""The front of a run: arguments checked, then driven to its end."""

from __future__ import annotations

import math
import platform
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

from mbd.compile.mechanisms import mechanism_of
from mbd.errors import CapabilityError, ModelError, SimulationError, UnknownNameError, nearest
from mbd.integrators import HHT, Integrator
from mbd.kernel.active_set import ActiveSetManager
from mbd.simulation.run import Run
from mbd.state import State
from mbd.trajectory import Trajectory

__all__ = ["simulate"]

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
    contact: Literal["events"] = "events",
    impact: Literal["newton"] = "newton",
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
    contact, impact : strategy and law; this version knows located events with Newton's law
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
        if the run cannot go on.
    """
    scheme = integrator if integrator is not None else HHT(alpha=0.05)
    faults = _faults(scheme, start, dt, tol, until, contact, impact, locate, store, on_failure, rest_speed)
    if faults:
        raise ModelError(faults)
    assert dt is not None
    changed = {**start.parameters, **(parameters or {})}
    mechanism = mechanism_of(model, backend, changed)
    manager = ActiveSetManager(mechanism.equations)
    _fits(start, mechanism.equations, manager)
    end, stop = _end(until, manager, dt, start.time)
    rows = len(mechanism.equations.rows)
    refusal = scheme.check(rows)
    if refusal:
        raise CapabilityError(refusal)
    settings = {
        "model": getattr(model, "name", ""), "integrator": repr(scheme), "dt": float(dt), "until": until,
        "contact": contact, "impact": impact, "locate": locate, "store": store, "rest_speed": rest_speed,
        "backend": mechanism.backend.name, "versions": _versions(),
    }  # fmt: skip
    options = {"locate": locate, "store": store, "rest_speed": rest_speed}
    run = Run(model, mechanism, manager, scheme, start, float(dt), end, stop, changed, options, settings)
    run.observe(observers, _bar(progress, start.time, end))
    trajectory, problem = run.complete()
    if problem and on_failure == "raise":
        raise SimulationError(problem, trajectory) from run.cause
    return trajectory


def _faults(
    scheme: Any, start: Any, dt: Any, tol: Any, until: Any, contact: Any, impact: Any, locate: Any, store: Any,
    on_failure: Any, rest_speed: Any,
) -> list[str]:  # fmt: skip
    """Everything that is wrong with the arguments themselves."""
    faults = []
    if not isinstance(scheme, Integrator):
        faults.append(f"integrator must be an mbd integrator such as mbd.HHT(alpha=0.05), not {scheme!r}")
    if not isinstance(start, State):
        faults.append(f"start must be a State from mbd.assemble(model, …), not {start!r}")
    if tol is not None:
        faults.append("tol= is not available: steps are fixed; give dt and compare with dt/2, whose error is a quarter")
    if dt is None:
        faults.append("a step is needed: simulate(…, dt=1e-3)")
    elif not _number(dt) or not math.isfinite(dt) or dt <= 0.0:
        faults.append(f"dt must be a positive number of seconds, not {dt!r}; 1e-3 suits a walker")
    last = until[1] if isinstance(until, tuple) and len(until) == 2 else until
    if not isinstance(last, str):
        if not _number(last) or not math.isfinite(last):
            faults.append(f"until must be a finite time [s], an event's name, or (name, latest time), not {until!r}")
        elif isinstance(start, State) and last < start.time:
            faults.append(f"until = {last:g} s lies before the start at {start.time:g} s")
    for name, value, known in (
        ("contact", contact, ("events",)), ("impact", impact, ("newton",)), ("locate", locate, ("root", "linear")),
        ("on_failure", on_failure, ("raise", "return")),
    ):  # fmt: skip
        if value not in known:
            faults.append(f"{name}={value!r} is not available; use {' or '.join(map(repr, known))}")
    if not isinstance(store, int) or isinstance(store, bool) or store < 1:
        faults.append(f"store must be a whole number of steps ≥ 1, not {store!r}")
    if not _number(rest_speed) or not rest_speed >= 0.0:
        faults.append(f"rest_speed must be a speed ≥ 0, not {rest_speed!r}")
    return faults


def _number(value: Any) -> bool:
    return not isinstance(value, bool) and hasattr(value, "__float__")


def _fits(start: State, equations: Any, manager: ActiveSetManager) -> None:
    """The state must be one of this model."""
    names = tuple(coordinate.name for coordinate in equations.coordinates)
    if start.names != names or len(start.v) != equations.n_v or len(start.z) != equations.n_z:
        raise ModelError(
            f"the start has the coordinates {', '.join(start.names) or 'none'}, but the model has {', '.join(names)}; "
            "assemble it from this model"
        )
    unknown = [nearest(name, manager.names, "contact") for name in start.mode.closed if name not in manager.names]
    if unknown:
        raise UnknownNameError(unknown)


def _end(
    until: float | str | tuple[str, float], manager: ActiveSetManager, dt: float, begin: float
) -> tuple[float, str | None]:
    """Latest time, and the event that ends the run."""
    if isinstance(until, str):
        until = (until, begin + 1e6 * dt)
    if not isinstance(until, tuple):
        return float(until), None
    name, latest = until
    known = [*manager.names, *(guard.name for guard in manager.guards)]
    if name not in known:
        raise UnknownNameError("until: " + nearest(name, known, "contact or event"))
    return float(latest), name


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
