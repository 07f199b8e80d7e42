"""What controllers and resets change during a run, judged as what a model is described with and a run starts from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Vector
from mbd.assembly.consistency import residuals, violations
from mbd.assembly.inertia import undetermined
from mbd.assembly.pose import Posture
from mbd.compile.mechanism import Mechanism
from mbd.compile.trivial_rows import trivial_rows
from mbd.errors import ModelError, SimulationError
from mbd.simulation.run.data import RunData
from mbd.tape.derivatives import live
from mbd.tape.node import Node


def change_parameters(run: RunData, values: Mapping[str, float], what: str) -> None:
    """New parameter values from now on; the scheme restarts from them if they differ.

    Raises
    ------
    SimulationError
        for values with which the mechanism cannot go on; it keeps those that it has. `what` gives them.
    """
    equations = run.mechanism.equations
    present = {parameter.name: v for parameter, v in zip(equations.parameters, run.kernel.params, strict=False)}
    if all(present.get(name) == value for name, value in values.items()):
        return
    faults = parameter_faults(run, values)
    if faults:
        given = ", ".join(f"{name!r} to {value:g}" for name, value in values.items())
        raise SimulationError(f"{what} sets {given}, which cannot be: {'; '.join(faults)}")
    run.stepper.keep_row()
    run.set_parameters({**run.changed, **values})
    run.parameter_changes.append((run.stored + int(run.kernel.n_stored), run.kernel.params.copy()))
    run.kernel.restart_due = 1


def parameter_faults(run: RunData, values: Mapping[str, float]) -> list[str]:
    """What is wrong with new values of parameters at the present state of a run, one sentence each.

    Of the state only what the values may have changed is looked at.
    """
    changed, mechanism = {**run.changed, **values}, run.mechanism
    found: list[str] = run.parameter_check.faults(changed, values)
    equations = mechanism.equations
    inert = not _in(mechanism, "inertia", [equations.kinetic]).isdisjoint(values)
    rows = [node for row in equations.rows for node in (row.value, row.rate)]
    binding = not _in(mechanism, "rows", rows).isdisjoint(values)
    if found or not (inert or binding):
        return found
    parameters = mechanism.parameters_of(run.model, changed)
    if inert:
        v = run.kernel
        q, y, anchors = v.q[: v.n_q].copy(), v.y[: v.n].copy(), np.array(v.anchors)
        flags = v.closed[: v.n_contacts]
        found = undetermined(Posture(mechanism, run.manager, parameters, q, y, flags, anchors, time=run.now))
    if not found and binding:
        found = violations_now(run, residuals_now(run, parameters), residuals_now(run)[:2])
        found = found or _no_longer_trivial(run, parameters)
    return found


def _in(mechanism: Mechanism, what: str, nodes: Sequence[Node]) -> frozenset[str]:
    """Names of the parameters in some expressions of a mechanism, which are looked through once."""

    def found() -> frozenset[str]:
        places = {n.data[1] for n in live(nodes) if n.op == "input" and n.data[0] == "p"}
        return frozenset(p.name for k, p in enumerate(mechanism.equations.parameters) if k in places)

    return mechanism.kept((_in, what), found)


def _no_longer_trivial(run: RunData, parameters: Vector) -> list[str]:
    """Rows that held whatever the motion and do not with these values, or the other way round."""
    try:
        changed = sorted(trivial_rows(run.mechanism, parameters) ^ run.manager.trivial)
    except ModelError as error:
        return [str(error)]
    rows = run.mechanism.equations.rows
    return [
        f"{rows[k].title} {'no longer holds' if k in run.manager.trivial else 'now holds'} whatever the motion: "
        "the mechanism is another; start a run with these values"
        for k in changed
    ]


def residuals_now(run: RunData, parameters: Vector | None = None) -> NDArray[np.float64]:
    """Residuals (`mbd.assembly.consistency`) of the accepted state, with other values of parameters if given."""
    v = run.kernel
    q, y, anchors = v.q[: v.n_q], v.y[: v.n], v.anchors[: v.n_anchors]
    return residuals(run.mechanism, run.now, q, y, v.params if parameters is None else parameters, anchors)


def violations_now(run: RunData, found: NDArray[np.float64], usual: NDArray[np.float64] | None = None) -> list[str]:
    """`mbd.assembly.consistency.violations` of the rows that are active now."""
    v = run.kernel
    active = run.manager.active_rows(v.closed[: v.n_contacts])
    speed = float(np.max(np.abs(v.y[: v.n_v]), initial=0.0))
    return violations(run.mechanism.equations.rows, active, found, speed, usual)
