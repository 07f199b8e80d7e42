"""A step in which an angle turns by more than half a turn says so where forces or masses follow from the angle."""

import pytest

import mbd


def spinning(gravity, center):
    model = mbd.Model("spinning rod", gravity=(0.0, gravity, 0.0))
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=center, inertia=10.0)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))
    return model


def notes(model, rate, scheme, **options):
    start = mbd.assemble(model, velocity={"pin.angle": rate})
    run = mbd.simulate(model, start, scheme, until=2.0, **options)
    return [note for note in run.stats["notes"] if "'pin.angle' turns by up to" in note]


@pytest.mark.parametrize("scheme", [mbd.Newmark(), mbd.HHT(0.05), mbd.RadauIIA()], ids=repr)
@pytest.mark.parametrize("store", [1, 4])
def test_an_angle_that_steps_do_not_resolve_is_told_where_forces_follow_from_it(scheme, store):
    heavy, free = spinning(-9.81, 0.5), spinning(0.0, 0.0)
    assert notes(heavy, 2.0, scheme, dt=0.05, store=store) == []  # 0.1 rad
    assert notes(heavy, 36.0, scheme, dt=0.05, store=store) == []  # just below half a turn
    told = notes(heavy, 80.0, scheme, dt=0.05, store=store)  # 4 rad
    assert len(told) == 1
    assert "turns by up to 4" in told[0] and "use dt below 0.004 s" in told[0]
    assert notes(free, 80.0, scheme, dt=0.05, store=store) == []  # nothing follows from its angle


def test_schemes_that_estimate_that_error_say_nothing():
    heavy = spinning(-9.81, 0.5)
    assert notes(heavy, 80.0, mbd.RungeKutta853(), dt=0.05) == []
    assert notes(heavy, 80.0, mbd.RadauIIA(), tol=1e-6) == []
