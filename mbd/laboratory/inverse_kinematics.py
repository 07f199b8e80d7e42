"""Motion from markers: the postures of a model nearest to what the cameras saw."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.assembly.assemble import assemble
from mbd.bodies.marker import Marker
from mbd.bodies.values import named_number_faults, number, shown
from mbd.compile.mechanism import Mechanism
from mbd.compile.mechanisms import mechanism_of
from mbd.equations.equations import Equations
from mbd.errors import ModelError, nearest, quoted
from mbd.joints.free import Free
from mbd.laboratory.kinematics_result import InverseKinematics, stops_of
from mbd.laboratory.marker_program import MarkerProgram, marker_program, point_names
from mbd.laboratory.models.osim_elements import plain
from mbd.laboratory.nearest_posture import Problem, nearest_postures
from mbd.laboratory.recording import Recording
from mbd.notes import doubt
from mbd.state import State

MIN_DISTANCE = 0.02
"""Distance of two markers on a body from which on their distances are compared with the model's [m]."""
UNIT_RATIOS = (0.1, 10.0)
"""Distances of markers on a body over those of the model that may be in the same unit [-]."""
MAX_MARKER_ERROR = 0.05
"""Distance of a marker from its place, more than skin moves over bones, above which names or units may differ [m]."""


def inverse_kinematics(
    model: Any,
    recording: Recording,
    markers: Mapping[str, Any] | None = None,
    *,
    weights: Mapping[str, float] | None = None,
    coordinates: Mapping[str, Any] | None = None,
    start: State | None = None,
    cutoff: float | None = None,
    parameters: Mapping[str, float] | None = None,
    backend: str = "auto",
) -> InverseKinematics:
    """The motion of a model whose markers come nearest to those of a recording.

    At each frame ``Σ w² |p(q) − p_measured|² + Σ w² (q_k − q_measured)²`` is least, while the rows of closed loops and
    constraints hold and the stops of joints are not passed:

    1. The first frame with most markers starts from `start`, or from the assembled model with a floating body laid onto
       the markers (W. Kabsch, Acta Cryst. A 32 (1976) 922).
    2. Each other frame starts from those beside it. Gauss–Newton steps ``(JᵀWJ) x = −JᵀW r``, with the exact J of the
       model and multipliers for the rows, are halved while they do not come nearer. Markers that are missing are left
       out of their frames.
    3. Further Gauss–Newton steps of all frames at once, until their error is below 1e-10 m or rad.
    4. Velocities and accelerations are those of splines through the coordinates.

    Parameters
    ----------
    model : a `Model`
    recording : see `mbd.read`; its markers in meters
    markers : {name in the recording: point of the model or its name}; by default the markers of the recording that have
        the name of a point of the model (`mbd.Marker`)
    weights : w by the name of a marker (1 unless given; 0 leaves it out) or of a coordinate below (1 m or rad)
    coordinates : {'left knee.angle': measured}: values (R,) or the name of a channel, followed with their weight
    start : posture from which the first frame begins; where it is far from the markers another minimum may be found
    cutoff : of a filter without lag for the coordinates before their rates are taken [Hz]; None: no filter
    parameters : values that differ from those of the model

    Raises
    ------
    ModelError
        for markers that the model or the recording lacks, weights that are none, a frame without markers, and a
        posture that Newton's method does not find.
    """
    # what is compared with what
    if not isinstance(recording, Recording):
        raise ModelError(
            f"recording: what mbd.read gives, or a mbd.Recording, is expected, got {shown(recording)[:80]}"
        )
    if faults := [*named_number_faults(weights, "weights"), *named_number_faults(parameters, "parameters")]:
        raise ModelError(faults)
    cutoff = None if cutoff is None else number(cutoff, "cutoff of inverse_kinematics")
    if cutoff is not None and not (cutoff > 0.0 and len(recording.time) >= 5):
        raise ModelError(
            f"cutoff must be positive [Hz], with 5 frames at least; got {cutoff!r}, {len(recording.time)} frames"
        )
    mechanism = mechanism_of(model, backend, parameters)
    equations = mechanism.equations
    notes: list[str] = []
    points = point_names(equations, _pairs(model, equations, recording, markers, notes))
    followed = _followed(equations, recording, coordinates)
    size = _weights(weights, [*points, *followed])
    # rows that hold, and stops that must not be passed
    rows = [k for k in equations.bilateral if not equations.rows[k].is_velocity]
    gaps = stops_of(equations)
    program = marker_program(mechanism, list(points.values()), list(followed), rows, gaps)
    _in_meters(model, recording, points)
    problem = _problem(program, recording, points, followed, size, len(rows), len(gaps))
    values = mechanism.parameters_of(model, parameters or {})
    # the first frame, then all others
    first = _first(problem, recording)
    begin = _begin(model, mechanism, problem, recording, points, first, start, parameters, values)
    try:
        found = nearest_postures(problem, recording.time, begin, first, values, mechanism)
    except ModelError as error:
        hint = _in_other_units(problem, list(points), begin, first, float(recording.time[first]), values)
        raise ModelError(f"{error}{hint}") from None
    result = InverseKinematics.of(
        mechanism, values, recording.time, found, problem, list(points), list(followed), cutoff, notes
    )
    far = _far(result, {name: size[name] for name in points})
    doubt(*far, of=model)
    result.notes += tuple(far)
    return result


def _pairs(
    model: Any, equations: Equations, recording: Recording, markers: Mapping[str, Any] | None, notes: list[str]
) -> dict[str, Any]:
    """Points of the model by the markers of the recording."""
    if markers is None:
        known = {name.removesuffix(".x") for name in equations.output_names() if name.endswith(".x")}
        found = _by_name(recording.markers, known, notes)
        rest = [name for name in recording.markers if name not in found]
        if not found:
            raise ModelError(
                "markers: no marker of the recording has the name of a point of the model; give {name: point}, or name "
                f"points such as mbd.Marker({next(iter(recording.markers), 'RHEE')!r}, foot, (0.1, 0.0))"
            )
        if rest:
            notes.append(f"{len(rest)} markers are no points of the model: {quoted(rest, 5)}")
        own = [frame.name for frame in getattr(model, "markers", ()) if isinstance(frame, Marker)]
        absent = [name for name in own if name not in found.values()]
        if absent:
            notes.append(f"the recording lacks markers of the model: {quoted(absent, 5)}")
        return found
    if not isinstance(markers, Mapping) or not markers:
        raise ModelError(
            f"markers must map names of the recording to points, {{'RHEE': foot.heel}}, got {shown(markers)}"
        )
    for name in markers:
        if name not in recording.markers:
            raise ModelError(f"markers: {nearest(str(name), recording.markers, 'marker', 'The recording has')}")
    return dict(markers)


def _by_name(markers: Mapping[str, Any], known: set[str], notes: list[str]) -> dict[str, Any]:
    """Points of the model by the markers that are called like them, or like them behind a subject: 'Anna:LASI'."""
    found: dict[str, Any] = {}
    subjects: set[str] = set()
    for name in markers:
        subject, _, rest = name.rpartition(":")
        spellings = (name, plain(name), *((rest, plain(rest)) if subject else ()))
        point = next((each for each in spellings if each in known), None)
        if point is None:
            continue
        if subject and point not in spellings[:2]:
            subjects.add(subject)
        if point in found.values():
            raise ModelError(
                f"markers: two markers of the recording are {point!r} of the model, one of them {name!r}; give "
                "{name: point}"
            )
        found[name] = point
    if subjects:
        notes.append(f"markers are those behind the subject {', '.join(map(repr, sorted(subjects)))}")
    return found


def _in_meters(model: Any, recording: Recording, points: Mapping[str, Any]) -> None:
    """Refuse markers whose distances on one body are far from those of the model, as those in other units are."""
    known = {frame.full_name: frame for frame in getattr(model, "markers", ())}
    own = [(name, known.get(point if isinstance(point, str) else getattr(point, "full_name", ""))) for name, point in
           points.items()]  # fmt: skip
    ratios: list[float] = []
    for k, (name, frame) in enumerate(own):
        for other, second in own[k + 1 :]:
            if frame is None or second is None or second.body is not frame.body:
                continue
            apart = math.dist(frame.offset, second.offset)
            seen = np.linalg.norm(recording.markers[name] - recording.markers[other], axis=1)
            if apart > MIN_DISTANCE and np.isfinite(seen).any():
                ratios.append(float(np.nanmedian(seen)) / apart)
    ratio = float(np.median(ratios)) if ratios else 1.0
    if not UNIT_RATIOS[0] < ratio < UNIT_RATIOS[1]:
        raise ModelError(
            f"markers: they lie {ratio:.3g} times as far from each other on a body as in the model; are they in "
            "meters? mbd.read turns the units of files into meters"
        )


def _far(found: InverseKinematics, weights: Mapping[str, float]) -> list[str]:
    """A sentence on markers that stay far from where the model has them, by names, units or axes that differ."""
    away = {
        name: float(np.sqrt(np.nanmean(found.residual[name] ** 2)))
        for name, weight in weights.items()
        if weight >= 1.0 and np.isfinite(found.residual[name]).any()
    }
    far = [name for name, size in away.items() if size > MAX_MARKER_ERROR]
    if not far:
        return []
    worst = max(far, key=lambda name: away[name])
    return [
        f"inverse_kinematics: marker {worst!r} is {away[worst]:.2g} m from its place on the model (rms; {len(far)} of "
        f"{len(away)} markers are beyond {MAX_MARKER_ERROR:g} m): names, units, sizes of segments or axes differ; "
        "up= and forward= of mbd.read say how a file has them"
    ]


def _followed(equations: Equations, recording: Recording, coordinates: Mapping[str, Any] | None) -> dict[str, Vector]:
    """Measured values of coordinates (R,), by name."""
    places = equations.configuration.places
    names = [equations.coordinates[int(place)].name for place in places if place >= 0]
    found = {}
    if coordinates is not None and not isinstance(coordinates, Mapping):
        raise ModelError(f"coordinates must map names to measured values, got {shown(coordinates)[:80]}")
    for name, given in (coordinates or {}).items():
        if name not in names:
            raise ModelError(f"coordinates: {nearest(str(name), names, 'coordinate', 'The model has')}")
        values = recording[given] if isinstance(given, str) else given
        try:
            column = np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            raise ModelError(f"coordinates: the values of {name!r} must be numbers, got {shown(given)[:80]}") from None
        if column.shape != recording.time.shape:
            raise ModelError(
                f"coordinates: {name!r} needs a value for each of the {len(recording.time)} frames, got the shape "
                f"{column.shape}"
            )
        found[name] = column
    return found


def _weights(weights: Mapping[str, float] | None, names: Sequence[str]) -> dict[str, float]:
    found = dict.fromkeys(names, 1.0)
    for name, value in (weights or {}).items():
        if name not in found:
            raise ModelError(f"weights: {nearest(str(name), names, 'marker', 'There are')}")
        found[name] = number(value, f"the weight of {name!r}")
        if found[name] < 0.0:
            raise ModelError(f"weights: that of {name!r} must not be negative, got {value!r}")
    return found


def _problem(
    program: MarkerProgram, recording: Recording, points: Mapping[str, str], followed: Mapping[str, Vector],
    weights: Mapping[str, float], rows: int, gaps: int,
) -> Problem:  # fmt: skip
    """What was measured, with the weight of each component at each frame: 0 where it is missing."""
    count = len(recording.time)
    measured = np.concatenate(
        [recording.markers[name] for name in points] + [column[:, np.newaxis] for column in followed.values()], axis=1
    )
    weight = np.concatenate([np.repeat([weights[name] for name in points], 3), [weights[name] for name in followed]])
    missing = ~np.isfinite(measured)
    for k in range(len(points)):
        missing[:, 3 * k : 3 * k + 3] |= missing[:, 3 * k : 3 * k + 3].any(axis=1, keepdims=True)
    weight = np.where(missing | program.fixed[: measured.shape[1]], 0.0, np.broadcast_to(weight, (count, len(weight))))
    empty = np.flatnonzero(~(weight > 0.0).any(axis=1))
    if len(empty):
        raise ModelError(
            f"no marker is seen at t = {recording.time[empty[0]]:.6g} s ({len(empty)} of {count} frames); cut them "
            "off by recording.between(…), or fill the gaps by recording.filled(…)"
        )
    return Problem(program, np.where(missing, 0.0, measured), np.asarray(weight), rows, gaps)


def _first(problem: Problem, recording: Recording) -> int:
    """The first frame with as many components as any."""
    seen = (problem.weight > 0.0).sum(axis=1)
    return int(np.argmax(seen)) if len(recording.time) else 0


def _in_other_units(problem: Problem, names: Sequence[str], q: Vector, first: int, time: float, values: Vector) -> str:
    """What distances between markers tell where no posture is near: other units of all or of one; often nothing."""
    y, _ = problem.program.at_all(np.array([time]), q[np.newaxis], values)
    count = 3 * len(names)
    model, seen = y[0, :count].reshape(-1, 3), problem.measured[first, :count].reshape(-1, 3)
    known = problem.weight[first, :count:3] > 0.0
    if known.sum() < 3:
        return ""
    apart = [np.linalg.norm(each[known, np.newaxis] - each[known], axis=2) for each in (seen, model)]
    ratios = np.median(apart[0], axis=1) / np.maximum(np.median(apart[1], axis=1), MIN_DISTANCE)
    whole = float(np.median(ratios))
    if not UNIT_RATIOS[0] < whole < UNIT_RATIOS[1]:
        return f". Markers lie {whole:.3g} times as far from each other as in the model; are they in meters?"
    own = [name for name, is_known in zip(names, known, strict=True) if is_known]
    far = int(np.argmax(np.abs(np.log(np.maximum(ratios, 1e-9)))))
    if not UNIT_RATIOS[0] < float(ratios[far]) < UNIT_RATIOS[1]:
        farther = f"{ratios[far]:.3g} times as far from the others as in the model"
        return f". Marker {own[far]!r} lies {farther}; is it in meters?"
    return ""


def _begin(
    model: Any, mechanism: Mechanism, problem: Problem, recording: Recording, points: Mapping[str, str], first: int,
    start: State | None, parameters: Mapping[str, float] | None, values: Vector,
) -> Vector:  # fmt: skip
    """Coordinates (n_q,) from which the first frame begins."""
    equations = mechanism.equations
    if start is not None:
        if not isinstance(start, State) or len(start.q) != equations.n_q:
            raise ModelError(f"start: a state of '{equations.name}' is expected, such as mbd.assemble(model)")
        return np.array(start.q, dtype=float)
    contacts = [contact.name for contact in equations.contacts]
    q = np.array(assemble(model, open=contacts, parameters=dict(parameters or {})).q, dtype=float)
    for joint, first_q, first_v in equations.configuration.charts:
        if isinstance(joint, Free) and first_v == 0:
            return _laid(problem, q, first_q, first, float(recording.time[first]), values, len(points))
    return q


def _laid(problem: Problem, q: Vector, place: int, first: int, time: float, values: Vector, markers: int) -> Vector:
    """The posture with its floating body turned and shifted so that its markers lie on those measured."""
    y, _ = problem.program.at_all(np.array([time]), q[np.newaxis], values)
    model = y[0, : 3 * markers].reshape(-1, 3)
    seen = problem.measured[first, : 3 * markers].reshape(-1, 3)
    weight = problem.weight[first, : 3 * markers : 3] ** 2
    if (weight > 0.0).sum() < 3:
        return q
    a, b = (np.average(part, axis=0, weights=weight) for part in (model, seen))
    U, _, V = np.linalg.svd(((model - a) * weight[:, np.newaxis]).T @ (seen - b))
    sign = np.sign(np.linalg.det(V.T @ U.T)) or 1.0
    R = V.T @ np.diag([1.0, 1.0, sign]) @ U.T
    out = q.copy()
    out[place : place + 3] = b + R @ (q[place : place + 3] - a)
    out[place + 3 : place + 7] = _product(_quaternion(R), q[place + 3 : place + 7])
    return out


def _quaternion(R: Matrix) -> NDArray[np.float64]:
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(R).as_quat()
    return np.array([w, x, y, z])


def _product(p: Vector, q: Vector) -> Vector:
    """p ⊗ q."""
    a, b = p[1:], q[1:]
    return np.concatenate([[p[0] * q[0] - a @ b], p[0] * b + q[0] * a + np.cross(a, b)])
