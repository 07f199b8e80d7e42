"""The table of case j11 with its mass off its center."""

import numpy as np
import pytest

import mbd
from mbd.hardcases.resting import table
from tests.problems import case

J11 = case("j11-four-legged-table")
HALF = 0.5 * J11.definition["side"]
CORNERS = [(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF)]
"""(x, z) of the legs, in the order of the reference [m]."""


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 1, 0, 2), (2, 0, 3, 1)])
def test_a_table_with_its_mass_off_center_carries_exact_moments_in_any_order(order: tuple[int, ...]) -> None:
    """Least norm: p_k = m g (1/4 + x_k x_c/Σx² + z_k z_c/Σz²)."""
    x_c, z_c = 0.11, -0.07
    model, start = table(order=order, center=(x_c, z_c))
    run = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), dt=1e-2, until=10.0)
    assert not run.events, "no leg opens or closes from step to step"
    forces = np.array([run[f"leg {k}.force"] for k in range(4)])
    weight = J11.definition["m"] * J11.definition["g"]
    wanted = [weight * (0.25 + (x * x_c + z * z_c) / (4.0 * HALF**2)) for x, z in CORNERS]
    assert forces[:, -1] == pytest.approx(wanted, abs=1e-9)
