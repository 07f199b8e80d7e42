"""Friction in the equations: exact tangents where it slides, its loss, and nothing where there is none."""

import numpy as np
import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.equations.programs import ActiveSet, balance_with, newton
from mbd.testing.numbers import at, derivative, inputs
from tests.simulation.frictions import brick, four_bar

SCENES = {
    "contacts": brick(0.4), "dry pins": four_bar(mbd.Coulomb(0.4)),
    "load-dependent pins": four_bar(mbd.PinFriction(0.3, 0.05)),
    "both": four_bar(mbd.PinFriction(0.3, 0.05) + mbd.Coulomb(0.2) + mbd.Viscous(0.1)),
}  # fmt: skip
every_scene = pytest.mark.parametrize("model", SCENES.values(), ids=SCENES)


def sliding_point(equations, seed):
    """Random inputs with every friction sliding, one way or the other."""
    point = inputs(equations, seed)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], len(equations.frictions))
    return point | {("slip", k): float(sign) for k, sign in enumerate(signs)}


def held(equations):
    """The rows that act while every friction slides and every contact is closed."""
    return [k for k, row in enumerate(equations.rows) if row.friction < 0]


@every_scene
@pytest.mark.parametrize("stabilized", [False, True])
def test_the_tangent_of_sliding_friction_is_exact(model, stabilized):
    equations = mechanism_of(model).equations
    rows, sliding = held(equations), range(len(equations.frictions))
    n, m = equations.n_v, len(rows)
    r = balance_with(equations, rows, (), sliding)
    program = newton(equations, ActiveSet(rows, (), stabilized, sliding))
    for seed in range(3):
        point = sliding_point(equations, seed)
        c_C, c_K = point["c", 0], point["c", 1]
        K = at(program[: (n + m) ** 2], point).reshape(n + m, n + m)
        size = np.abs(K[:n]).max()
        for j in range(n):
            along = {("a", j): 1.0, ("v", j): c_C, ("x", j): c_K}
            np.testing.assert_allclose(K[:n, j], derivative(r, point, along), rtol=0, atol=1e-7 * size)
        for place, k in enumerate(rows):
            np.testing.assert_allclose(
                K[:n, n + place], derivative(r, point, {("lam", k): 1.0}, 1e-4), rtol=0, atol=1e-7 * size
            )


@every_scene
def test_friction_takes_the_power_of_its_limit_times_the_rate(model):
    """vᵀ (r with friction − r without) = Σ slip limit γ."""
    equations = mechanism_of(model).equations
    rows = held(equations)
    friction = [a - b for a, b in zip(balance_with(equations, rows, (), range(len(equations.frictions))),
                                      balance_with(equations, rows, ()), strict=True)]  # fmt: skip
    for seed in range(3):
        point = sliding_point(equations, seed)
        v = np.array([point["v", k] for k in range(equations.n_v)])
        wanted = sum(
            point["slip", k] * float(at([each.limit], point)[0]) * float(at([each.rate], point)[0])
            for k, each in enumerate(equations.frictions)
        )
        assert v @ at(friction, point) == pytest.approx(wanted, rel=1e-10)


@every_scene
def test_the_limit_is_of_degree_one_in_the_multipliers_but_for_a_constant(model):
    equations = mechanism_of(model).equations
    point = sliding_point(equations, 1)
    values = [
        at([each.limit for each in equations.frictions],
           point | {("lam", k): scale * point["lam", k] for k in range(len(equations.rows))})
        for scale in (0.0, 1.0, 2.0)
    ]  # fmt: skip
    np.testing.assert_allclose(values[2] - values[0], 2.0 * (values[1] - values[0]), rtol=1e-6)
