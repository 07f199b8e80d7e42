"""Cases j11 and j11b: a table on four legs, a block on two and three points; only the resultant is unique."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.schemes import WITH_ROWS, name_of
from tests.problems import case

J11, J11B = case("j11-four-legged-table"), case("j11b-block-two-contacts")
HALF = 0.5 * J11.definition["side"]
CORNERS = [(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF)]
"""(x, z) of the legs, in the order of the reference [m]."""


def table(order: Sequence[int] = range(4), center: tuple[float, float] = (0.0, 0.0)) -> mbd.Model:
    """A table that may rise and tilt; its legs are contacts, named by number and given in some order."""
    model = mbd.Model("table", gravity=(0.0, -J11.definition["g"], 0.0))
    stem = mbd.PointMass("stem", mass=0.0)
    top = mbd.RigidBody("top", mass=J11.definition["m"], inertia=(1.0, 1.0, 1.0), center=(center[0], 0.0, center[1]))
    model.connect(
        mbd.Prismatic("lift", model.ground.origin, stem.origin, axis=(0, 1, 0)),
        mbd.Universal("tilt", stem.origin, top.origin),
    )
    for k in order:
        x, z = CORNERS[k]
        model.constrain(mbd.Unilateral(f"leg {k}", mbd.height(top.point(x, 0.0, z, name=f"foot {k}"))))
    return model


def block(places: Sequence[float]) -> mbd.Model:
    """A block in the plane on frictionless points."""
    given = J11B.definition
    model = mbd.Model("block", gravity=(0.0, -given["g"], 0.0))
    body = mbd.RigidBody("block", mass=given["m"], inertia=0.2, center=(given["com_x"], 0.1, 0.0))
    model.connect(mbd.Planar("flight", model.ground.origin, body.origin))
    for k, x in enumerate(places):
        model.constrain(mbd.Unilateral(f"point {k}", mbd.height(body.point(x, 0.0, name=f"point {k}"))))
    return model


def rested(model: mbd.Model, contacts: int, scheme: NewmarkFamily) -> tuple[mbd.Trajectory, np.ndarray]:
    """Ten seconds of rest, and the contact forces of every row."""
    names = [f"{'leg' if contacts == 4 else 'point'} {k}" for k in range(contacts)]
    run = mbd.simulate(model, mbd.assemble(model, closed=names), scheme, dt=1e-2, until=10.0)
    assert not run.events, "no leg opens or closes from step to step"
    assert np.max(np.abs(run.record.q - run.record.q[0])) < 1e-10
    return run, np.array([run[f"{name}.force"] for name in names])


@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
def test_a_table_rests_for_ten_seconds_on_forces_of_least_norm(scheme: NewmarkFamily) -> None:
    run, forces = rested(table(), 4, scheme)
    assert forces.sum(axis=0) == pytest.approx(np.full(len(run.time), J11["sum of leg forces"].value), abs=1e-9)
    for k in range(4):
        assert forces[k] == pytest.approx(np.full(len(run.time), J11["minimum-norm leg forces"].value[k]), abs=1e-9)
    low, high = J11["admissible range"].value
    assert low <= forces.min() and forces.max() <= high
    assert np.max(np.abs(run.record.a)) < 1e-11
    (note,) = run.stats["notes"]
    assert note.startswith("redundant constraints: 1 (") and "multipliers are not" in note


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 1, 0, 2), (2, 0, 3, 1)])
def test_a_table_with_its_mass_off_center_carries_exact_moments_in_any_order(order: tuple[int, ...]) -> None:
    """Least norm: p_k = m g (1/4 + x_k x_c/Σx² + z_k z_c/Σz²)."""
    x_c, z_c = 0.11, -0.07
    _, forces = rested(table(order, (x_c, z_c)), 4, mbd.GeneralizedAlpha(0.9))
    weight = J11.definition["m"] * J11.definition["g"]
    wanted = [weight * (0.25 + (x * x_c + z * z_c) / (4.0 * HALF**2)) for x, z in CORNERS]
    assert forces[:, -1] == pytest.approx(wanted, abs=1e-9)


def test_the_redundant_leg_is_named_with_the_other_three() -> None:
    found = mbd.mobility(table(), closed=[f"leg {k}" for k in range(4)])
    assert (found.dof, found.rows, found.rank, found.consistent) == (0, 4, 3, True)
    (row,) = found.dependent
    assert row.row == "'leg 3' (normal)"
    assert dict(row.on) == pytest.approx({f"'leg {k}' (normal)": value for k, value in enumerate((1.0, -1.0, 1.0))})
    assert mbd.mobility(table()).rows == 0, "open legs have no rows"


@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
@pytest.mark.parametrize("points", ["two contacts", "three contacts"])
def test_a_block_rests_on_its_points_with_the_reference_forces(scheme: NewmarkFamily, points: str) -> None:
    places = list(J11B.definition["corners_x"]) + ([J11B.definition["third_x"]] if points == "three contacts" else [])
    run, forces = rested(block(places), len(places), scheme)
    assert forces[:, -1] == pytest.approx(J11B[points].value, abs=1e-8)
    assert forces.sum(axis=0) == pytest.approx(np.full(len(run.time), 4.0 * 9.81), abs=1e-8)
    assert len(run.stats["notes"]) == len(places) - 2
