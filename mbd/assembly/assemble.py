"""A consistent start: named values held, the rest completed, every conflict named."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.assembly.conditions import Condition, conditions
from mbd.assembly.consistency import ASSEMBLED_RESIDUAL, residuals, violations
from mbd.assembly.contradictions import Attempt, contradictions, infeasible
from mbd.assembly.doubtful import doubtful
from mbd.assembly.foot_places import foot_places
from mbd.assembly.foreseen import require_inertia
from mbd.assembly.inertia import undetermined
from mbd.assembly.infeasibility import Held
from mbd.assembly.initial_pose import opening
from mbd.assembly.machines import beginning, first_anchors, hold, store_first, without_held
from mbd.assembly.manager import manager_of
from mbd.assembly.named_projection import nearest_positions, nearest_velocities
from mbd.assembly.pose import Posture
from mbd.assembly.posture import capture, close_nearby, close_positions, close_velocities, position_rows
from mbd.assembly.turns import choose_turns, name_wrapped, nearest_turns
from mbd.assembly.whole_values import as_given, spelled_out, three_of_four
from mbd.bodies.values import flag, named_number_faults, names_given
from mbd.compile.mechanism import Mechanism, rate_names
from mbd.compile.mechanisms import mechanism_of
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL, NOMINAL_RTOL
from mbd.equations.equations import Equations
from mbd.errors import AssemblyError, ModelError, UnknownNameError, nearest
from mbd.kernel.stepping.begin_run import MAX_START_DEPTH
from mbd.notes import doubt
from mbd.state import State, of_model


def assemble(
    model: Any,
    position: Mapping[str, Any] | None = None,
    velocity: Mapping[str, Any] | None = None,
    closed: Iterable[str] = (),
    open: Iterable[str] = (),
    parameters: Mapping[str, float] | None = None,
    project: bool = False,
    anchors: Mapping[str, Any] | None = None,
    backend: str = "auto",
) -> State:
    """A consistent start of a model: named values held exactly, the rest completed.

    Positions satisfy ``h(q, t₀) = 0`` of every active row; values that are not named move least from their defaults
    in the metric of the mass matrix. Then velocities satisfy ``B v + h_t = 0``.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    position : {'left hip.angle': 0.2} coordinates [m, rad], first-order states, and any named position
        ('left shank.end.x', the angle of a cut joint), which then holds like a row. 'ball.orientation' is a unit
        quaternion (w, x, y, z), scalar first, whose length is 1 within 1e-6, a scipy ``Rotation``, a rotation matrix
        (3, 3), an axis with an angle ((0, 0, 1), 0.3), or Euler angles about axes that turn along
        ('zxy', (0.1, 0.2, 0.3)) [rad]; three numbers behind any other name are its '.x', '.y', '.z'. A mode starts in
        another state than its own by {'knee phase': 'swing'}, with a remembered value by
        {'knee phase.touchdown angle': 0.2}
    velocity : {'left hip.angle': −1.1} or {'left hip.rate': …} rates by coordinate or rate name [m/s, rad/s], such as
        {'ball.angular_velocity': (0, 0, 2)} in the child's axes, 'ball.angular_velocity.parent', '… .ground'
    closed : names of contacts that start closed
    open : names of contacts that start open even if they touch or lie below their surface; ignored until risen
    parameters : values that differ from the model's, by name
    project : move named values too, to the nearest consistent ones, results such as angles of cut joints by the sum of
        squares; `State.moved` tells how far coordinates were
    anchors : {'left foot': (x, y)} places at which feet of closed contacts stand [m], (x, y, z) in space: of a
        `SpringLeg`, which may be compressed, and of a point of a body
    backend : see `mbd.simulate`

    Returns
    -------
    State
        with `moved`: how far each coordinate is from the value asked for, or from its default.

    Raises
    ------
    UnknownNameError
        for wrong names, with the nearest valid ones.
    AssemblyError
        if constraints cannot hold together (the closure error, an irreducible set of them and what to relax), if the
        named values contradict rows (both residuals of each, and which names are in conflict), if nothing determines
        the motion of a coordinate, or if an open contact starts inside its surface.
    ModelError
        if the model itself has faults.
    """
    (opened, more), (closed, others) = names_given(open, "open"), names_given(closed, "closed")
    feet = foot_places(model, anchors, closed)
    position, held = without_held(model, position)
    if twice := [name for name in feet.positions if isinstance(position, Mapping) and name in position]:
        raise ModelError([f"{name!r} is given by position and by anchors; give one of them" for name in twice])
    position = {**(position or {}), **feet.positions} if feet.positions else position
    position, wrong, doubts = spelled_out(model, position, "position")
    velocity, more_wrong, _ = spelled_out(model, velocity, "velocity")
    wanted = {"position": position, "velocity": velocity, "parameters": parameters}
    faults = [*wrong, *more_wrong] + [
        fault for what, values in wanted.items() for fault in named_number_faults(values, what)
    ]
    if faults + more + others:
        raise ModelError(faults + more + others)
    changed, project = dict(parameters or {}), flag(project, "project")
    require_inertia(model, position or {}, changed)
    mechanism = mechanism_of(model, backend, changed)
    equations, values = mechanism.equations, mechanism.parameters_of(model, changed)
    manager = manager_of(mechanism, values)
    named, faults = _named(model, mechanism, position or {}, velocity or {})
    known = manager.names
    for what, names in (("closed", closed), ("open", opened)):
        faults += [f"{what}: " + nearest(name, known, "contact") for name in names if name not in known]
    faults += [f"contact {name!r} is named both closed and open" for name in set(closed) & set(opened)]
    if faults:
        raise UnknownNameError(faults)
    q, y = _values(equations, named, {})
    if faults := _off_manifold(equations, named, q):
        raise ModelError(faults)

    def closing(of: Mechanism, given: Vector) -> Posture:
        wanted, unknown = _named(model, of, position or {}, velocity or {})
        trial = _opened(of, given, wanted, {}, closed, held)
        if not unknown and not project:
            _closed_as_named(trial, wanted, close_positions)
        return trial

    work = _opened(mechanism, values, named, opening(model, mechanism, values, closing), closed, held)
    bad = _closed(work, named, project, model) or undetermined(work) + _below(work, set(opened)) + _too_small(work)
    if bad:
        raise AssemblyError(bad)
    name_wrapped(work)
    store_first(mechanism, 0.0, work.q, work.y, values, work.anchors)
    hold(mechanism, held, work.anchors)
    feet.hold(work)
    doubt(*doubts, *doubtful(model, mechanism, position or {}), of=model)
    assembled = State(
        0.0, work.q, work.y[: equations.n_v].copy(), work.y[equations.n_v :].copy(), manager.mode(work.flags),
        _armed(work, set(opened)), work.anchors, tuple(coordinate.name for coordinate in equations.coordinates),
        equations.velocity_names, _moved(work, q, y, named), changed, begins=beginning(mechanism, held),
    )  # fmt: skip
    assembled = of_model(assembled, model)
    feet.require_heights(assembled)
    return assembled


TURNS = ("", "angle", "angles", "euler", "flexion", "rotation", "rotation_vector", "quaternion")
"""What a reader may call the orientation of a joint that turns freely."""


@dataclass(frozen=True)
class _Named:
    """Values that a start names: q, v and z by number, any other position or rate as a condition."""

    q: Mapping[int, float]
    v: Mapping[int, float]
    z: Mapping[int, float]
    places: Sequence[Condition]
    speeds: Sequence[Condition]


def _named(
    model: Any, mechanism: Mechanism, position: Mapping[str, float], velocity: Mapping[str, float]
) -> tuple[_Named, list[str]]:
    """The values by number, and what is wrong with their names."""
    equations = mechanism.equations
    coordinates = {coordinate.name: k for k, coordinate in enumerate(equations.coordinates)}
    states = {state.name: k for k, state in enumerate(equations.states)}
    rates = mechanism.kept(rate_names, lambda: rate_names(equations))
    elsewhere = {name: value for name, value in position.items() if name not in states and name not in coordinates}
    places, unknown = conditions(mechanism, three_of_four(model, elsewhere), rates=False)
    speeds, strange = conditions(mechanism, {k: v for k, v in velocity.items() if k not in rates}, rates=True)
    faults = [
        f"position: {name!r} is one number, no vector"
        if name in coordinates
        else f"position: {name!r} is a rate; give it in velocity={{{name!r}: …}}"
        if name in rates
        else "position: " + _no_coordinate(name, coordinates)
        for name in as_given(unknown)
    ]
    faults += ["velocity: " + _no_rate(name, rates) for name in as_given(strange)]
    q, z, v = (
        {numbers[name]: float(value) for name, value in given.items() if name in numbers}
        for numbers, given in ((coordinates, position), (states, position), (rates, velocity))
    )
    return _Named(q, v, z, places, speeds), faults


def _no_coordinate(name: str, coordinates: Mapping[str, int]) -> str:
    """Why a name is no coordinate; a joint that turns freely has an orientation and no angle."""
    joint, _, last = name.partition(".")
    if f"{joint}.orientation.w" not in coordinates or last not in TURNS:
        return nearest(name, coordinates, "coordinate")
    whole = f"{joint}.orientation"
    return (
        f"no coordinate named {name!r}; {joint!r} turns freely and has {whole!r}, an axis with an angle [rad] such as "
        f"{{{whole!r}: ((0, 0, 1), 0.3)}}, Euler angles such as ('zxy', (0.3, 0, 0)), or a quaternion (w, x, y, z)"
    )


def _no_rate(name: str, rates: Mapping[str, int]) -> str:
    """Why a name is no rate: a vector in axes that it has not, one number where three are needed, or none at all."""
    whole, found, axes = name.partition(".angular_velocity")
    if not found or f"{whole}.angular_velocity.x" not in rates:
        return f"{name!r} is one number, no vector" if name in rates else nearest(name, rates, "rate")
    if axes in ("", ".parent", ".ground"):
        return f"{name!r} is three numbers [rad/s], such as (0.0, 0.0, 2.0)"
    whole += ".angular_velocity"
    return (
        f"no rate named {name!r}; {whole!r} is in axes of the child, {f'{whole}.parent'!r} of the parent, "
        f"{f'{whole}.ground'!r} of the ground"
    )


def _opened(
    mechanism: Mechanism, parameters: Vector, named: _Named, guess: Mapping[str, float], closed: Iterable[str],
    held: Mapping[str, float],
) -> Posture:  # fmt: skip
    """A mechanism where closing begins."""
    q, y = _values(mechanism.equations, named, guess)
    q = mechanism.equations.configuration.normalise(q)
    manager, first = manager_of(mechanism, parameters), first_anchors(mechanism, parameters)
    hold(mechanism, held, first)
    return Posture(mechanism, manager, parameters, q, y, manager.flags(closed), first, named.places, named.speeds)


def _values(equations: Equations, named: _Named, guess: Mapping[str, float]) -> tuple[Vector, Vector]:
    """q and (v, z) as named; elsewhere the guess, or defaults, and no velocity."""
    q = np.array(
        [named.q.get(k, guess.get(c.name, c.default)) for k, c in enumerate(equations.coordinates)], dtype=float
    )
    v = [named.v.get(k, guess.get(name, 0.0)) for k, name in enumerate(equations.velocity_names)]
    z = [named.z.get(k, float(state.default)) for k, state in enumerate(equations.states)]
    return q, np.array([*v, *z], dtype=float)


def _closed(work: Posture, named: _Named, project: bool, model: Any) -> list[str]:
    """Close positions, then velocities; what contradicts them."""
    if project and _closed_as_named(work, named, close_nearby):
        return []
    equations = work.equations
    q, y, rows = work.q.copy(), work.y.copy(), position_rows(work)
    held_q, held_v = ([], []) if project else _held(equations, named)
    free = np.ones((2, equations.n_v), dtype=bool)
    _hold(free, held_q, held_v)
    misfit = close_positions(work, rows, free[0])
    if project and np.max(np.abs(misfit), initial=0.0) > EQUAL_RTOL and work.places and work.mechanism.vector:
        reached, work.q = work.q.copy(), q.copy()
        if nearest_positions(work, rows, named.q):
            misfit = np.zeros(len(misfit))
        else:
            work.q = reached
    if np.max(np.abs(misfit), initial=0.0) <= EQUAL_RTOL:
        nearest_turns(work, rows, named.q, EQUAL_RTOL)
    never = infeasible(work, rows, q, misfit, model, named=bool(work.places or held_q))
    if never:
        return never
    capture(work)
    speed_misfit = close_velocities(work, free[1])
    speed = 1.0 + float(np.max(np.abs(work.y[: equations.n_v]), initial=0.0))
    if project and np.max(np.abs(speed_misfit), initial=0.0) > EQUAL_RTOL * speed and work.rates:
        work.y = y.copy()
        if nearest_velocities(work, work.active_rows, named.v):
            speed_misfit = np.zeros(len(speed_misfit))
    capture(work)  # approach speeds
    return contradictions(work, Attempt(rows, q, y, held_q, held_v, misfit, speed_misfit, project), model)


def _closed_as_named(work: Posture, named: _Named, close: Callable[..., Vector]) -> bool:
    """Close around the named values without moving them, if that can be done."""
    trial, rows = replace(work, q=work.q.copy(), y=work.y.copy(), anchors=work.anchors.copy()), position_rows(work)
    held_q, held_v = _held(work.equations, named)
    free = np.ones((2, work.equations.n_v), dtype=bool)
    _hold(free, held_q, held_v)
    choose_turns(trial, rows)
    if not np.max(np.abs(close(trial, rows, free[0])), initial=0.0) <= EQUAL_RTOL:
        return False
    nearest_turns(trial, rows, named.q, EQUAL_RTOL)
    capture(trial)
    speed = 1.0 + float(np.max(np.abs(trial.y[: work.equations.n_v]), initial=0.0))
    if not np.max(np.abs(close_velocities(trial, free[1])), initial=0.0) <= EQUAL_RTOL * speed:
        return False
    capture(trial)
    work.q, work.y, work.anchors = trial.q, trial.y, trial.anchors
    return True


def _held(equations: Equations, named: _Named) -> tuple[list[Held], list[Held]]:
    """Coordinates and rates that stay as named."""
    configuration = equations.configuration
    joints = {
        first + k: (joint, first + joint.adding)
        for joint, first, _ in configuration.charts
        for k in range(joint.adding, len(joint.labels))
    }
    places = [
        Held(joints[k][0].name if k in joints else configuration.names[k], value, configuration.velocities_of[k])
        for k, value in named.q.items()
        if k not in joints or k == joints[k][1]
    ]
    return places, [Held(equations.velocity_names[k], value, (k,)) for k, value in named.v.items()]


def _hold(free: Any, held_q: Sequence[Held], held_v: Sequence[Held]) -> None:
    """Take what is named from the increments and the velocities that are free (2, n_v)."""
    for level, held in enumerate((held_q, held_v)):
        free[level, [k for each in held for k in each.moves]] = False


def _off_manifold(equations: Equations, named: _Named, q: Vector) -> list[str]:
    """Coordinates of joints that must be named together, or that no placement has; what to give."""
    faults = []
    for joint, first, _ in equations.configuration.charts:
        own = range(first + joint.adding, first + len(joint.labels))
        given, names = [k for k in own if k in named.q], ", ".join(map(repr, joint.coordinate_names[joint.adding :]))
        if 0 < len(given) < len(own):
            faults.append(f"position: {names} of {joint.known_as} belong together; name all of them or none")
    return faults or [f"position: {fault}" for fault in equations.configuration.misplaced(q, NOMINAL_RTOL)]


def _too_small(work: Posture) -> list[str]:
    """Rows that closing left open in the mechanism's own lengths, which are smaller than metres can tell."""
    active = work.active_rows
    found = residuals(work.mechanism, work.time, work.q, work.y, work.parameters, work.anchors)
    speed = float(np.max(np.abs(work.y[: work.equations.n_v]), initial=0.0))
    left = violations(work.equations.rows, active, found, speed) if active else []
    return [f"lengths are too small in metres to close {'; '.join(left)}: give lengths in mm or µm"] if left else []


def _gaps(work: Posture) -> Vector:
    out = np.zeros(work.mechanism.sizes["guards"])
    block = work.mechanism.block(work.time, work.q, work.y, work.anchors)
    work.mechanism.common["guards"](block, work.parameters, out)
    return out


def _below(work: Posture, opened: set[str]) -> list[str]:
    """Open contacts that start inside their surface without having been named open."""
    faults = list[str]()
    if not work.manager.contacts:
        return faults
    values, count = _gaps(work), len(work.manager.contacts)
    for c, contact in enumerate(work.manager.contacts):
        named_off = isinstance(contact.only_while, str) and contact.only_while not in work.manager.mode(work.flags)
        off = named_off or (contact.only_while is not None and values[3 * count + c] <= 0.0)
        if values[c] < -MAX_START_DEPTH and not work.flags[c] and contact.name not in opened and not off:
            on = "let it push" if contact.kind == "penalty" else "set it on the surface"
            inside = (
                f"{contact.name!r} starts {-values[c]:.6g} {contact.unit} {_beyond(contact.unit)}, "
                f"name it in closed=[…] to {on}, or in open=[…] to ignore it until it has risen"
            )
            against = (
                f"{contact.name!r} starts open at {values[c]:.6g} {contact.unit}, a velocity at which it acts; name it "
                "in closed=[…], or give a velocity that it lets pass"
            )
            faults.append(against if contact.is_velocity else inside)
    return faults


def _beyond(unit: str) -> str:
    """What to try with a gap that is negative: a distance from a surface, or an angle from a stop."""
    if unit == "rad":
        return "beyond its stop; turn the joint the other way (check the sign of the angle and of its stop)"
    return "inside its surface; raise the mechanism"


def _armed(work: Posture, opened: set[str]) -> frozenset[str]:
    """Open contacts that may close from the start.

    One that touches (|g| below 1e-8) and waits for another by `When` is a trailing foot: ignored until it has risen.
    """
    armed = set[str]()
    if not work.manager.contacts:
        return frozenset(armed)
    values = _gaps(work)
    for c, contact in enumerate(work.manager.contacts):
        lifted = values[c] > ASSEMBLED_RESIDUAL
        trailing = bool(contact.when) or contact.name in opened
        if not work.flags[c] and (lifted or (not trailing and values[c] > -MAX_START_DEPTH)):
            armed.add(contact.name)
    return frozenset(armed)


def _moved(work: Posture, q: Vector, y: Vector, named: _Named) -> dict[str, float]:
    """How far named values, and unnamed ones from their defaults, were moved."""
    moved = {}
    rounded = {first + k for j, first, _ in work.equations.configuration.charts for k in range(len(j.labels))}
    for k, coordinate in enumerate(work.equations.coordinates):
        change = float(work.q[k] - q[k])
        if change != 0.0 and ((k in named.q and k not in rounded) or abs(change) > 1e-15):
            moved[coordinate.name] = change
    for k, name in enumerate(work.equations.velocity_names):
        change = float(work.y[k] - y[k])
        if change != 0.0 and (k in named.v or abs(change) > 1e-15):
            moved[name] = change
    return moved
