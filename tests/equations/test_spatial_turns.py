"""Angles of cut joints in space count turns where forces, rows, stops or events depend on them."""

import numpy as np
import pytest

import mbd
from mbd.equations import derive

X, Y, Z = np.eye(3).tolist()


def shafts(cut="auto", sees=True):
    """Two inclined shafts joined by two universal joints, driven, with a wound spring and an event on the second."""
    model = mbd.Model("shafts", gravity=(0.0, -1.0, 0.0), cut=cut)
    a, b, c = (mbd.RigidBody(name, mass=1.0, inertia=(0.02, 0.03, 0.025)) for name in "abc")
    bearing = model.ground.point(1.3, 0.2, 0.15).turned(0.35, (0.2, 0.3, 0.9))
    model.connect(
        mbd.Revolute("drive", model.ground.origin, a.origin, axis=X),
        mbd.Universal("first", a.point(0.5, 0.0, 0.0), b.origin, axis=Y, second_axis=Z),
        mbd.Universal("second", b.point(0.6, 0.0, 0.0), c.origin, axis=Y, second_axis=Z),
        mbd.Cylindrical("output", bearing, c.origin, axis=X),
    )
    model.apply(mbd.Motor("torque", model.joints[0], 0.5))
    if sees:
        model.apply(
            mbd.Potential("spring", lambda q: 0.01 * (q - 3.0) ** 2, arguments=("output.angle",)),
            mbd.Potential("other spring", lambda q: 0.005 * (q - 1.0) ** 2, arguments=("drive.angle",)),
        )
        model.constrain(mbd.Event("second turn", mbd.measure(lambda q: q - 12.0, "output.angle")))
    return model


def turned(cut, integrator, **settings):
    model = shafts(cut)
    start = mbd.assemble(model, position={"drive.angle": 7.0, "output.angle": OUTPUT})
    return mbd.simulate(model, start, integrator, until=2.5, **settings)


OUTPUT = mbd.simulate(
    shafts(), mbd.assemble(shafts(), position={"drive.angle": 7.0}), mbd.HHT(), dt=1e-3, until=1e-3, backend="python"
)["output.angle"][0]
"""The angle of the output shaft that belongs to 7 rad of the drive."""


def test_forces_and_events_see_the_same_angles_under_every_cut():
    whole = turned("auto", mbd.RungeKutta853(), tol=1e-6)
    assert whole["output.angle"][-1] > 4.0 * np.pi and [event.name for event in whole.events] == ["second turn"]
    for cut, integrator, settings in (
        (["output"], mbd.RungeKutta853(), {"tol": 1e-6}),
        (["output"], mbd.HHT(), {"dt": 1e-3}),
        (["drive"], mbd.RadauIIA(), {"tol": 1e-6}),
    ):
        run = turned(cut, integrator, **settings)
        assert run["drive.angle"][0] == pytest.approx(7.0, abs=1e-9)
        assert run["output.angle"][0] == pytest.approx(OUTPUT, abs=1e-9)
        for name in "drive.angle", "output.angle", "output.angle.rate", "potential_energy":
            assert run[name][-1] == pytest.approx(whole[name][-1], rel=1e-4), (cut, name)
        assert run.events[0].time == pytest.approx(whole.events[0].time, abs=1e-4)


def test_an_angle_that_nothing_depends_on_costs_no_coordinate():
    """A prescribed rotation compares modulo a turn, and needs none either."""
    assert [len(derive(shafts(["output"], sees)).coordinates) for sees in (False, True)] == [5, 6]
    driven = mbd.Model("driven", cut=["drive"])
    driven.connect(*shafts(["drive"], sees=False).joints)
    driven.constrain(mbd.Bilateral("turned", driven.joints[0], value=lambda t: 2.0 * t))
    assert len(derive(driven).coordinates) == 6


def test_results_count_turns_of_angles_that_nothing_depends_on_as_if_another_joint_were_cut():
    found = []
    for cut in ["first"], ["output"]:
        model = shafts(cut, sees=False)
        named = {"drive.angle": 7.0, "output.angle": OUTPUT}
        start = mbd.assemble(model, position=named, velocity={"drive.angle": 12.0})
        found.append(mbd.simulate(model, start, mbd.HHT(), dt=8e-3, until=0.7, backend="python"))
    whole, run = found
    assert whole["output.angle"][-1] > whole["output.angle"][0] + 2.0 * np.pi
    times = np.linspace(0.0, 0.7, 57)
    np.testing.assert_allclose(run["output.angle"], whole["output.angle"], atol=0.02)
    np.testing.assert_allclose(run.at(times)["output.angle"], whole.at(times)["output.angle"], atol=0.02)


def spindle(torque=0.0):
    """A hinge and a sleeve on one axis; the angle of the hinge is a mere result."""
    model = mbd.Model("spindle", gravity=(0.0, 0.0, 0.0), cut=["hinge"])
    shaft = mbd.RigidBody("shaft", mass=1.0, inertia=(0.1, 0.1, 0.1))
    model.connect(
        mbd.Revolute("hinge", model.ground.origin, shaft.origin, axis=(0.6, 0.0, 0.8)),
        mbd.Cylindrical("sleeve", model.ground.origin, shaft.origin, axis=(0.6, 0.0, 0.8)),
    )
    model.apply(mbd.Potential("spring", lambda q: 0.5 * torque * q * q, arguments=("sleeve.angle",)))
    return model


def spun(model, until, start=None, **settings):
    if start is None:
        start = mbd.assemble(model, position={"hinge.angle": 20.0}, velocity={"sleeve.angle": 30.0})
    return mbd.simulate(model, start, mbd.HHT(), dt=0.01, until=until, backend="python", **settings)


def test_counted_turns_are_kept_between_rows_in_files_and_in_the_states_from_which_a_run_goes_on(tmp_path):
    model = spindle()
    run = spun(model, 1.0)
    np.testing.assert_allclose(run["hinge.angle"], 20.0 + 30.0 * run.time, rtol=1e-9)
    times = np.linspace(0.0, 1.0, 333)
    np.testing.assert_allclose(run.at(times)["hinge.angle"], 20.0 + 30.0 * times, rtol=1e-9)
    run.save(tmp_path / "run.mbd")
    read = mbd.load(tmp_path / "run.mbd")
    assert np.array_equal(read["hinge.angle"], run["hinge.angle"])
    assert np.array_equal(read.at(times)["hinge.angle"], run.at(times)["hinge.angle"])
    half = spun(model, 0.5)
    rest = spun(model, 1.0, half.final)
    assert rest["hinge.angle"][0] == half["hinge.angle"][-1]
    assert rest["hinge.angle"][-1] == run["hinge.angle"][-1]
    assert np.array_equal(rest.final.anchors, run.final.anchors)
    seen = []
    spun(model, 1.0, observers=[lambda t, state: seen.append(20.0 + 30.0 * t - 2.0 * np.pi * state.anchors[0])])
    assert np.all(np.abs(seen) <= np.pi + 1e-9)


def test_turns_between_rows_too_far_apart_are_told_to_be_a_guess():
    """A shaft that swings by three turns three times a second, stored six times a second."""
    model = spindle(torque=40.0)
    start = mbd.assemble(model, velocity={"sleeve.angle": 200.0})
    notes = [spun(model, 1.0, start, **settings).stats["notes"] for settings in ({}, {"store": 17})]
    told = [any("whole turns are a guess of 'hinge.angle'" in note for note in each) for each in notes]
    assert told == [False, True]


def press(cut, pitch, wound):
    """A nut on a thread along an inclined axis, held up by a guide: one degree of freedom, in a loop."""
    model = mbd.Model("press", gravity=(0.3, -2.0, 0.5), cut=cut)
    nut = mbd.RigidBody("nut", mass=1.0, inertia=(0.02, 0.03, 0.025))
    head = mbd.RigidBody("head", mass=0.7, inertia=(0.02, 0.02, 0.02))
    model.connect(
        mbd.Screw("thread", model.ground.origin, nut.origin, pitch=pitch, axis=Z),
        mbd.Revolute("collar", nut.origin, head.origin, axis=Z),
        mbd.Prismatic("guide", model.ground.point(0.2, 0.0, 0.1), head.point(0.2, 0.0, 0.1), axis=Z),
    )
    if wound:
        model.apply(mbd.TorsionSpring("winding", model.joints[0], stiffness=0.8, rest=1.0))
    return model


@pytest.mark.parametrize("wound", [False, True])
def test_a_thread_that_is_cut_tells_its_turns_by_its_shift(wound):
    """No angle of it is another's modulo a turn: starts, springs and results see the one that belongs to the shift."""
    rng = np.random.default_rng(7)
    for _ in range(2):
        pitch, angle = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.4)), float(rng.uniform(-25.0, 25.0))
        ends = []
        for cut in ["collar"], ["thread"]:
            model = press(cut, pitch, wound)
            start = mbd.assemble(model, position={"thread.angle": angle}, velocity={"thread.angle": 9.0})
            run = mbd.simulate(model, start, mbd.RadauIIA(), dt=0.02, until=0.3, backend="python")
            assert run["thread.angle"][0] == pytest.approx(angle, abs=1e-8)
            shift = pitch * run["thread.angle"] / (2.0 * np.pi)
            np.testing.assert_allclose(run["guide.displacement"], shift, atol=1e-8)
            ends.append(run["thread.angle"][-1])
        assert ends[1] == pytest.approx(ends[0], abs=1e-6)
