"""Balls on planes: they slide on a parabola and roll, and keep rolling, or slip, down a slope."""

from functools import lru_cache

import numpy as np
import pytest

import mbd

UP = mbd.Plane(normal=(0.0, 0.0, 1.0))


@lru_cache(maxsize=8)
def ball(mass, radius, friction, slope=0.0):
    """A homogeneous ball on a plane, the place z up; on a slope down along x."""
    model = mbd.Model("ball", gravity=(9.81 * np.sin(slope), 0.0, -9.81 * np.cos(slope)))
    body = mbd.RigidBody("ball", mass, (0.4 * mass * radius**2,) * 3)
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    model.constrain(mbd.Unilateral("cloth", mbd.sphere_touchdown(body.origin, radius, UP), friction=friction))
    return model


def rolled(model, place, velocity, spin, scheme, **how):
    speeds = dict(zip(("float.x.rate", "float.y.rate"), velocity, strict=True)) | {"float.angular_velocity": spin}
    places = dict(zip(("float.x", "float.y", "float.z"), place, strict=True))
    start = mbd.assemble(model, position=places, velocity=speeds, closed="cloth")
    return mbd.simulate(model, start, scheme, **how)


def end(run):
    return np.array([run["float.x"][-1], run["float.y"][-1]])


def test_a_billiard_ball_slides_on_a_parabola_until_it_rolls():
    """Coriolis 1835: u₀ = v + ω × (−r n) keeps its direction and is gone after 2 ‖u₀‖/(7 μ g)."""
    model, rest, place = ball(0.17, 0.028575, 0.2), 0.35321669967666464, (0.9454457236161168, -0.13444809373354089)
    errors = []
    for scheme, how in (
        (mbd.HHT(0.05), {"dt": 4e-3}), (mbd.HHT(0.05), {"dt": 2e-3}),
        (mbd.RadauIIA(), {"dt": 2e-3}), (mbd.RungeKutta853(), {"dt": 2e-3}),
    ):  # fmt: skip
        run = rolled(model, (0.0, 0.0, 0.028575), (1.5, 0.0), (20.0, -30.0, 45.0), scheme, until=1.0, **how)
        assert [event.kind for event in run.events] == ["stuck"]
        lost = run.energy["total"][-1] - run.energy["total"][0] + 0.14287868116071428
        errors.append(np.abs([run.events[0].time - rest, *(end(run) - place), lost]))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)
    assert np.max(errors[2]) < 1e-8
    assert np.max(errors[3]) < 1e-10


@pytest.mark.parametrize("friction", [None, 0.11])
def test_a_ball_rolls_down_a_slope_where_friction_holds(friction):
    """a = 5/7 g sin α while μ ≥ 2/7 tan α = 0.104; its spin about the normal stays."""
    model = ball(0.5, 0.05, friction, 0.35)
    run = rolled(model, (0.0, 0.0, 0.05), (-0.8, 0.6), (-12.0, -16.0, 25.0), mbd.RadauIIA(), dt=2e-3, until=1.5)
    assert not run.events
    assert end(run) == pytest.approx([1.5030756625215895, 0.9], abs=1e-8)
    assert run["cloth.friction.forward"][-1] == pytest.approx(-0.4805467844482825, abs=1e-9)


@pytest.mark.parametrize("how", [{"tol": 1e-8}, {"dt": 4e-3}])
def test_with_less_friction_it_slips_from_the_start(how):
    model = ball(0.5, 0.05, 0.08, 0.35)
    run = rolled(model, (0.0, 0.0, 0.05), (0.0, 0.6), (-12.0, 0.0, 25.0), mbd.RadauIIA(), until=1.0, **how)
    fall = 9.81 * (np.sin(0.35) - 0.08 * np.cos(0.35))
    assert end(run) == pytest.approx([0.5 * fall, 0.6], abs=1e-8)


def test_what_is_no_ball_is_refused_by_name():
    body = mbd.RigidBody("ball", 1.0, (1.0, 1.0, 1.0))
    with pytest.raises(mbd.ModelError, match="the ground is a mbd.Ball, a mbd.Plane"):
        mbd.sphere_touchdown(body.origin, 0.1, "table")
