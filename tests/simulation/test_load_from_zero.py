"""Feet that rest without any load, and a force that grows from zero: with r the pull beyond friction, x″ = r tᵖ/m."""

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd

MASS, MU = 2.0, 0.25
SCHEMES = [
    (mbd.HHT(0.05), {"dt": 1e-3}, 1e-6), (mbd.HHT(0.05, formulation="index3"), {"dt": 1e-3}, 1e-6),
    (mbd.Newmark(), {"dt": 1e-3}, 1e-6), (mbd.RadauIIA(), {"dt": 1e-2}, 1e-11),
    (mbd.RungeKutta853(), {"dt": 1e-2}, 1e-11), (mbd.RungeKutta4(), {"dt": 1e-3}, 1e-11),
    (mbd.RadauIIA(), {"tol": 1e-9}, 1e-8), (mbd.RungeKutta853(), {"tol": 1e-9}, 1e-8),
    (mbd.HHT(0.05), {"dt": 1e-3, "contact": "nonsmooth"}, 1e-6),
]  # fmt: skip
NAMES = [f"{scheme!r} {settings}" for scheme, settings, _ in SCHEMES]


FEET = {
    (1, False): ((0.0, 0.0),), (2, False): ((-0.2, 0.0), (0.2, 0.0)), (3, False): ((-0.2, 0.0), (0.0, 0.0), (0.2, 0.0)),
    (1, True): ((0.0, 0.0),), (3, True): ((0.4, 0.0), (-0.2, 0.35), (-0.2, -0.35)),
}  # fmt: skip


@lru_cache(maxsize=16)
def on_feet(count, space, height, at):
    """A body on feet below its center without gravity, under the load (held + rate t + bend t²) (fx, fy, fz)."""
    model = mbd.Model("unloaded", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("block", MASS, (0.1, 0.1, 0.1))
    model.connect((mbd.Free if space else mbd.Planar)("move", model.ground.origin, body.origin))
    for k, (x, z) in enumerate(FEET[count, space]):
        model.constrain(mbd.Unilateral(f"foot {k}", mbd.touchdown(body.point(x, -height, z)), friction=MU))

    def force(t, held, rate, bend, fx, fy, fz):
        size = held + rate * t + bend * t * t
        return size * fx, size * fy, size * fz

    inputs = ("t", *((name, 0.0) for name in ("held", "rate", "bend", "fx", "fy", "fz")))
    model.apply(mbd.Applied("push", body.point(*at), arguments=inputs, force=force))
    return model, mbd.assemble(model, closed=[f"foot {k}" for k in range(count)])


def loaded(load, power):
    """The parameters of a load times tᵖ."""
    return {f"push.{('held', 'rate', 'bend')[power]}": 1.0} | {
        f"push.f{x}": f for x, f in zip("xyz", load, strict=True)
    }


@pytest.mark.parametrize(("scheme", "steps", "close"), SCHEMES, ids=NAMES)
@settings(max_examples=6)
@given(
    feet=st.integers(1, 3), space=st.booleans(), pressure=st.sampled_from([0.0, 0.4, 1.0]),
    pull=st.sampled_from([-1.0, 0.6, 1.3]), power=st.integers(1, 2), angle=st.sampled_from([0.7, 2.5, 4.0]),
)  # fmt: skip
def test_a_foot_slides_the_way_that_a_force_from_zero_pulls_it(
    scheme, steps, close, feet, space, pressure, pull, power, angle
):
    feet, angle = (1, angle) if space else (feet, 0.0)
    model, start = on_feet(feet, space, 0.0 if feet == 1 else 0.08, (0.0, 0.0, 0.0))
    load = loaded((pull * np.cos(angle), -pressure, pull * np.sin(angle)), power)
    run = mbd.simulate(model, start, scheme, until=1.0, progress=False, parameters=load, **steps)
    size = abs(pull)
    acceleration = max(0.0, size - MU * pressure) / MASS * np.sign(pull)
    end = acceleration / ((power + 1) * (power + 2))
    assert run["move.x"][-1] == pytest.approx(end * np.cos(angle), abs=close)
    if space:
        assert run["move.z"][-1] == pytest.approx(end * np.sin(angle), abs=close)
    assert len(run.events) <= 2 * feet  # each slips, and may open


@pytest.mark.parametrize(("scheme", "steps"), [(scheme, steps) for scheme, steps, _ in SCHEMES[:8]], ids=NAMES[:8])
@settings(max_examples=6)
@given(
    feet=st.sampled_from([(2, False), (3, False), (3, True)]), power=st.integers(1, 2),
    load=st.tuples(st.floats(-1.0, 1.0), st.sampled_from([-1.0, -0.4, 0.0, 0.5]), st.floats(-1.0, 1.0)),
)  # fmt: skip
def test_feet_take_a_load_from_zero_as_they_take_it_at_once(scheme, steps, feet, power, load):
    """v = a tᵖ⁺¹/(p + 1) with the acceleration a under the whole load, as long as the body has hardly moved."""
    model, start = on_feet(*feet, 0.1, (0.15, 0.05, 0.1 * feet[1]))
    whole, end = loaded(load, 0), 0.05
    at_once = mbd.simulate(model, start, mbd.RungeKutta4(), dt=1e-6, until=1e-6, progress=False, parameters=whole)
    part = loaded(load, power)
    run = mbd.simulate(model, start, scheme, until=end, progress=False, parameters=part, **steps)
    expected = at_once.final.v * 1e6 * end ** (power + 1) / (power + 1)
    small = 0.02 * np.abs(expected).max() + 1e-8 * end ** (power + 1)  # index 3 leaves round-off of positions over dt
    np.testing.assert_allclose(run.final.v, expected, rtol=0.0, atol=small)
