"""`mbd.sensitivities`: a run, and its exact derivatives by its start and by parameters."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from mbd.bodies.values import among, is_finite_number, is_number, shown
from mbd.compile.mechanisms import mechanism_of, tunable_model
from mbd.errors import ModelError, OneSidedError, UnknownNameError, nearest
from mbd.integrators import Integrator
from mbd.results.trajectory import Trajectory
from mbd.results.units import unit
from mbd.sensitivity.derivative import passed
from mbd.sensitivity.functions import rates_of_parameters
from mbd.sensitivity.one_sided import with_both_sides
from mbd.sensitivity.outputs import lines_of, taken_apart, usual
from mbd.sensitivity.result import Sensitivities
from mbd.sensitivity.run_data import ADVICE, RunRows, Source, refused
from mbd.sensitivity.sequence import amounts_of, changed_sequences
from mbd.sensitivity.starts import restitution_names
from mbd.sensitivity.tangent_names import expanded, refuse_parts, start_names, whole_names
from mbd.simulation.simulate import REST_SPEED, simulate
from mbd.state import State

__all__ = ["derivatives_of", "sensitivities", "with_inputs"]

Wanted = str | Mapping[str, Mapping[str, Any]]


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
    _names_in(wrt)
    _check_of(of)
    _check_hold(hold)
    values = _values_of(at)
    if not isinstance(start, State):
        raise ModelError(f"start must be a State from mbd.assemble(model, …), not {start!r}")
    changed = {**start.parameters, **(parameters or {})} if isinstance(parameters, Mapping | None) else {}
    model = with_inputs(model, backend, changed, wrt, controllers)
    ways = expanded(mechanism_of(model, backend).equations, wrt)
    amounts = amounts_of(check_events, [name for each in ways for name in ([each] if isinstance(each, str) else each)])
    own: Sequence[Any] = getattr(model, "controllers", ())
    if own and amounts:
        raise refused("in the runs of check_events controllers read and write other values", "leave check_events out")

    def made(start: State, more: Mapping[str, float]) -> Trajectory:
        return simulate(
            model, replace(start, memory=None), integrator, dt, tol, until=until, contact=contact, impact=impact,
            parameters={**(parameters or {}), **more} if more else parameters, rest_speed=rest_speed, backend=backend,
        )  # fmt: skip

    run = made(start, {})
    try:
        found = derivatives_of(run, wrt, of, values, hold, model, integrator)
    except OneSidedError as error:
        rows, single = RunRows(run), _names_in(wrt)[0]
        names, held = (
            (usual(rows) if of is None else taken_apart(rows, of)),
            _held(run, single) if hold is None else hold,
        )
        directions = _directions(run, wrt, values)
        raise with_both_sides(error, model, run, directions, held, names, made, backend) from None
    if not amounts:
        return found
    single, _ = _names_in(wrt)
    ways, held = _directions(run, wrt, values), _held(run, single) if hold is None else hold
    return replace(found, event_changes=changed_sequences(model, run, ways, held, amounts, made, backend))


def derivatives_of(
    run: Trajectory,
    wrt: Sequence[Wanted],
    of: Sequence[str] | None = None,
    at: Mapping[str, float] | None = None,
    hold: Sequence[str] | None = None,
    model: Any = None,
    scheme: Integrator | None = None,
) -> Sensitivities:
    """The derivatives of a run of a model that `with_inputs` made; see `sensitivities`.

    scheme : the run's integrator; None: the usual one
    """
    single, _ = _names_in(wrt)
    held = _held(run, single) if hold is None else hold
    return _differentiated(
        run, _directions(run, wrt, at or {}), held, of, None if model is None else Source(model, scheme)
    )


def _directions(run: Trajectory, wrt: Sequence[Wanted], values: Mapping[str, float]) -> list[Any]:
    """Names, and quantities with the rates of the parameters that they move."""
    known = dict(zip(run.record.parameter_names, run.record.parameters, strict=False))
    found: list[Any] = []
    for each in wrt:
        if isinstance(each, str):
            found.append(each)
        else:
            found += [(name, rates_of_parameters(name, given, values, known)) for name, given in each.items()]
    return found


def _differentiated(
    run: Trajectory, directions: list[Any], held: Sequence[str], of: Sequence[str] | None, source: Source | None
) -> Sensitivities:  # fmt: skip
    """The derivatives of a run as a table."""
    found, wanted = passed(run, directions, held, source)
    names = usual(found.rows) if of is None else taken_apart(found.rows, of)
    lines = lines_of(found.rows, found.programs, found.walked, names)
    facts, columns = run.facts, tuple(each.name for each in wanted)
    return Sensitivities(
        lines.names, columns, lines.matrix, lines.values, run,
        tuple("s" if name == "time" or ".time" in name else unit(name, facts) for name in lines.names),
        tuple("rad" if ".turn." in name else unit(name, facts) for name in columns),
        written=tuple(dict.fromkeys(name for each in found.rows.controllers for name in each.writes)),
    )  # fmt: skip


def _names_in(wrt: Any) -> tuple[list[str], list[str]]:
    """Names of single quantities, and of the parameters that functions give."""
    if isinstance(wrt, str | bytes) or not isinstance(wrt, Sequence) or not len(wrt):
        raise ModelError(f"wrt must be a list of names such as ['hip.angle', 'hip.mass'], not {shown(wrt)}")
    single, grouped = list[str](), list[str]()
    for each in wrt:
        if isinstance(each, str):
            single.append(each)
        elif isinstance(each, Mapping) and each and all(isinstance(v, Mapping) and v for v in each.values()):
            grouped += [name for functions in each.values() for name in functions]
            rates = [rate for functions in each.values() for rate in functions.values() if is_number(rate)]
            if not all(map(is_finite_number, rates)):
                raise ModelError(f"wrt: rates of parameters must be finite numbers, or functions, not {shown(each)}")
        else:
            raise ModelError(
                f"wrt: expected names, or functions of parameters {{name: {{parameter: function}}}}, not {shown(each)}"
            )
    return single, grouped


def _held(run: Trajectory, single: Sequence[str]) -> list[str]:
    """The coordinates and rates of the start among some names."""
    parameters = set(run.record.parameter_names)
    return [name for name in single if name not in parameters]


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


def _check_controllers(own: Sequence[Any], asked: Any, names: Collection[str]) -> None:
    """Refuse the controllers of a model unless what they write is to be held, and derivatives by what they write."""
    if not among(asked, (None, "held")):
        raise ModelError(f"controllers={shown(asked)} is not available; use 'held', or leave it out")
    if own and asked is None:
        them = ", ".join(repr(each.name) for each in own)
        raise refused(
            f"its controllers ({them}) change parameters as they read results, which is not differentiated",
            ADVICE,
        )
    for each in own:
        for name in each.writes:
            if name in names:
                raise refused(f"{name!r} is held as {each.name!r} writes it", "leave it out of wrt")


def with_inputs(model: Any, backend: str, changed: Mapping[str, float], wrt: Any, controllers: Any = None) -> Any:
    """The model with the parameters that `wrt` names as run-time inputs, also where they are 0 or ±1."""
    single, grouped = _names_in(wrt)
    _check_controllers(getattr(model, "controllers", ()), controllers, {*single, *grouped})
    mechanism = mechanism_of(model, backend, {k: v for k, v in changed.items() if is_number(v)})
    inputs = {parameter.name for parameter in mechanism.equations.parameters}
    folded = getattr(model, "parameters", {})
    own = {coordinate.name for coordinate in mechanism.equations.coordinates}
    known = {*inputs, *folded, *start_names(mechanism.equations), *restitution_names(mechanism.equations)}
    whole = whole_names(mechanism.equations)
    for name in (*single, *grouped):
        if name not in known and not (name in whole and name in single):
            refuse_parts(mechanism.equations, [name], "wrt")
            raise UnknownNameError(
                "wrt: " + nearest(name, known, "coordinate, rate of the start or parameter", "There are")
            )
    more = [name for name in (*single, *grouped) if name in folded and name not in inputs and name not in own]
    return tunable_model(model, more) if more else model
