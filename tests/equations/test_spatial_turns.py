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
