"""Angles that no number tells are refused, and turns that steps do not resolve are reported."""

from dataclasses import replace

import numpy as np
import pytest

import mbd
from mbd.assembly.given_state import MAX_ANGLE


def rotor(center=0.0, **more):
    """A wheel, or a pendulum where its centre of mass is off the axis."""
    model = mbd.Model("rotor", **more)
    body = mbd.RigidBody("wheel", mass=1.0, inertia=0.2, center=(0.0, -center, 0.0))
    model.connect(mbd.Revolute("hinge", model.ground.origin, body.origin))
    return model


def spun(model, speed, scheme=None, angle=0.5, **more):
    start = mbd.assemble(model, {"hinge.angle": angle}, {"hinge.angle": speed})
    return mbd.simulate(model, start, scheme, **{"dt": 1e-2, "until": 0.2, **more})


@pytest.mark.parametrize("angle", [1.1 * MAX_ANGLE, -1e17, 1e300])
def test_a_start_at_an_angle_that_no_number_tells_is_refused(angle):
    model = rotor(0.4)
    with pytest.raises(mbd.ModelError, match=r"'hinge.angle' = .* rad, where neighbouring numbers are"):
        spun(model, 0.0, angle=angle)
    start = replace(mbd.assemble(model), q=np.array([angle]))
    with pytest.raises(mbd.ModelError, match="take whole turns away"):
        mbd.simulate(model, start, dt=1e-2, until=0.1)
    assert spun(model, 0.0, angle=1e9).success


@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
@pytest.mark.parametrize("center", [0.0, 0.4])
def test_a_run_that_turns_beyond_all_numbers_ends_in_an_error(scheme, center):
    with pytest.raises(mbd.SimulationError, match=r"'hinge.angle' = .*poses can no longer be told apart"):
        spun(rotor(center), 1e14, scheme)


def of_turns(run):
    """The notes of a run but for what RadauIIA estimates of its errors, which a radian in a step makes."""
    return [note for note in run.stats["notes"] if not note.startswith("estimated errors of velocities")]


@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.GeneralizedAlpha(0.8), mbd.RadauIIA()], ids=repr)
def test_turns_that_steps_do_not_resolve_are_reported_where_the_motion_follows_from_them(scheme):
    rng = np.random.default_rng(11)
    for speed in np.pi / 1e-2 * np.append(rng.uniform(0.1, 0.9, 2), rng.uniform(1.1, 50.0, 3)):
        notes = of_turns(spun(rotor(0.4), speed, scheme))
        assert [note.split(" turns by")[0] for note in notes] == (["'hinge.angle'"] if speed > np.pi / 1e-2 else [])
        assert spun(rotor(), speed, scheme).stats["notes"] == []
        assert spun(rotor(0.4, gravity=(0.0, 0.0, 0.0)), speed, scheme).stats["notes"] == []
    assert "in one step" in of_turns(spun(rotor(0.4), 700.0, scheme, store=2))[0]
    assert of_turns(spun(rotor(0.4), 100.0, scheme, store=20)) == []
