"""The consistent state nearest to one that was changed by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mbd.arrays import Vector
from mbd.assembly.consistency import residuals, violations
from mbd.assembly.given_state import given_state
from mbd.assembly.machines import begun_in, stored_anew
from mbd.assembly.orientation import reversed_joints
from mbd.assembly.pose import Posture
from mbd.assembly.posture import capture, close_nearby, close_velocities, position_rows
from mbd.assembly.turns import keep_wrapped
from mbd.equal import EQUAL_RTOL
from mbd.errors import AssemblyError
from mbd.state import State, of_model


def project(model: Any, state: State, parameters: Mapping[str, float] | None = None, backend: str = "auto") -> State:
    """The state nearest to a given one that satisfies all constraints, at its time and with its closed contacts.

    Positions are moved least in the metric of the mass matrix until ``h(q, t) = 0``, then velocities until
    ``B v + h_t = 0``. Where positions hold already, they and the places of touchdown stay as they are, to the bit;
    else closed contacts stick where they are then.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    state : such as ``dataclasses.replace(run.final, v=…)``
    parameters : values that differ from the model's and from those of the state, by name
    backend : see `mbd.simulate`

    Returns
    -------
    State
        with `moved`: how far each coordinate and rate was moved [m, rad, m/s, rad/s].

    Raises
    ------
    ModelError
        if the state is not one of this model, or not of finite numbers.
    AssemblyError
        if no consistent state is near; `mbd.assemble` searches further.

    Examples
    --------
    >>> import mbd, dataclasses
    >>> model = mbd.Model("pendulum on a rod")
    >>> bob = mbd.PointMass("bob", 1.0)
    >>> model.connect(mbd.Translation("place", model.ground.origin, bob.origin))
    >>> model.constrain(mbd.Bilateral("rod", mbd.distance(model.ground.origin, bob.origin), 1.0))
    >>> start = mbd.assemble(model, {"place.x": 0.6, "place.y": -0.8})
    >>> faster = mbd.project(model, dataclasses.replace(start, v=[1.0, 0.0]))
    >>> print(f"{faster['place.x.rate']:.2f} {faster['place.y.rate']:.2f}")
    0.64 0.48
    """
    given = given_state(model, state, parameters, backend)
    mechanism, manager, values = given.mechanism, given.manager, given.values
    equations = mechanism.equations
    state, begun = begun_in(model, mechanism, state)
    q, y = np.array(state.q, dtype=float), np.concatenate([state.v, state.z]).astype(float)
    anchors = np.array(state.anchors, dtype=float)
    anchors = anchors if len(anchors) == mechanism.layout.n_anchors else np.zeros(mechanism.layout.n_anchors)
    flags = manager.flags(state.mode.closed)
    work = Posture(mechanism, manager, values, q.copy(), y.copy(), flags, anchors.copy(), time=state.time)
    _close(work)
    keep_wrapped(work, q, anchors)
    moved = _moved(equations.coordinates, work.q - q) | _moved(
        equations.velocity_names, work.y[: equations.n_v] - y[: equations.n_v]
    )
    nearest = replace(
        state, q=work.q, v=work.y[: equations.n_v].copy(), z=work.y[equations.n_v :].copy(), anchors=work.anchors,
        moved=moved, parameters=given.changed, memory=None,
    )  # fmt: skip
    return of_model(stored_anew(mechanism, nearest, values, begun), model)


def _close(work: Posture) -> None:
    """Close positions where they are off, then velocities.

    Raises
    ------
    AssemblyError
        where rows are left that do not hold.
    """
    active, free = work.active_rows, np.ones(work.equations.n_v, dtype=bool)

    def found() -> Any:
        return residuals(work.mechanism, work.time, work.q, work.y, work.parameters, work.anchors)

    if np.max(np.abs(found()[0, active]), initial=0.0) > EQUAL_RTOL:
        close_nearby(work, position_rows(work), free)
        capture(work)
    close_velocities(work, free)
    speed = float(np.max(np.abs(work.y[: work.equations.n_v]), initial=0.0))
    left = violations(work.equations.rows, active, found(), speed)
    left += reversed_joints(work.mechanism, work.time, work.q, work.parameters, work.anchors)
    if left:
        raise AssemblyError(
            f"no consistent state was found near the given one: {'; '.join(left)}; mbd.assemble(model, position=…, "
            "velocity=…) searches further, and tells which constraints are in conflict"
        )


def _moved(names: Any, change: Vector) -> dict[str, float]:
    """Changes that are more than round-off, by name."""
    named = zip(names, change, strict=True)
    return {getattr(each, "name", each): float(value) for each, value in named if abs(value) > 1e-15}
