"""Rows that turn fast beside others that turn with them are never taken for a singular configuration."""

import random

import pytest

import mbd


def box_on_a_cart(seed: int) -> tuple[mbd.Model, mbd.State]:
    """A box that turns fast about a pin on a cart, in Cartesian coordinates: rows x and y of one pin never depend."""
    rng = random.Random(seed)
    model = mbd.Model("box on a cart")
    cart = mbd.RigidBody("cart", mass=rng.uniform(0.5, 5.0), inertia=1.0)
    box = mbd.RigidBody("box", mass=rng.uniform(0.5, 3.0), inertia=10.0 ** rng.uniform(-2.5, -0.5))
    corner = box.point(rng.uniform(-0.4, 0.4), -rng.uniform(0.1, 0.4), name="corner")
    model.connect(
        mbd.Prismatic("rail", model.ground.origin, cart.origin, stiffness=rng.choice([0.0, 50.0])),
        mbd.Planar("free", model.ground.origin, box.origin),
        mbd.Revolute("pin", cart.point(0.0, 0.1, name="top"), corner),
    )
    turn = rng.choice([-1.0, 1.0]) * rng.uniform(5.0, 25.0)
    start = mbd.assemble(
        model, position={"free.angle": rng.uniform(-3.0, 3.0)}, project=True,
        velocity={"free.angle": turn, "rail.displacement": rng.uniform(-2.0, 2.0)},
    )  # fmt: skip
    return model, start


@pytest.mark.parametrize("scheme", [mbd.HHT(0.3), mbd.Newmark(), mbd.GeneralizedAlpha(0.6)], ids=repr)
@pytest.mark.parametrize("seed", range(8))
def test_a_body_that_turns_fast_about_a_pin_passes_no_singular_configuration(seed, scheme):
    model, start = box_on_a_cart(seed)
    for dt in (5e-3, 0.02, 0.04):
        run = mbd.simulate(model, start, scheme, dt=dt, until=1.0, on_failure="return")
        assert run.stats["singular_steps"] == 0
        assert run.violation.length < 1e-9
