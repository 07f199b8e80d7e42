"""Find a gait that repeats itself."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from mbd.compile.mechanism import Mechanism
from mbd.equal import HALF_PRECISION_RTOL
from mbd.errors import GaitError, ModelError
from mbd.gait.alike import require_alike
from mbd.gait.arguments import Functions, check_arguments, increments_named, section_named
from mbd.gait.cycle import LimitCycle
from mbd.gait.family import UNIT_MULTIPLIER_ATOL, Member, energy_of, member_of
from mbd.gait.floquet import Multipliers
from mbd.gait.heading import heading_of
from mbd.gait.machines import counted_from
from mbd.gait.mirror import mirror_of
from mbd.gait.return_map import ReturnMap
from mbd.gait.search import Failed, Search, fallen_first, first_found, first_return
from mbd.gait.section import Chart, section_of
from mbd.gait.unmoved import depends_on_time, moving_on, reset_names
from mbd.integrators import Integrator, RungeKutta853
from mbd.notes import doubt
from mbd.simulation.capabilities import refusals
from mbd.state import State

FIRST_STEP = 1e-2
"""Step of the first return where none is given [s]; later ones follow from its length."""


def limit_cycle(
    model: Any,
    start: State,
    integrator: Integrator | None = None,
    *,
    section: str,
    mirror: tuple[str, str] | None = None,
    strides: int = 1,
    dt: float | None = None,
    tol: float = 1e-10,
    parameters: Mapping[str, float] | None = None,
    functions: Functions | None = None,
    wrt: Iterable[str] = (),
    energy: float | None = None,
    speed: float | None = None,
    modulo: Iterable[str] | None = None,
    longest: float = 30.0,
    on_failure: Literal["raise", "return"] = "raise",
    backend: str = "auto",
) -> LimitCycle:
    """The gait near a start: a state just after an event that the walk comes back to.

    The return map P leads from just after one event of the section to just after the next, sides exchanged with
    `mirror`. Its unknowns are coordinates of the tangent space of all that holds there (see `mbd.gait.section`), but
    for the coordinates that the walker moves on along. Newton's method solves ``P(c) = c``; where no part of its step
    helps, the walker walks on for some steps and it begins again. The eigenvalues of P's derivative are the Floquet
    multipliers of the gait, which neither the section nor the coordinates change.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    start : near the gait, at whatever time. One that is not just after the event is simulated to it first
    integrator : default ``RungeKutta853()``; its steps are of equal size, so that the map is smooth
    section : name of the contact or event at which a return ends, and just after which the next begins
    mirror : two words in names whose exchange makes the next step the same as the one before, ``("left", "right")``,
        for a walker of equal sides: the gait then is one step. None: a return takes as many steps as lead to the same
        event again
    strides : returns after which the walk repeats itself: 2 for a gait whose period has doubled
    dt : step [s]; None: halved until state and period after a return change by less than a tenth of `tol`
    tol : largest difference of the coordinates of the section after one application of the map [m, rad, m/s, rad/s]
    parameters : values that differ from the model's, and those of `functions`
    functions : ``{"slope": lambda s: {"gravity.x": 9.81 * sin(s), "gravity.y": -9.81 * cos(s)}}``: functions of one
        value that give parameters, under names of their own
    wrt : parameters, or functions of them, by which derivatives are found at once; others when they are asked for
    energy, speed : T + V just after the event [J], or the mean speed [m/s], that the gait is to have. For walkers that
        nothing takes energy from or gives it to, whose gaits form a family; one of the two. Without them the gait is
        the one near the start
    modulo : coordinates that need not come back; None: those that nothing but places of touchdown depends on, and on
        level ground the heading of a walker in space
    longest : duration of one return at most [s]
    on_failure : 'raise' a `GaitError` where there is no gait, or 'return' it with success False
    backend : see `mbd.simulate`

    Returns
    -------
    LimitCycle

    Raises
    ------
    ModelError, UnknownNameError
        for arguments that cannot be meant, before the first run: a section that the model does not have, a mirror with
        names without partner or of unlike sides, parameters that are none; for a model that depends on time itself or
        has controllers, whose states do not begin again with each return.
    GaitError
        where no gait is found, with the outcome as its sentence ('falls backward at 0.41 s', 'scuffs at 0.30 s') and
        all that was computed in its ``gait``.
    """
    scheme, member = RungeKutta853() if integrator is None else integrator, member_of(energy, speed)
    numbers = {"dt": dt, "tol": tol, "longest": longest}
    check_arguments(start, scheme, strides, numbers, parameters, functions, wrt, on_failure)
    begun, start = start.time, replace(start, time=0.0, memory=None)
    step = dt or FIRST_STEP
    map_ = map_of(model, start, scheme, step, (section, mirror, strides), parameters, functions, modulo, longest,
                  backend)  # fmt: skip
    if len(start.anchors):
        start = replace(start, anchors=counted_from(map_.mechanism.equations, start.anchors, begun))
    gait = _found(map_, start, dt, tol, member)
    if member is None:
        gait = _of_family(gait, start)
    if not gait.success and on_failure == "raise":
        raise GaitError(f"{gait.name}: {gait.outcome}", gait)
    if gait.success:
        for name in [wrt] if isinstance(wrt, str) else wrt:
            _ = gait.derivatives["period", name]
    return gait


def map_of(
    model: Any, start: State, scheme: Integrator, dt: float, cycle: tuple[str, Any, int],
    parameters: Mapping[str, float] | None, functions: Functions | None, modulo: Any, longest: float, backend: str,
) -> ReturnMap:  # fmt: skip
    """The return map, with its arguments checked against the model."""
    section, mirror, strides = cycle
    values = {**start.parameters, **(parameters or {})}
    plain = ReturnMap(model, scheme, dt, section, None, strides, functions or {}, longest, values, backend, start)
    mechanism = plain.mechanism
    section_named(plain.manager, section)
    options = {"contact": "events", "impact": "newton", "locate": "root", "store": 1, "rest_speed": 1e-6}
    refused = refusals(mechanism.equations, scheme, options)
    if refused:
        raise ModelError(refused)
    _require_the_same_later(mechanism, model)
    vector = plain.vector(values)
    if mirror is not None:
        own = {**plain.folded, **plain.plain(values)}
        plain.mirror = require_alike(mechanism, mirror_of(mechanism.equations, mirror, section), vector, own, model)
    plain.fixed = moving_on(mechanism, vector) if modulo is None else increments_named(mechanism, modulo)
    if modulo is None:
        own = {**plain.folded, **plain.plain(values)}
        plain.heading = heading_of(model, mechanism, vector, own, reset_names(mechanism.equations))
    return plain


def _require_the_same_later(mechanism: Mechanism, model: Any) -> None:
    """Raise a `ModelError` where the same state later is another one: a return begins at time 0 each time."""
    faults = []
    if depends_on_time(mechanism):
        faults.append(
            "something of the model depends on time itself (a prescribed motion, samples, a force of time), so that a "
            "state that comes back is not the same later; let it depend on coordinates, or put a clock among them that "
            "an event resets"
        )
    faults += [
        f"the controller {controller.name!r} keeps its state and the parameters that it has written from one step to "
        "the next, which a return begins without; give the parameters as parameters= without it, or simulate until "
        "the walk settles"
        for controller in getattr(model, "controllers", ())
    ]
    if faults:
        raise ModelError(faults)


def _found(map_: ReturnMap, start: State, dt: float | None, tol: float, member: Member | None) -> LimitCycle:
    """The gait, or what became of the search."""
    begun = first_return(map_, start, map_.values)
    if isinstance(begun, Failed):
        return _none(map_, begun)
    section, states = begun
    found = later = first_found(Search(map_, section, tol, member), states, map_.values, dt)
    for _ in range(3):  # then states of modes repeat that begin in one that no gait comes back to
        if later.outcome.kind != "other states":
            break
        again = first_return(map_, states[-1], map_.values)
        if isinstance(again, Failed):
            break
        section, states = again
        later = first_found(Search(map_, section, tol, member), states, map_.values, dt)
    return later if later.success else fallen_first(found, start, map_.values)


def _of_family(gait: LimitCycle, start: State) -> LimitCycle:
    """A gait that is one of a family, of which no member was asked for, with what picks one in its outcome or a doubt.

    It is one where a return keeps the energy of the start, which is no gait: Newton's method then goes along the family
    as far as it must, and has no reason to stay near.
    """
    map_, values = gait.map, gait.parameters
    beside = np.min(np.abs(gait.multipliers - 1.0), initial=1.0) <= UNIT_MULTIPLIER_ATOL
    if gait.success and not beside and "energy" not in gait.trivial:
        return gait
    arrival = map_(start, values, strides=1)
    if not arrival.outcome.good:
        return gait
    begun, later, found = energy_of(map_, [start, arrival.state, gait.state], values)
    if not abs(later - begun) <= HALF_PRECISION_RTOL * max(abs(begun), abs(later)):
        return gait
    family = (
        "nothing takes or gives energy, so that gaits form a family: energy= in J (T + V of the start is "
        f"{begun:.6g} J) or speed= in m/s of mbd.limit_cycle picks one"
    )
    if not gait.success:
        return replace(gait, outcome=replace(gait.outcome, text=f"{gait.outcome.text}; {family}"))
    if abs(found - begun) > 1e-3 * abs(begun):  # it is not the one meant
        doubt(f"{gait.name}: {family}; that which was found has {found:.6g} J")
    return gait


def _none(map_: ReturnMap, failed: Failed) -> LimitCycle:
    """A search whose first return did not arrive, with its state."""
    section = section_of(
        map_.mechanism,
        map_.manager,
        map_.section,
        failed.state,
        frozenset(),
        map_.vector(map_.values),
        map_.fixed,
        map_.heading,
    )
    chart, none = Chart(section, failed.state, map_.vector(map_.values)), float("nan")
    empty = Multipliers(np.zeros(0, complex), np.zeros((chart.size, 0), complex), {}, none)
    mirror = None if map_.mirror is None else map_.mirror.sides
    return LimitCycle(
        getattr(map_.model, "name", ""), map_.section, mirror, map_.strides, failed.state, failed.outcome,
        (failed.outcome,), none, none, (), {}, (), empty, None, dict(map_.values), map_.dt, map_.runs, chart,
        map_, np.zeros(len(map_.fixed)), None,
    )  # fmt: skip
