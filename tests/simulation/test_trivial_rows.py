"""Joints on one axis hold each other's directions: rows that are zero whatever the motion never act."""

import numpy as np
import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.compile.trivial_rows import trivial_rows

ODD = np.array([1.0, 2.0, 2.0]) / 3.0
SCHEMES = [
    (mbd.HHT(), {"dt": 5e-3}),
    (mbd.GeneralizedAlpha(rho_inf=0.8, formulation="index3"), {"dt": 5e-3}),
    (mbd.RadauIIA(), {"tol": 1e-7}),
    (mbd.RungeKutta853(), {"tol": 1e-7}),
    (mbd.Newmark(), {"dt": 5e-3}),
]


def frame_pair(random, parent, child, axis, place, turn):
    """Frames of two bodies at one place, turned any way, and the axis in both."""
    point = tuple(map(float, place))
    frames = [body.point(*point) if hasattr(body, "point") else body(*point) for body in (parent, child)]
    about, angle = random.normal(size=3), float(random.uniform(-3.0, 3.0))
    about /= np.linalg.norm(about)
    cosine, sine = np.cos(-angle), np.sin(-angle)
    own = cosine * axis + sine * np.cross(about, axis) + (1.0 - cosine) * (about @ axis) * about
    own = tuple(map(float, own / np.linalg.norm(own)))
    first, second = (frame.turned(angle, tuple(about)) for frame in frames)
    return first, second.turned(float(random.uniform(-2.0, 2.0)), own) if turn else second, own


def shaft(seed, cut="auto", redundant=True):
    """Two bodies on a tilted axis, one in a hinge, the other on a sleeve; more sleeves on it change no motion."""
    random = np.random.default_rng(seed)
    axis = ODD if seed % 2 else random.normal(size=3)
    axis = axis / np.linalg.norm(axis)
    model = mbd.Model("shaft", cut=cut)
    center = tuple(map(float, random.normal(size=3) * 0.2))
    a, b = (mbd.RigidBody(name, mass=1.0, inertia=(0.2, 0.25, 0.3), center=center) for name in "ab")
    first, second, own = frame_pair(random, model.ground, a, axis, 0.3 * axis, turn=False)
    model.connect(mbd.Revolute("hinge", first, second, axis=own))
    first, second, own = frame_pair(random, a, b, axis, 0.0 * axis, turn=False)
    model.connect(mbd.Cylindrical("sleeve", first, second, axis=own))
    if redundant:
        for k, (parent, child) in enumerate([(model.ground, a), (model.ground, b)]):
            place = (random.normal() if k else 0.0) * axis
            first, second, own = frame_pair(random, parent, child, axis, place, turn=True)
            model.connect(mbd.Cylindrical(f"bearing {k}", first, second, axis=own))
    model.apply(mbd.Motor("motor", model.joints[0], 0.8))
    return model


def turned(model, scheme, **settings):
    start = mbd.assemble(model, position={"hinge.angle": 0.3, "sleeve.angle": -0.2})
    run = mbd.simulate(model, start, scheme, until=0.1, backend="python", **settings)
    return [run[name][-1] for name in ("hinge.angle", "sleeve.angle", "sleeve.displacement")]


@pytest.mark.parametrize("seed", range(2))
def test_bearings_on_one_axis_leave_the_motion_free_under_every_cut(seed):
    scheme, settings = SCHEMES[seed]
    free = turned(shaft(seed, redundant=False), scheme, **settings)
    for cut in ["bearing 0", "bearing 1"], ["hinge", "bearing 1"] if seed else ["sleeve", "bearing 0"]:
        assert abs(free[0] - 0.3) > 1e-3
        np.testing.assert_allclose(turned(shaft(seed, cut), scheme, **settings), free, rtol=1e-5, atol=1e-8)


def axle(cut, axis=ODD):
    """A hinge, a sleeve and a slider in one loop on one axis: the third holds nothing that the other two leave free."""
    model = mbd.Model("axle", gravity=(0.0, 0.0, 0.0), cut=cut)
    a, b = (mbd.RigidBody(name, mass=1.0, inertia=(0.2, 0.2, 0.3)) for name in "ab")
    axis = tuple(map(float, axis))
    model.connect(
        mbd.Revolute("x", model.ground.origin, a.origin, axis=axis),
        mbd.Cylindrical("y", a.origin, b.origin, axis=axis),
        mbd.Prismatic("z", model.ground.origin, b.origin, axis=axis),
    )
    model.apply(mbd.Motor("motor", model.joints[0], 0.8))
    return model


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("scheme", "settings"), SCHEMES, ids=lambda each: type(each).__name__)
def test_a_loop_on_one_tilted_axis_turns_as_the_torque_over_the_inertia_says(scheme, settings):
    inertia = float(ODD @ np.diag([0.2, 0.2, 0.3]) @ ODD)
    for cut in (["x"], ["y"], ["z"]):
        model = axle(cut)
        start = mbd.assemble(model, position={"x.angle": 0.3})
        run = mbd.simulate(model, start, scheme, until=0.1, backend="python", **settings)
        assert run["x.angle"][-1] == pytest.approx(0.3 + 0.5 * 0.8 / inertia * 0.1**2, rel=1e-7)


def test_only_rows_that_cancel_are_trivial_however_small_a_lever_is():
    """A pin one micrometre beside the axis of another locks both; on that axis it locks neither."""
    for lever, count in ((0.0, 3), (1e-6, 0)):
        model = mbd.Model("pins", cut=["second"])
        leaf = mbd.RigidBody("leaf", mass=1.0, inertia=(0.1, 0.1, 0.1))
        axis = tuple(map(float, ODD))
        place = (0.2 + lever, 0.4, 0.4)
        model.connect(
            mbd.Revolute("first", model.ground.origin, leaf.origin, axis=axis),
            mbd.Revolute("second", model.ground.point(*place), leaf.point(*place), axis=axis),
        )
        mechanism = mechanism_of(model, "python")
        found = trivial_rows(mechanism, mechanism.parameters())
        places = [k for k in found if mechanism.equations.rows[k].unit == "m"]
        assert len(places) == count
        assert mbd.mobility(model).dof == (1 if count else 0)


def test_parts_on_one_axis_that_do_not_meet_are_refused_by_name():
    model = mbd.Model("apart", cut=["second"])
    leaf = mbd.RigidBody("leaf", mass=1.0, inertia=(0.1, 0.1, 0.1))
    axis = tuple(map(float, ODD))
    post = model.ground.point(0.1, 0.2, 0.2, name="post")
    model.connect(
        mbd.Revolute("first", model.ground.origin, leaf.origin, axis=axis),
        mbd.Revolute("second", post, leaf.point(0.2, 0.4, 0.4), axis=axis),
    )
    with pytest.raises(mbd.errors.MbdError, match=r"'second'.*0\.\d+ m whatever the motion"):
        mbd.assemble(model)
    start = mbd.assemble(model, parameters={"ground.post.x": 0.2, "ground.post.y": 0.4, "ground.post.z": 0.4})
    run = mbd.simulate(model, start, until=0.05, dt=5e-3, backend="python")
    assert run.success
