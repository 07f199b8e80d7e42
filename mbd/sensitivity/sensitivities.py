"""`mbd.sensitivities`: a run, and its exact derivatives by its start and by parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from mbd.assembly.projection import project
from mbd.bodies.values import is_finite_number, is_number, shown
from mbd.compile.mechanisms import mechanism_of
from mbd.errors import AssemblyError, ModelError, OneSidedError, SimulationError, UnknownNameError, nearest
from mbd.integrators import Integrator
from mbd.results.trajectory import Trajectory
from mbd.sensitivity.asked import Table, Wanted, names_in, with_inputs
from mbd.sensitivity.one_sided import with_both_sides
from mbd.sensitivity.outputs import taken_apart, usual
from mbd.sensitivity.result import Sensitivities
from mbd.sensitivity.run_data import RunRows, refused
from mbd.sensitivity.starts import directions, programs_of, start_tangent
from mbd.sensitivity.tangent_names import expanded
from mbd.simulation.run.memory import without_memory
from mbd.simulation.simulate import REST_SPEED, simulate
from mbd.state import State

Again = Callable[[State, Mapping[str, float]], Trajectory]


def sensitivities(
    model: Any,
    start: State,
    integrator: Integrator | None = None,
    dt: float | None = None,
    tol: float | None = None,
    *,
    until: float | str | tuple[str, float],
    wrt: Sequence[Wanted],
    of: Sequence[str] | None = None,
    at: Mapping[str, float] | None = None,
    hold: Sequence[str] | None = None,
    check_events: Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    contact: Literal["events", "nonsmooth"] = "events",
    impact: Literal["newton", "poisson", "sequential"] = "newton",
    rest_speed: float = REST_SPEED,
    controllers: Literal["held"] | None = None,
    backend: str = "auto",
) -> Sensitivities:
    """Run a model and differentiate the numbers of the run.

    Every step is differentiated as the implicit function that it is at its converged solution, every event with the
    shift of its instant, ``δt* = −(g_y δy + g_p δp)/ġ``, every impact with the rows that took part in it (the saltation
    matrix: Leine & Nijmeijer 2004, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, ch. 7), phase by phase
    where its law has several. So these are the derivatives of what the run prints, whatever its steps. Step sizes that
    follow `tol` are held as they were.

    Parameters
    ----------
    model, start, integrator, dt, tol, until, parameters, contact, impact, rest_speed, backend : see `mbd.simulate`
    wrt : coordinates ('hip.angle') and rates ('hip.rate') of the start; of joints that turn freely 'hip.turn.x', '.y',
        '.z', small rotations of the child about its own axes [rad], 'hip.orientation' for all three, and
        'hip.angular_velocity'; parameters ('left thigh.mass'), restitutions of
        contacts ('left foot.restitution'), and functions of parameters,
        ``{"slope": {"gravity.x": lambda s: 9.81 * mbd.sin(s), …}}``, or the rates of several parameters,
        ``{"legs": {"left leg.mass": 1.0, "right leg.mass": 1.0}}``
    of : results at the end ('hip.angle', 'foot.force'), 'time', the instants of events ('foot.time' of the first one,
        'foot.time.2' of the second); those of several parts ('hip.euler.zxy') are taken apart; by default the state at
        the end, and 'time'
    at : values of the quantities whose functions are in `wrt`, {"slope": 0.05}
    hold : coordinates and rates of the start that keep their values where closed contacts or constraints bind it, such
        as those that `mbd.assemble` was given; the others complete it, with the least motion. By default those in `wrt`
    check_events : changes > 0 of names in `wrt`, {"hip.angle": 0.01}: two more runs of each, with the change added and
        taken away, tell in `Sensitivities.event_changes` which event is then another, where derivatives tell nothing
    controllers : 'held' differentiates a run whose model has controllers with what they wrote held as it was, at the
        same samples and events: without their feedback, as if the values were replayed. By default they are refused

    Returns
    -------
    Sensitivities

    Raises
    ------
    ModelError, UnknownNameError
        for arguments that cannot be honoured.
    CapabilityError
        where the run has no derivative (a contact only grazes, several events happen at one instant), and for what is
        not differentiated: non-smooth steps, feedback of controllers. It tells name and time. Where there are
        derivatives on one side only, as of dry friction that starts at rest and slides at once and of an event at the
        start or as the run ends, the error has those of both sides, in its text and its `sides`.

    Examples
    --------
    A ball that falls from 1 m: how the instant of its landing, √(2 h/g), depends on the height.

    >>> import mbd
    >>> model = mbd.Model("ball")
    >>> ball = mbd.PointMass("ball", mass=2.0)
    >>> model.connect(mbd.Prismatic("fall", model.ground.origin, ball.origin, axis="y"))
    >>> model.constrain(mbd.Unilateral("floor", mbd.height(ball.origin)))
    >>> start = mbd.assemble(model, {"fall.displacement": 1.0})
    >>> found = mbd.sensitivities(model, start, dt=0.01, until="floor", wrt=["fall.displacement"], of=["time"])
    >>> print(f"{found['time', 'fall.displacement']:.6f}")
    0.225762
    """
    names_in(wrt)
    _check_of(of)
    _check_hold(hold)
    values = _values_of(at)
    if not isinstance(start, State):
        raise ModelError(f"start must be a State from mbd.assemble(model, …), not {start!r}")
    changed = {**start.parameters, **(parameters or {})} if isinstance(parameters, Mapping | None) else {}
    model = with_inputs(model, backend, changed, wrt, controllers)
    ways = expanded(mechanism_of(model, backend).equations, wrt)
    amounts = _amounts_of(check_events, [name for each in ways for name in ([each] if isinstance(each, str) else each)])
    own: Sequence[Any] = getattr(model, "controllers", ())
    if own and amounts:
        raise refused("in the runs of check_events controllers read and write other values", "leave check_events out")

    def made(start: State, more: Mapping[str, float], asked: Any = None) -> Trajectory:
        return simulate(
            model, without_memory(start), integrator, dt, tol, until=until, contact=contact, impact=impact,
            parameters={**(parameters or {}), **more} if more else parameters, rest_speed=rest_speed, backend=backend,
            wrt=asked,
        )  # fmt: skip

    asked = Table(wrt, of, values, hold)
    try:
        run = made(start, {}, asked)
    except OneSidedError as error:
        rows = RunRows(error.run)
        names = usual(rows) if of is None else taken_apart(rows, of)
        raise with_both_sides(error, model, error.run, *asked.of_run(error.run), names, made, backend) from None
    found: Sensitivities = asked.found
    if not amounts:
        return found
    return replace(found, event_changes=_changed_sequences(model, run, *asked.of_run(run), amounts, made, backend))


def _check_hold(hold: Any) -> None:
    if hold is not None and (
        isinstance(hold, str) or not isinstance(hold, Sequence) or not all(isinstance(name, str) for name in hold)
    ):
        raise ModelError(f"hold must be a list of names such as ['hip.angle'], or None, not {shown(hold)}")


def _check_of(of: Any) -> None:
    if of is not None and (
        isinstance(of, str) or not isinstance(of, Sequence) or not all(isinstance(name, str) for name in of)
    ):
        raise ModelError(f"of must be a list of names such as ['hip.angle', 'foot.time'], or None, not {shown(of)}")


def _values_of(at: Any) -> dict[str, float]:
    if at is None:
        return {}
    if not isinstance(at, Mapping) or not all(isinstance(k, str) and is_finite_number(v) for k, v in at.items()):
        raise ModelError(f"at maps names of quantities to finite numbers, such as {{'slope': 0.05}}, not {shown(at)}")
    return {name: float(value) for name, value in at.items()}


def _amounts_of(given: Any, names: list[str]) -> dict[str, float]:
    """By how much each quantity is to change, checked.

    Raises
    ------
    ModelError, UnknownNameError
        for what is no positive number, or a name that is not among `names`.
    """
    if given is None:
        return {}
    if not isinstance(given, Mapping) or not all(is_number(size) and size > 0.0 for size in given.values()):
        raise ModelError(
            "check_events maps names in wrt to changes > 0 that the order of events is to survive, such as "
            f"{{'hip.angle': 0.01}}, not {shown(given)}"
        )
    for name in given:
        if name not in names:
            raise UnknownNameError("check_events: " + nearest(name, names, "name in wrt", "There are"))
    return {name: float(size) for name, size in given.items()}


def _changed_sequences(
    model: Any, run: Trajectory, ways: Sequence[Any], held: Sequence[str], amounts: Mapping[str, float], again: Again,
    backend: str,
) -> tuple[str, ...]:  # fmt: skip
    """The first event that is another, by each change in both senses; () if all are the same.

    ways, held : directions and what they leave as it is, see `mbd.sensitivity.asked`; amounts : sizes of changes;
    again : makes the run from another start, with other parameters
    """
    rows, found = RunRows(run), list[str]()
    wanted_ways, compose = directions(rows.mechanism, ways), rows.mechanism.equations.configuration.compose
    for way in wanted_ways:
        if way.restitutions and way.name in amounts:
            raise refused(
                f"runs take no other restitution as a parameter: {way.name!r}", "leave it out of check_events"
            )
    programs = programs_of(rows.mechanism, wanted_ways, rows.record.parameters)
    start, state = start_tangent(rows.first, programs, wanted_ways, held), rows.record.start
    values = dict(zip(rows.record.parameter_names, rows.record.parameters, strict=False))
    wanted = [(event.kind, event.name) for event in run.events]
    for k, way in enumerate(wanted_ways):
        size = amounts.get(way.name, 0.0)
        for part in (size, -size) if size else ():
            changed = {name: values[name] + part * rate for name, rate in (way.parameters or {}).items()}
            n_v = len(start.q)
            moved = replace(
                without_memory(state), q=compose(state.q, part * start.q[:, k]), v=state.v + part * start.y[:n_v, k],
                z=state.z + part * start.y[n_v:, k],
            )  # fmt: skip
            name = f"{way.name} {'+' if part > 0 else '−'} {size:g}"
            try:
                other = again(project(model, moved, {**state.parameters, **changed}, backend), changed)
            except (AssemblyError, SimulationError) as error:
                found.append(f"{name}: {str(error).splitlines()[0]}")
                continue
            difference = _first_difference(wanted, [(event.kind, event.name) for event in other.events])
            found += [f"{name}: {difference}"] if difference else []
    return tuple(found)


def _first_difference(wanted: list[tuple[str, str]], found: list[tuple[str, str]]) -> str:
    """The first event that is another, '' if none is."""
    for number in range(max(len(wanted), len(found))):
        here = wanted[number] if number < len(wanted) else None
        there = found[number] if number < len(found) else None
        if here != there:
            now, then = (f"{each[1]!r} {each[0]}" if each else "none" for each in (there, here))
            return f"event {number + 1} is {now}, in the run {then}"
    return ""
