"""A motion in a model's own coordinates: positions, velocities and accelerations at each frame."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.assemble import assemble
from mbd.bodies.values import floats, shown
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equations.equations import Equations
from mbd.errors import ModelError, UnknownNameError, nearest, quoted
from mbd.forces.samples import Samples, in_degrees
from mbd.forces.scipy_curves import is_curve
from mbd.laboratory.closed_loops import close_loops, refuse_open_loops
from mbd.laboratory.quaternion_rates import make_continuous, quaternion_rates
from mbd.laboratory.recording import Recording
from mbd.laboratory.splines import GROUP, Spline
from mbd.notes import doubt
from mbd.results.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Motion:
    """q, v and v̇ at the frames of a motion.

    Attributes
    ----------
    time : (R,) [s]
    q : (R, n_q); v, a : (R, n_v)
    run : the run that it comes from, whose contact forces are known; None of a recorded motion
    differentiated : whether accelerations are second derivatives of splines, which noise in the values scatters
    notes : what was done to get it, a sentence each
    """

    time: Vector
    q: Matrix
    v: Matrix
    a: Matrix
    run: Trajectory | None = None
    notes: tuple[str, ...] = ()
    differentiated: bool = True


def motion_of(model: Any, mechanism: Mechanism, motion: Any, changed: Mapping[str, float]) -> Motion:
    """A motion from a run, or from arrays by name.

    Arrays need the key 'time'. Of a `Recording` the channels that are coordinates are taken, and a note names the
    others. The others are coordinates ('left hip.angle', 'trunk.orientation' of shape (R, 4)) at
    these times, or `Samples` of them; velocities and accelerations are those of the cubic spline through the values
    (not-a-knot), unless they are given too ('left hip.angle.rate', 'left hip.angle.acceleration'). Coordinates that
    the rows of closed loops determine may be left out.

    Raises
    ------
    ModelError
        for names that the model lacks, coordinates that are missing, gaps, times that do not increase.
    """
    if isinstance(motion, Trajectory):
        return _of_run(mechanism.equations, motion)
    inner = getattr(motion, "run", None)
    if isinstance(inner, Trajectory):  # of inverse kinematics, which knows no forces
        return replace(_of_run(mechanism.equations, inner), run=None)
    if isinstance(motion, Mapping):
        return _of_arrays(model, mechanism, motion, changed)
    raise ModelError(
        "motion must be a run, the result of mbd.inverse_kinematics, or arrays by name such as "
        f"{{'time': t, 'left hip.angle': angle}}; got {shown(motion)[:120]}"
    )


# from a run ---------------------------------------------------------------------------------------------------------
def acceleration_name(velocity: str) -> str:
    """The result that is the rate of a velocity.

    >>> acceleration_name("hip.angle.rate"), acceleration_name("ball.angular_velocity.x")
    ('hip.angle.acceleration', 'ball.angular_velocity.x.acceleration')
    """
    return f"{velocity.removesuffix('.rate')}.acceleration"


def _of_run(equations: Equations, run: Trajectory) -> Motion:
    if run.record.equations is equations:
        return Motion(run.time, run.record.q, run.record.v, run.record.a, run)
    wanted = [*(c.name for c in equations.coordinates), *equations.velocity_names]
    wanted += [acceleration_name(name) for name in equations.velocity_names]
    lacking = [name for name in wanted if name not in run]
    if lacking:
        raise ModelError(
            f"motion: the run of '{run.name}' has no {lacking[0]!r}, a coordinate of '{equations.name}'; give a run "
            "of a model with the same joints"
        )
    columns = np.column_stack([run[name] for name in wanted]) if wanted else np.zeros((len(run), 0))
    n_q, n_v = equations.n_q, equations.n_v
    return Motion(run.time, columns[:, :n_q], columns[:, n_q : n_q + n_v], columns[:, n_q + n_v :], run)


# from arrays --------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class _Column:
    """Given values of a coordinate with what is known of their derivatives."""

    value: Vector
    rate: Vector | None = None
    acceleration: Vector | None = None


def _of_arrays(model: Any, mechanism: Mechanism, given: Mapping[str, Any], changed: Mapping[str, float]) -> Motion:
    equations = mechanism.equations
    unused: list[str] = []
    if isinstance(given, Recording):
        given, unused = _of_recording(equations, given)
    time = _times(given)
    columns = _columns(mechanism.kept(_Names, lambda: _Names(equations)), given, time)
    count, n_q, n_v = len(time), equations.n_q, equations.n_v
    # row by row, as they are given; one table, since the system hands out memory of several slowly
    table = np.zeros((n_q + 2 * n_v, count))
    q, v, a = np.split(table, (n_q, n_q + n_v))
    names = [c.name for c in equations.coordinates]
    missing = [name for name in names if name not in columns]
    whole = equations.configuration
    if missing and all(equations.rows[k].is_velocity for k in equations.bilateral):
        raise ModelError(
            f"motion: the coordinate {missing[0]!r} of '{equations.name}' is missing"
            f"{f', and {len(missing) - 1} more' if missing[1:] else ''}; give values of all of them at the times"
            f"{'; the recording has ' + quoted(unused) if unused else ''}"
        )
    turned, spinning = set[int](), list[tuple[int, slice]]()
    waiting: list[tuple[Vector, Vector | None, Vector | None]] = []
    for joint, first_q, first_v in whole.charts:
        at = first_q + joint.adding
        parts = names[at : at + 4]
        if any(part in missing for part in parts):
            raise ModelError(f"motion: the orientation {parts[0].removesuffix('.w')!r} is missing or incomplete")
        turned |= set(range(at, at + 4))
        for place, part in enumerate(parts, at):
            q[place] = columns[part].value
        own = slice(first_v + joint.adding, first_v + joint.adding + 3)
        spins = [columns[name] for name in equations.velocity_names[own] if name in columns]
        if len(spins) < 3:
            spinning.append((at, own))
        for k, spin in enumerate(spins if len(spins) == 3 else (), own.start):
            v[k] = spin.value
            if spin.acceleration is None:
                waiting.append((v[k], a[k], None))
            else:
                a[k] = spin.acceleration
    places = {int(place): k for k, place in enumerate(whole.places) if place >= 0}
    for place, name in enumerate(names):
        if place in turned or name in missing:
            continue
        column, k = columns[name], places[place]
        q[place] = column.value
        if column.rate is not None:
            v[k] = column.rate
        if column.acceleration is not None:
            a[k] = column.acceleration
        if column.rate is None:
            waiting.append((q[place], v[k], a[k] if column.acceleration is None else None))
        elif column.acceleration is None:
            waiting.append((v[k], a[k], None))
    if not math.isfinite(table.sum()):
        _require_finite(given, time)
    for joint, first_q, _ in whole.charts:
        at = first_q + joint.adding
        make_continuous(q[at : at + 4], names[at].removesuffix(".w"))
    _differentiate(time, q, v, a, waiting, spinning)
    doubt(*_in_degrees(equations, q), *_in_milliseconds(time), of=model)
    remarks = (f"channels that are no coordinates are not used: {quoted(unused)}",) if unused else ()
    motion = Motion(time, q.T, v.T, a.T, None, remarks, bool(spinning or waiting))
    return motion if not missing else _closed(model, mechanism, motion, missing, changed)


def _differentiate(
    time: Vector,
    q: Matrix,
    v: Matrix,
    a: Matrix,
    waiting: Sequence[tuple[Vector, Vector | None, Vector | None]],
    spinning: Sequence[tuple[int, slice]],
) -> None:
    """Derivatives of splines, where they are missing.

    Parameters
    ----------
    waiting : (values, where their first derivatives go, and the second ones)
    spinning : (first place of a quaternion in q, places of its angular velocity in v)
    """
    spline = Spline(time) if waiting or spinning else None
    if spline is None:
        return
    for start in range(0, len(waiting), GROUP):
        group = waiting[start : start + GROUP]
        found = zip(*spline.slopes(np.array([row for row, _, _ in group])), strict=True)
        for (_, *targets), derived in zip(group, found, strict=True):
            for target, values in zip(targets, derived, strict=True):
                if target is not None:
                    target[:] = values
    for start in range(0, len(spinning), GROUP // 4):
        pair = spinning[start : start + GROUP // 4]
        first, second = spline.slopes(np.concatenate([q[at : at + 4] for at, _ in pair]))
        for k, (at, own) in enumerate(pair):
            part = slice(4 * k, 4 * k + 4)
            v[own], a[own] = quaternion_rates(q[at : at + 4], first[part], second[part])


def _in_degrees(equations: Equations, q: Matrix) -> list[str]:
    """Sentences on angles that swing to and fro by more than a turn, as those of a joint do in degrees."""
    wide = np.flatnonzero(q.max(axis=1) - q.min(axis=1) > math.tau)
    return [
        f"motion: {name!r} swings to and fro by {swing:.3g} rad, {swing / math.tau:.1f} turns; "
        "angles are in radians: numpy.radians(…) converts degrees, a file says 'knee.angle [deg]'"
        for name, unit, values in ((equations.coordinates[k].name, equations.coordinates[k].unit, q[k]) for k in wide)
        if unit == "rad" and (swing := in_degrees(values))
    ]


def _in_milliseconds(time: Vector) -> list[str]:
    """A sentence on frames that are seconds apart, as those of cameras are in milliseconds."""
    apart = float(np.median(np.diff(time))) if len(time) > 2 else 0.0
    if not apart > 2.0:  # longer [s] they may be in milliseconds
        return []
    return [f"motion: frames are {apart:g} s apart; times are in seconds, and {apart:g} ms is {apart / 1e3:g} s"]


def _times(given: Mapping[str, Any]) -> Vector:
    if "time" not in given:
        raise ModelError("motion: give the times of its frames under 'time' [s]")
    time = floats(given["time"], "motion: 'time'")
    if time.ndim != 1 or not len(time) or not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0.0):
        raise ModelError("motion: 'time' must be one column of finite, increasing times [s]")
    return time


class _Names:
    """What names of given columns mean, each looked up once."""

    def __init__(self, equations: Equations) -> None:
        spins = [name for name in equations.velocity_names if not name.endswith(".rate")]
        self.names = [*(c.name for c in equations.coordinates), *spins]
        self.known = {spelling: (name, "") for spelling, name in _spellings(self.names).items()}
        ends = "rate", "acceleration"
        self.known |= {
            full: (name, end)
            for spelling, (name, _) in list(self.known.items())
            for end in ends
            if (full := f"{spelling}.{end}") not in self.known
        }
        self._found: dict[str, list[tuple[str, str]]] = {}

    def of(self, key: str) -> list[tuple[str, str]]:
        """Coordinates or velocities by name, of a vector or an orientation several, with '', 'rate', 'acceleration'."""
        found = self._found.get(key)
        if found is None:
            plain, known = "_".join(key.split()), self.known
            several = next(
                ([f"{plain}{end}" for end in ends] for ends in ((".w", ".x", ".y", ".z"), (".x", ".y", ".z"))
                 if all(known.get(f"{plain}{end}", ("", "-"))[1] == "" for end in ends)), [plain],
            )  # fmt: skip
            if not all(part in known for part in several):
                raise UnknownNameError(f"motion: {nearest(key, self.names, 'coordinate', 'The model has')}")
            found = self._found[key] = [known[part] for part in several]
        return found


def _columns(names: _Names, given: Mapping[str, Any], time: Vector) -> dict[str, _Column]:
    """Values by the names of coordinates and of velocities that are no rates."""
    found: dict[str, _Column] = {}
    later: list[tuple[str, str, Vector]] = []
    for key, value in given.items():
        if key == "time":
            continue
        parts = names.of(str(key))
        columns = _values(key, value, time, len(parts))
        for (name, level), column in zip(parts, columns, strict=True):
            if level:
                later.append((name, level, column.value))
            else:
                found[name] = column
    for name, level, values in later:
        if name not in found:
            raise ModelError(f"motion: the {level} of {name!r} is given without its value; give both")
        found[name] = replace(found[name], **{level: values})
    return found


def _of_recording(equations: Equations, recording: Recording) -> tuple[dict[str, Any], list[str]]:
    """Time and the channels of a recording that are coordinates or their rates, and the names of the others."""
    names = [*(c.name for c in equations.coordinates), *equations.velocity_names]
    known = {"_".join(name.split()) for name in names} | set(_spellings(names))
    known |= {stem for stem, _, axis in (name.rpartition(".") for name in known) if axis in ("w", "x", "y", "z")}
    ends = ("", ".rate", ".acceleration")

    def fits(channel: str) -> bool:
        plain = "_".join(channel.split())
        return any(plain.removesuffix(end) in known for end in ends)

    used = {name: values for name, values in recording.channels.items() if fits(name)}
    return {"time": recording.time, **used}, [name for name in recording.channels if name not in used]


def _spellings(names: list[str]) -> dict[str, str]:
    """Names without spaces, and of joints with one coordinate without its label."""
    plain = {"_".join(name.split()): name for name in names}
    owners: dict[str, list[str]] = {}
    for name in plain:
        owners.setdefault(name.rpartition(".")[0], []).append(name)
    return plain | {owner: plain[own[0]] for owner, own in owners.items() if owner and len(own) == 1}


def _values(key: str, value: Any, time: Vector, width: int) -> list[_Column]:
    """One column for each component, checked."""
    if type(value) is np.ndarray and value.dtype == float and width == 1 and value.shape == time.shape:
        return [_Column(value)]
    if isinstance(value, Samples) or is_curve(value):
        curve = value if isinstance(value, Samples) else Samples.of(value, f"motion: {key!r}")
        parts = curve if isinstance(curve, tuple) else curve.components
        if len(parts) != width:
            raise ModelError(f"motion: {key!r} needs {width} components, its Samples have {len(parts)}")
        return [_Column(*(np.asarray(part(time, order), dtype=float) for order in (0, 1, 2))) for part in parts]
    try:
        table = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ModelError(f"motion: the values of {key!r} must be numbers, got {shown(value)[:80]}") from None
    shape = (len(time),) if width == 1 else (len(time), width)
    if table.shape != shape:
        raise ModelError(f"motion: the values of {key!r} must have the shape {shape}, got {table.shape}")
    return [_Column(column) for column in table.reshape(len(time), -1).T]


def _require_finite(given: Mapping[str, Any], time: Vector) -> None:
    """Raise a `ModelError` for the first gap in columns that are given."""
    for key, value in given.items():
        if key == "time" or isinstance(value, Samples) or is_curve(value):
            continue
        table = np.asarray(value, dtype=float)
        wrong = np.flatnonzero(~np.isfinite(table.reshape(len(time), -1)).all(axis=1))
        if len(wrong):
            raise ModelError(
                f"motion: {key!r} has a gap at t = {time[wrong[0]]:.6g} s ({len(wrong)} of {len(time)} frames); fill "
                "it, or leave these frames out"
            )
        if not np.isfinite(np.sum(table)):
            raise ModelError(f"motion: the values of {key!r} are too large, up to {np.abs(table).max():.3g}")


# loops --------------------------------------------------------------------------------------------------------------
def _closed(
    model: Any, mechanism: Mechanism, motion: Motion, missing: list[str], changed: Mapping[str, float]
) -> Motion:
    """The motion with the coordinates that the rows determine."""
    names = [c.name for c in mechanism.equations.coordinates]
    position = {name: float(value) for name, value in zip(names, motion.q[0], strict=True) if name not in missing}
    contacts = [contact.name for contact in mechanism.equations.contacts]

    def assembled() -> tuple[Vector, Vector]:
        start = assemble(model, position=position, open=contacts, parameters=dict(changed))
        return np.array(start.q), start.anchors

    parameters = mechanism.parameters_of(model, changed)
    known = (motion.q, motion.v, motion.a)
    found = close_loops(mechanism, motion.time, known, missing, assembled, parameters)
    refuse_open_loops(found, mechanism.equations, motion.time, missing)
    remarks = (*motion.notes, f"{quoted(missing, 4)} follow from the closed loops")
    return Motion(motion.time, found.q, found.v, found.a, None, remarks)
