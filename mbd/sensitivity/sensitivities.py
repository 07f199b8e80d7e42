"""`mbd.sensitivities`: a run, and its exact derivatives by its start and by parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from mbd.bodies.values import is_finite_number, shown
from mbd.compile.mechanisms import mechanism_of
from mbd.errors import ModelError, OneSidedError
from mbd.integrators import Integrator
from mbd.results.trajectory import Trajectory
from mbd.sensitivity.asked import Table, Wanted, names_in, with_inputs
from mbd.sensitivity.one_sided import with_both_sides
from mbd.sensitivity.outputs import taken_apart, usual
from mbd.sensitivity.result import Sensitivities
from mbd.sensitivity.run_data import RunRows, refused
from mbd.sensitivity.sequence import amounts_of, changed_sequences
from mbd.sensitivity.tangent_names import expanded
from mbd.simulation.simulate import REST_SPEED, simulate
from mbd.state import State

__all__ = ["sensitivities"]


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
    amounts = amounts_of(check_events, [name for each in ways for name in ([each] if isinstance(each, str) else each)])
    own: Sequence[Any] = getattr(model, "controllers", ())
    if own and amounts:
        raise refused("in the runs of check_events controllers read and write other values", "leave check_events out")

    def made(start: State, more: Mapping[str, float], asked: Any = None) -> Trajectory:
        return simulate(
            model, replace(start, memory=None), integrator, dt, tol, until=until, contact=contact, impact=impact,
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
    return replace(found, event_changes=changed_sequences(model, run, *asked.of_run(run), amounts, made, backend))


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
