"""What may be given to a run: every fault of the arguments, said before the first step."""

import math
import sys
from collections.abc import Mapping, Sequence
from numbers import Integral
from typing import Any

from mbd.bodies.promises import promise_faults
from mbd.bodies.values import among, is_number, named_number_faults, shown
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.integrators import Integrator
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.state import State, malformed
from mbd.topology.description import Description

MAX_STEP_RATIO = 1e6
"""Step over the latest time above which a run is refused: ends and events are told apart to 1e-12 dt [-]."""

MAX_WAIT = 1_000_000
"""Steps in which an event must happen that ends a run without a latest time [-]."""

MAX_ERROR = 1e30
"""Error of coordinates above which nobody can mean to ask for it; products with it must stay finite [m, rad]."""

CHOICES = {
    "contact": ("auto", "events", "nonsmooth"), "impact": ("newton", "poisson", "sequential"),
    "locate": ("root", "linear"), "on_failure": ("raise", "return"),
}  # fmt: skip


def check_arguments(
    scheme: Any, start: Any, dt: Any, tol: Any, tol_of: Any, until: Any, parameters: Any, options: Mapping[str, Any],
    on_failure: Any, observers: Any, progress: Any,
) -> None:  # fmt: skip
    """Every argument of `simulate` besides the model; all that is wrong is one `ModelError`."""
    words = {**options, "on_failure": on_failure}
    faults = [
        f"{name}={words[name]!r} is not available; use {' or '.join(map(repr, known))}"
        for name, known in CHOICES.items()
        if not among(words[name], known)
    ]
    faults += _numbers(scheme, start, dt, tol, until, options["store"], options["rest_speed"])
    if tol_of is not None and tol is None:
        faults.append(f"tol_of={tol_of!r} says what tol holds for; give tol too, or leave it out")
    faults += _callbacks(observers, progress) + named_number_faults(parameters, "parameters")
    if isinstance(start, State) and isinstance(start.parameters, Mapping):
        faults += named_number_faults(start.parameters, "parameters of the start")
    if faults:
        raise ModelError(faults)


def _numbers(scheme: Any, start: Any, dt: Any, tol: Any, until: Any, store: Any, rest_speed: Any) -> list[str]:
    """What is wrong with the integrator, the start, the step and the end."""
    faults = []
    if not isinstance(scheme, Integrator):
        hint = f"; call it: mbd.{scheme.__name__}()" if isinstance(scheme, type) else ""
        faults.append(f"integrator must be an mbd integrator such as mbd.HHT(alpha=0.05), not {scheme!r}{hint}")
    else:
        faults += promise_faults(scheme)
    if not isinstance(start, State):
        hint = "; the model comes first, then the start" if isinstance(start, Description) else ""
        faults.append(f"start must be a State from mbd.assemble(model, …), not {start!r}{hint}")
    else:
        faults += malformed(start)
    if tol is not None and dt is not None:
        faults.append(
            f"give dt={shown(dt)} for fixed steps or tol={shown(tol)} for steps that follow their error, not both"
        )
    elif tol is not None and (not is_number(tol) or not sys.float_info.min <= tol <= MAX_ERROR):
        faults.append(f"tol must be a positive error of coordinates [m, rad], not {shown(tol)}; 1e-6 is common")
    elif tol is not None and store != 1:
        faults.append(f"tol= compares runs at all their steps; use store=1, not {shown(store)}")
    elif tol is None and dt is None:
        faults.append("a step or a tolerance is needed: simulate(…, dt=1e-3) or simulate(…, tol=1e-6)")
    elif tol is None and (not is_number(dt) or not math.isfinite(dt) or dt <= 0.0):
        faults.append(f"dt must be a positive number of seconds, not {shown(dt)}; 1e-3 suits a walker")
    faults += _times(start, dt, until)
    if not isinstance(store, Integral) or isinstance(store, bool) or not 1 <= int(store) <= (1 << 53):
        faults.append(f"store must be a whole number of steps ≥ 1, not {shown(store)}")
    if not is_number(rest_speed) or not rest_speed >= 0.0:
        faults.append(f"rest_speed must be a speed ≥ 0, not {shown(rest_speed)}")
    return faults


def _times(start: Any, dt: Any, until: Any) -> list[str]:
    """What is wrong with the end of the run, and a step that the clock cannot tell."""
    begin = start.time if isinstance(start, State) else 0.0
    if not is_number(begin) or not math.isfinite(begin):
        return [f"the time of the start must be finite, not {shown(begin)}"]
    pair = isinstance(until, tuple) and len(until) == 2 and isinstance(until[0], str)
    last = until[1] if pair else until
    if isinstance(until, str):
        last = begin
    if not is_number(last) or not math.isfinite(last):
        return [f"until must be a finite time [s], an event's name, or (name, latest time), not {shown(until)}"]
    last, begin = float(last), float(begin)
    if last < begin:
        return [f"until = {last:g} s lies before the start at {begin:g} s"]
    if is_number(dt) and 0.0 < dt < 8.0 * math.ulp(max(abs(begin), abs(last))):
        return [f"dt = {dt:g} s is too small to be told apart at t = {last:g} s; use a larger dt or an earlier end"]
    if is_number(dt) and math.isfinite(dt) and last > begin and dt > MAX_STEP_RATIO * max(abs(begin), abs(last)):
        return [f"dt = {dt:g} s is more than {MAX_STEP_RATIO:g} times the end at t = {last:g} s, and too large for "
                "round-off to tell one from the other; use a smaller dt"]  # fmt: skip
    return []


def _callbacks(observers: Any, progress: Any) -> list[str]:
    """Observers and progress that cannot be called."""
    several = isinstance(observers, Sequence) and not isinstance(observers, str)
    if not several or not all(map(callable, observers)):
        return [f"observers must be a list of functions observer(time, state), not {observers!r}"]
    if not callable(progress) and not isinstance(progress, bool | None):
        return [f"progress must be True, None or a function progress(t, until), not {progress!r}"]
    return []


def end_of(until: Any, manager: ActiveSetManager, dt: float, begin: float) -> tuple[float, str | None]:
    """Latest time, and the event that ends the run."""
    if isinstance(until, str):
        until = (until, begin + MAX_WAIT * dt)
    if not isinstance(until, tuple):
        return float(until), None
    name, latest = until
    known = [*manager.names, *manager.instants]
    if name not in known:
        hint = f"; a time is a number, until={name}" if name.replace(".", "", 1).isdigit() else ""
        raise UnknownNameError("until: " + nearest(name, known, "contact or event") + hint)
    return float(latest), name
