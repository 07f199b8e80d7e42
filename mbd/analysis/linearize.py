"""From a state to its linear motion: instant, derivatives, independent coordinates, inputs and outputs, modes."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.analysis.independent import independent
from mbd.analysis.instant import Instant, instant
from mbd.analysis.linear_motion import LinearMotion, Prescribed, linear_motion, singular
from mbd.analysis.linearization import Linearization
from mbd.analysis.ports import Input, Output, acting, doubt_of_idle, input_names, output_nodes, port_terms
from mbd.analysis.state_space import StateSpace
from mbd.arrays import Matrix
from mbd.compile.mechanisms import require_model
from mbd.equations.equations import Equations
from mbd.equations.linearization import LinearTerms
from mbd.equations.ports import PortTerms
from mbd.errors import ModelError
from mbd.notes import doubt
from mbd.state import State

ADVICE = "; linearize beside it, or make the function smooth there"
"""What to try."""

DERIVATIVE_RTOL = 1e-5
"""Change of the derivatives within that, over their size, that counts as one [-]."""


def linearize(
    model: Any,
    state: State,
    parameters: Mapping[str, float] | None = None,
    backend: str = "auto",
    *,
    inputs: str | Iterable[str] | None = None,
    outputs: str | Iterable[str] | None = None,
) -> Linearization:
    """The linear motion about a state, with exact derivatives: ``δẋ = A δx + B δu``, ``δy = C δx + D δu``.

    Contacts that are closed in the state stay closed; their frictions slide where they move, and stick where they are
    at rest and can. Independent coordinates are chosen so that rows determine the others best. A is the exact Jacobian
    of their first-order equations at any state; at an equilibrium or a steady motion its eigenvalues do not depend on
    the choice, on the cut or on the order of rows. Time is held: driven motions are frozen at the state's instant.
    Displacements of joints with quaternions lie in axes that turn with the child; where a motion without accelerations
    does not stay the same in these, such as that of a coin that rolls, an MbdWarning says so.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    state : from `assemble`, or `run.final`
    parameters : values that differ from the model's, by name
    backend : see `mbd.simulate`; for `Linearization.rhs`
    inputs : names of run-time parameters ('drive.torque', 'push.force.x', 'gravity.x', whatever a `Controller` may
        write) and of laws that are functions, expressions or samples, to which u is added ('drive.torque',
        'theta.force' of a `Lagrangian`). What rows on positions prescribe is an input by its acceleration
        ('crank drive.value.acceleration'), what rows on velocities do by its rate; value and rate become states
    outputs : names of results, as `run[…]` takes them, a vector's name for its components; by default the states

    Raises
    ------
    ModelError
        if the state is not consistent, a closed contact would pull, the constraint Jacobian loses rank at this
        posture only, an input can be none, an output depends on how redundant rows share a load, or a
        derivative is not finite.
    UnknownNameError
        for inputs and outputs that the model does not have, with the nearest.

    Examples
    --------
    >>> import mbd
    >>> model = mbd.Model("pendulum")
    >>> rod = mbd.Link("rod", mass=1.0, length=0.5, center=0.5)
    >>> model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Viscous(0.1)))
    >>> model.apply(mbd.Motor("drive", model.joints[0], torque=0.0))
    >>> linear = mbd.linearize(model, mbd.assemble(model), inputs=["drive.torque"], outputs=["rod.end.x"])
    >>> print(linear)
    pendulum at t = 0 s, in equilibrium: 1 coordinate, no rows
      states: pin.angle, pin.angle.rate
        ω [rad/s]      f [Hz]  damping ζ  motion
          4.42945    0.704968     0.0452  pin.angle
      inputs: drive.torque
      outputs: rod.end.x
    >>> linear.B.T, linear.C, linear.D
    (array([[0., 4.]]), array([[0.5, 0. ]]), array([[0.]]))
    """
    require_model(model)
    wanted = input_names(model, () if inputs is None else inputs)
    found = instant(model, state, parameters, backend, [each.parameter for each in wanted])
    equations, terms = found.mechanism.equations, found.terms()
    n_v = equations.n_v
    if n_v == 0:
        raise ModelError(f"{equations.name!r} has no coordinate; connect a body by a joint that lets it move")
    given = acting(model, equations, [equations.rows[k] for k in found.rows], wanted)
    seen = output_nodes(equations, () if outputs is None else outputs)
    local, freedoms = port_terms(found, given, seen), _freedoms(equations)
    _require(_not_finite(terms, local, [name for name, _ in freedoms], given, seen))
    chosen = independent(terms.M[:n_v, :n_v], terms.B, terms.turning, found.velocity, equations.n_z)
    _require(singular(found, terms, chosen))
    prescribed = Prescribed.of(given, local, found.velocity)
    picked = (*chosen.places, *(n_v + k for k in chosen.speeds), *range(2 * n_v, 2 * n_v + equations.n_z))
    motion = linear_motion(found, terms, chosen, picked, local, prescribed, seen)
    space = _space([freedoms[k] for k in picked], motion, given, seen)
    doubt_of_idle(_idle(given, space))
    values = [found.value(given[k].node) if order == 0 else 0.0 for k, order in prescribed.states]
    linear = Linearization(
        equations.name, state.time, tuple(name for name, _ in equations.configuration.freedoms), found.titles,
        terms.M[:n_v, :n_v], terms.C[:n_v, :n_v], terms.K[:n_v], terms.B, space, motion.basis,
        np.concatenate([state.q, state.v, state.z]), np.concatenate([state.v, found.rate]), local.y,
        *_modes(motion.A, motion.basis[:n_v]), picked, found, np.array(values),
        not (inputs is None and outputs is None), (given, seen),
    )  # fmt: skip
    if linear.is_equilibrium:
        _doubt_of_turning(found, terms)
    return linear


def _require(faults: list[str]) -> None:
    if faults:
        raise ModelError(faults)


def _freedoms(equations: Equations) -> list[tuple[str, str]]:
    """(name, unit) of places, velocities and first-order states."""
    whole = equations.configuration
    speeds = zip(whole.velocity_names, whole.velocity_units, strict=True)
    return [*whole.freedoms, *speeds, *((each.name, each.unit) for each in equations.states)]


def _space(
    states: list[tuple[str, str]], motion: LinearMotion, given: Sequence[Input], seen: Sequence[Output]
) -> StateSpace:
    """A, B, C, D with names and units; the states are the outputs where none are given."""
    states += [(name, each.state_unit(order)) for each in given for order, name in enumerate(each.states)]
    ends = [(each.name, each.unit) for each in seen]
    C, D = motion.C, motion.D
    if not seen:
        ends, C, D = states, np.eye(len(states)), np.zeros((len(states), len(given)))
    titled: Any = states, [(each.name, each.unit) for each in given], ends
    named, measured, seen_as = (tuple(name for name, _ in part) for part in titled)
    of_states, of_inputs, of_outputs = (tuple(unit for _, unit in part) for part in titled)
    return StateSpace(motion.A, motion.B, C, D, named, measured, seen_as, of_states, of_inputs, of_outputs)


def _idle(given: Sequence[Input], space: StateSpace) -> list[str]:
    """Names of the inputs whose columns are zero."""
    moved = np.any(space.B, axis=0) | np.any(space.D, axis=0)
    return [each.name for each, moves in zip(given, moved, strict=True) if not moves]


def _modes(A: Matrix, place: Matrix) -> tuple[Any, Any]:
    """Eigenvalues by magnitude, pairs side by side, and the shapes in the coordinates."""
    from scipy.linalg import eig

    values, vectors = eig(A)
    order = np.lexsort((-values.imag, values.real, np.round(np.abs(values), 12 - _digits(values))))
    values, shapes = values[order], place @ vectors[:, order]
    for k in range(len(values)):
        size = np.abs(shapes[:, k])
        largest = int(np.argmax(size >= (1.0 - 1e-9) * np.max(size, initial=0.0))) if len(size) else 0
        moves = np.linalg.norm(vectors[:, order[k]])
        shapes[:, k] = shapes[:, k] / shapes[largest, k] if size[largest] > 1e-10 * moves else 0.0
    return values, shapes


def _digits(values: Any) -> int:
    """Decimal places before the point of the largest magnitude."""
    largest = float(np.max(np.abs(values), initial=0.0))
    return int(np.ceil(np.log10(largest))) if largest > 0.0 else 0


def _doubt_of_turning(found: Instant, terms: LinearTerms) -> None:
    """Tell where derivatives change along a motion whose joints with quaternions turn: eigenvalues are not of it."""
    configuration, state = found.mechanism.equations.configuration, found.state
    speed = float(np.max(np.abs(state.v), initial=0.0))
    if configuration.is_vector or speed == 0.0:
        return
    names = configuration.velocity_names
    turning = [k for k, name in enumerate(names) if ".angular_velocity." in name and abs(state.v[k]) > 1e-9 * speed]
    if not turning:
        return
    # how far the motion is followed, as an angle of the fastest turn [rad]
    step = 1e-3 / float(np.max(np.abs(state.v[turning])))
    turned = np.where(np.isin(np.arange(len(names)), turning), state.v[: len(names)], 0.0)
    ahead = replace(found, state=replace(state, q=configuration.compose(state.q, step * turned))).terms()
    pairs = [(getattr(terms, name), getattr(ahead, name)) for name in ("M", "C", "K", "B")]
    if all(np.max(np.abs(a - b), initial=0.0) <= DERIVATIVE_RTOL * np.max(np.abs(a), initial=0.0) for a, b in pairs):
        return
    fastest = names[max(turning, key=lambda k: abs(state.v[k]))].partition(".")[0]
    doubt(
        f"linearize: '{fastest}' turns, and the derivatives change along its motion: A is that of this instant, and "
        "its eigenvalues do not tell whether the motion is stable; give what spins steadily a Revolute about its axis"
    )


def _not_finite(
    terms: LinearTerms, ports: PortTerms, states: Sequence[str], inputs: Sequence[Input], outputs: Sequence[Output]
) -> list[str]:
    """One sentence for each; `states` are names of places, velocities and first-order states, in this order."""
    n_v = terms.K.shape[1]
    by_place = _columns(terms.K, terms.turning, terms.change_place)
    by_speed = _columns(terms.C) | np.pad(_columns(terms.B, terms.change_speed), (0, len(terms.C) - n_v))
    by_input = _columns(ports.r, ports.h, ports.rate, ports.change)
    names = [*states, *(each.name for each in inputs if each.node is not None)]
    lost = [name for name, bad in zip(names, (*by_place, *by_speed, *by_input), strict=True) if bad]
    found = [f"forces or rows have no finite derivative by {name!r} at this state{ADVICE}" for name in lost]
    of_output = (
        ports.place, ports.speed, ports.state, ports.acceleration, ports.state_rate, ports.multiplier, ports.through,
        ports.y[:, None],
    )  # fmt: skip
    bad_ones = _columns(*(part.T for part in of_output))
    lost = [each.name for each, bad in zip(outputs, bad_ones, strict=True) if bad]
    return found + [f"the output {name!r} has no finite value or derivative at this state{ADVICE}" for name in lost]


def _columns(*parts: Matrix) -> Matrix:
    """Which columns have an entry that is not finite."""
    return np.asarray(np.any([np.any(~np.isfinite(part), axis=0) for part in parts], axis=0))
