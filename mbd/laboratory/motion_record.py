"""A motion as rows of a run, with the forces of contacts and frictions that are known."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import Mechanism
from mbd.compile.python import array_function
from mbd.equations.equations import Equations
from mbd.errors import CapabilityError
from mbd.laboratory.motion import Motion
from mbd.results.record import Record
from mbd.results.trajectory import Trajectory


def parameters_of(mechanism: Mechanism, motion: Motion, changed: Mapping[str, float], model: Any) -> Vector | Matrix:
    """The parameters at the frames: those of the run, if it is one of the very same equations, with changes."""
    run = motion.run
    values = mechanism.parameters_of(model, changed)
    if run is None or run.record.equations is not mechanism.equations:
        return values
    own = run.record.parameters_at(np.arange(len(run.time), dtype=np.intp))
    if not changed:
        return own
    places = [k for k, each in enumerate(mechanism.equations.parameters) if each.name in changed]
    own = np.array(own)
    own[..., places] = values[places]
    return own


def record_of(mechanism: Mechanism, motion: Motion, parameters: Vector | Matrix) -> Record:
    """The frames as rows of a run, with the contact and friction forces that are known.

    Those of a run act as they did; contacts of a recorded motion are open, and dry friction of joints slides.
    """
    equations, count = mechanism.equations, len(motion.time)
    several = parameters.ndim == 2
    changes = [(k, parameters[k]) for k in range(1, count)] if several else []
    n_z, rows = equations.n_z, len(equations.rows)
    record = Record(
        equations, parameters[0] if several else parameters, [each.name for each in equations.parameters],
        motion.time, motion.q, motion.v, np.zeros((count, n_z)), motion.a, np.zeros((count, n_z)),
        np.zeros((count, rows)), np.zeros((count, len(equations.contacts)), dtype=np.uint8),
        parameter_changes=changes, phase=np.zeros((count, len(equations.frictions)), dtype=np.int8),
    )  # fmt: skip
    if motion.run is not None:
        return _with_forces(equations, record, motion.run)
    if n_z:
        raise CapabilityError(
            f"inverse dynamics of a recorded motion does not know {equations.states[0].name!r}, a state of a force; "
            "leave the force out by model.without(…), or give a run"
        )
    return _sliding(equations, record) if equations.frictions else record


def _with_forces(equations: Equations, record: Record, run: Trajectory) -> Record:
    """The same with the contacts of a run: multipliers, frictions and states, found by name."""
    other = run.record.equations
    source = run.record
    if other is None:
        if equations.contacts or equations.frictions or equations.n_z:
            raise CapabilityError(
                "motion: contact and friction forces of a run that was read from a file are not known by row; give the "
                "run itself, or a model without contacts"
            )
        return record
    lam, closed = record.lam.copy(), record.closed.copy()
    phase, z, s = record.phase.copy(), record.z.copy(), record.s.copy()
    theirs = {(row.owner, row.part): k for k, row in enumerate(other.rows)}
    bilateral = set(equations.bilateral)
    for k, row in enumerate(equations.rows):
        if k not in bilateral and (row.owner, row.part) in theirs:
            lam[:, k] = source.lam[:, theirs[row.owner, row.part]]
    _copy([c.name for c in equations.contacts], [c.name for c in other.contacts], closed, source.closed)
    _copy(_friction_names(equations), _friction_names(other), phase, source.phase)
    _copy([c.name for c in equations.states], [c.name for c in other.states], z, source.z)
    _copy([c.name for c in equations.states], [c.name for c in other.states], s, source.s)
    same = [c.name for c in other.contacts] == [c.name for c in equations.contacts]
    start = source.start if same and other.n_anchors == equations.n_anchors else None
    return replace(record, lam=lam, closed=closed, phase=phase, z=z, s=s, start=start)


def _friction_names(equations: Equations) -> list[str]:
    return [f"{equations.rows[friction.row].title}" for friction in equations.frictions]


def _copy(names: list[str], others: list[str], into: NDArray[Any], source: NDArray[Any]) -> None:
    places = {name: k for k, name in enumerate(others)}
    for k, name in enumerate(names):
        if name in places:
            into[:, k] = source[:, places[name]]


def _sliding(equations: Equations, record: Record) -> Record:
    """Dry friction of joints slides in the direction of its rate; that of open contacts is off."""
    phase, lam = record.phase.copy(), record.lam.copy()
    always = [k for k, friction in enumerate(equations.frictions) if friction.contact < 0]
    nodes = [equations.frictions[k].rate for k in always] + [equations.frictions[k].sliding for k in always]
    inputs = {
        "t": record.time, "q": record.q, "v": record.v, "z": record.z, "a": record.a, "s": record.s, "lam": record.lam,
        "anchor": np.zeros((len(record.time), equations.n_anchors)), "switch": record.closed,
        "slip": np.zeros_like(phase),
    }  # fmt: skip
    found = array_function(nodes)(inputs, record.parameters_at(np.arange(len(record.time), dtype=np.intp)))
    rates, limits = (dict(zip(always, part, strict=True)) for part in (found[: len(always)], found[len(always) :]))
    for k in always:
        group = equations.frictions[k].group
        size = np.linalg.norm([rates[each] for each in group or (k,)], axis=0)
        moves = size > 0.0
        phase[:, k] = moves if group else np.sign(rates[k])
        way = np.divide(rates[k], size, out=np.zeros_like(rates[k]), where=moves)
        lam[:, equations.frictions[k].row] = way * limits[k]
    return replace(record, phase=phase, lam=lam)
