"""Derivatives of runs of joints that turn freely: limits of differences, and exact ones of free bodies."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mbd
from mbd.joints.quaternions import rotation_of
from mbd.sensitivity.derivative import final_state_derivative
from tests import space_scenes
from tests.comparisons import at_least, compared
from tests.joints.quaternion_ball import QuaternionBall
from tests.sensitivity.turns import all_names, judged
from tests.simulation.test_space_laws import chain, pose

CLOSE = {"tolerance": 1e-12}
SCHEMES = (
    mbd.HHT(0.05, **CLOSE), mbd.RungeKutta853(), mbd.RadauIIA(**CLOSE), mbd.HHT(0.05, formulation="index3", **CLOSE),
    mbd.GeneralizedAlpha(0.7, **CLOSE), mbd.RungeKutta4(),
)  # fmt: skip
NAMES = ["ball.orientation", "ball.angular_velocity"]
STEP = 8e-4
"""Change of starts that are put on rows, which they then miss by much less [m, rad, m/s, rad/s]."""


def assert_as_differences(*given, **settings):
    """To 1e-8 of the largest, or to what two quotients differ by where that is more."""
    found = judged(*given, **settings)
    if found is not None:
        assert np.all(found[0] <= np.maximum(1e-8, 2.0 * found[1])), found
    return found


@cache
def scene(seed):
    """A chain in space: hanging or floating (even seeds), or held at its end, with joints or with rows for all."""
    kind = seed % 4
    bodies = 4 if kind % 2 else 3
    closed = None
    if kind % 2:
        free = chain(seed, bodies, floating=False)
        placed = mbd.assemble(free, pose(free, seed)[0])
        closed = mbd.simulate(free, placed, mbd.RungeKutta853(), dt=0.01, until=0.0)[f"body {bodies - 1}.end"][0]
    model = chain(seed, bodies, floating=kind == 2, cut="all" if kind == 3 else "auto", closed=closed)
    position, velocity = pose(model, seed)
    return model, mbd.assemble(model, position, None if kind % 2 else velocity)


@pytest.mark.parametrize("place", range(3))
def test_derivatives_of_trees_and_loops_are_limits_of_differences(place):
    for seed in (0, 1):
        model, start = scene(seed)
        settings = {"parameters": ["body 1.mass"], "step": STEP, "dt": 0.01, "until": 0.1}
        assert_as_differences(model, start, SCHEMES[place], ways=1, **settings)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 60, 10))
@at_least(20)
def test_derivatives_of_many_chains_are_limits_of_differences(first):
    for seed in range(first, first + 10):
        many_chains(seed)


def many_chains(seed):
    try:
        model, start = scene(seed)
    except mbd.AssemblyError:
        return
    for scheme in SCHEMES:
        try:
            settings = {"parameters": ["body 1.mass"], "step": STEP, "dt": 0.01, "until": 0.2}
            if assert_as_differences(model, start, scheme, seed=seed, alike=True, **settings) is not None:
                compared()
        except (mbd.SimulationError, mbd.CapabilityError):
            continue


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "joint", "seed"), [each for each in space_scenes.cases(range(2)) if each[0] != "feet"]
)
def test_derivatives_of_moving_trees_and_loops_with_every_joint_are_limits_of_differences(kind, joint, seed):
    made = space_scenes.scene(kind, joint, seed)
    for scheme in SCHEMES:
        assert_as_differences(made.model, made.start, scheme, ways=1, step=STEP, dt=0.01, until=0.12)


# contacts and events ------------------------------------------------------------------------------------------------
@cache
def hip(restitution):
    """A leg on a ball joint with a cone and two stops of its twist, and where it is kicked."""
    model = mbd.Model("hip")
    leg = mbd.RigidBody("leg", 8.6, (0.14, 0.04, 0.13), center=(0.0, -0.18, 0.01))
    joint = mbd.Spherical("hip", model.ground.origin, leg.origin, loss=mbd.Viscous(0.05))
    model.connect(joint)
    for name, measure in (
        ("cone", mbd.cone(joint, 0.8)), ("outward", mbd.twist(joint, 0.5)), ("inward", mbd.twist(joint, -0.5)),
    ):  # fmt: skip
        model.constrain(mbd.Unilateral(name, measure, restitution=restitution))
    return model, mbd.assemble(model, velocity={"hip.angular_velocity": (5.0, 3.0, 1.0)})


@cache
def box(restitution):
    """A floating box that strikes the ground with its corners."""
    model = mbd.Model("box")
    body = mbd.RigidBody("box", 1.0, (0.02, 0.03, 0.04))
    model.connect(mbd.Free("free", model.ground.origin, body.origin))
    for k, place in enumerate([(0.1, 0.1, 0.2), (-0.1, -0.1, 0.2), (0.1, -0.15, -0.2)]):
        foot = mbd.touchdown(body.point(*place))
        model.constrain(mbd.Unilateral(f"foot {k}", foot, restitution=restitution, friction=0.0))
    position = {"free.y": 0.4, "free.orientation": ("xyz", (0.3, 0.2, 0.1))}
    return model, mbd.assemble(model, position, {"free.angular_velocity": (1.0, 2.0, 3.0), "free.x": 0.2})


@pytest.mark.parametrize("scheme", SCHEMES[:3], ids=repr)
def test_stops_that_bounce_or_hold(scheme):
    for restitution in (0.3, 0.0):
        model, start = hip(restitution)
        assert assert_as_differences(model, start, scheme, ways=1, parameters=["gravity.y"], dt=0.01, until=0.4)


@pytest.mark.parametrize("scheme", SCHEMES[:3], ids=repr)
def test_corners_that_strike_slide_and_end_a_run(scheme):
    model, start = box(0.4)
    assert assert_as_differences(model, start, scheme, ways=1, dt=5e-3, until=0.35)
    model, start = box(0.0)
    assert assert_as_differences(model, start, scheme, ways=1, dt=5e-3, until="foot 1")


@pytest.mark.parametrize("whole", [False, True])
def test_resets_of_velocities_and_of_orientations(whole):
    """An event that turns a leg back by a third, or changes how it spins by how it is turned."""

    def reset(now):
        if not whole:
            return {"hip.angular_velocity.y": now["hip.angular_velocity.y"] + now["hip.rotation_vector.z"]}
        a, b = mbd.cos(0.1), mbd.sin(0.1)
        w, x, y, z = (now[f"hip.orientation.{part}"] for part in "wxyz")
        parts = (a * w - b * x, a * x + b * w, a * y + b * z, a * z - b * y)
        return {f"hip.orientation.{part}": value for part, value in zip("wxyz", parts, strict=True)}

    model = mbd.Model("kicked")
    leg = mbd.RigidBody("leg", 8.6, (0.14, 0.04, 0.13), center=(0.0, -0.18, 0.01))
    model.connect(mbd.Spherical("hip", model.ground.origin, leg.origin))
    model.constrain(
        mbd.Event("kick", mbd.measure(lambda x: x - 0.2, "hip.rotation_vector.x"), reset=reset, direction=1)
    )
    start = mbd.assemble(model, velocity={"hip.angular_velocity": (5.0, 3.0, 1.0)})
    assert assert_as_differences(model, start, mbd.RungeKutta853(), ways=1, dt=0.01, until=0.1)


# exact --------------------------------------------------------------------------------------------------------------
@cache
def ball(*inertia):
    """A body about its center, without forces."""
    model = mbd.Model("free body", gravity=(0.0, 0.0, 0.0))
    model.connect(mbd.Spherical("ball", model.ground.origin, mbd.RigidBody("body", 1.0, inertia).origin))
    return model


def cross(a):
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


@pytest.mark.parametrize("scheme", SCHEMES[:3], ids=repr)
def test_the_derivative_of_momentum_is_what_the_start_implies(scheme):
    """``L = R I ω`` of a free body stays, and its derivative ``R (δθ × I ω + I δω)`` with it."""
    inertia = np.diag([1.0, 2.0, 2.5])
    model = ball(1.0, 2.0, 2.5)
    start = mbd.assemble(model, {"ball.orientation": ("xyz", (0.3, -0.5, 0.8))}, {NAMES[1]: (1.0, 3.0, -2.0)})
    dt = 2e-3 if scheme is SCHEMES[0] else 0.01
    run = mbd.simulate(model, start, scheme, dt=dt, until=1.0)
    by_start, _ = final_state_derivative(run, NAMES)

    def slope(state, by):
        R, omega = np.array(rotation_of(state.q)), np.array(state.v)
        return R @ (-cross(inertia @ omega) @ by[:3] + inertia @ by[3:])

    off = np.max(np.abs(slope(run.final, by_start) - slope(start, np.eye(6))))
    assert off < (1e-3 if scheme is SCHEMES[0] else 1e-9)


def test_the_precession_of_a_free_symmetric_top():
    """ω turns about the axis of the body at ``σ = (C − A)/A ω₃``: its derivatives by the start in closed form.

    The axis turns about ``L`` at |L|/A (case of Poinsot's cone; Goldstein, Classical Mechanics, 5.6).
    """
    A, C, w, a, until = 2.0, 3.0, 4.0, 0.6, 1.5
    model = ball(A, A, C)
    start = mbd.assemble(model, velocity={NAMES[1]: (a, 0.0, w)})
    found = mbd.sensitivities(
        model, start, mbd.RungeKutta853(), dt=0.01, until=until, wrt=NAMES, of=["ball.angular_velocity"]
    )
    k = (C - A) / A
    s, c = np.sin(k * w * until), np.cos(k * w * until)
    wanted = np.array([[c, -s, -a * k * until * s], [s, c, a * k * until * c], [0.0, 0.0, 1.0]])
    assert found.matrix == pytest.approx(np.hstack([np.zeros((3, 3)), wanted]), abs=1e-11)
    assert found[NAMES[1], "ball.orientation"] == pytest.approx(np.zeros((3, 3)), abs=1e-11)
    rate = np.hypot(A * a, C * w) / A  # e₃ turns about L at this rate: where it is after a turn hardly changes by w
    turn = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=2.0 * np.pi / rate)
    by_start, _ = final_state_derivative(turn, NAMES)
    by_w = np.array(rotation_of(turn.final.q)) @ np.cross(by_start[:3, 5], (0.0, 0.0, 1.0))
    L = np.array([A * a, 0.0, C * w])
    lever = np.cross(L, (0.0, 0.0, 1.0)) / np.linalg.norm(L)  # ẽ₃ = |L|/A · lever at the end of the turn
    of_angle = (C * C * w / np.linalg.norm(L) / A) * 2.0 * np.pi / rate
    assert by_w == pytest.approx(of_angle * lever, abs=1e-10)


def test_the_monodromy_of_a_closed_rotation():
    """After one turn about e every change of place is back, and changes of speed along e have gone on."""
    model, axis = ball(1.0, 1.0, 1.0), np.array([2.0, -1.0, 2.0]) / 3.0
    start = mbd.assemble(model, velocity={NAMES[1]: 2.0 * np.pi * axis})
    for scheme, off in ((mbd.RungeKutta853(), 1e-12), (mbd.RadauIIA(**CLOSE), 1e-9)):
        run = mbd.simulate(model, start, scheme, dt=0.01, until=1.0)
        found, _ = final_state_derivative(run, NAMES)
        wanted = np.block([[np.eye(3), np.outer(axis, axis)], [np.zeros((3, 3)), np.eye(3)]])
        assert found == pytest.approx(wanted, abs=off)


# what users say -----------------------------------------------------------------------------------------------------
def test_results_of_an_orientation_by_the_chain_rule():
    """Of Euler angles, quaternions, vectors; an orientation is three directions, and none of its parts is one."""
    model, start = hip(0.3)
    of = ["hip.euler.zxy", "hip.orientation", "hip.angular_velocity.ground", "leg.center", "kinetic_energy"]
    found = mbd.sensitivities(
        model, start, mbd.RungeKutta853(), dt=0.01, until=0.1, wrt=["hip.orientation", "hip.angular_velocity.x"],
        of=of,
    )  # fmt: skip
    assert found.wrt[:3] == ("hip.turn.x", "hip.turn.y", "hip.turn.z")
    assert found.wrt_units == ("rad", "rad", "rad", "rad/s")
    run, configuration = found.run, mbd.simulate(model, start, dt=0.01, until=0.0).record.equations.configuration
    for k in range(3):  # each result, by the same change of the start
        ends = []
        for sign in (1.0, -1.0):
            moved = replace(start, q=configuration.compose(start.q, 1e-5 * sign * np.eye(3)[k]), memory=None)
            other = mbd.simulate(model, moved, mbd.RungeKutta853(), dt=0.01, until=0.1)
            ends.append(np.concatenate([np.atleast_1d(other[name][-1]) for name in of]))
        wanted = (ends[0] - ends[1]) / 2e-5
        assert found.matrix[:, k] == pytest.approx(wanted, abs=1e-8)
    assert found.values == pytest.approx(np.concatenate([np.atleast_1d(run[name][-1]) for name in of]), abs=1e-12)
    q = np.array(found.values[[found.of.index(f"hip.orientation.{part}") for part in "wxyz"]])
    assert q @ found["hip.orientation"] == pytest.approx(np.zeros(4), abs=1e-12)  # its length stays 1
    with pytest.raises(mbd.UnknownNameError, match=r"'hip.orientation.w' is one part of a quaternion.*'hip.turn.x'"):
        mbd.sensitivities(model, start, dt=0.01, until=0.1, wrt=["hip.orientation.w"])


def test_charts_of_a_users_own_joint():
    """Whose tangents are carried by what it says of ⊕ and ⊖."""
    model = mbd.Model("own joint")
    body = mbd.RigidBody("body", 1.0, (0.3, 0.4, 0.5), center=(0.1, -0.2, 0.3))
    model.connect(QuaternionBall("ball", model.ground.origin, body.origin))
    start = mbd.assemble(model, velocity=dict.fromkeys(all_names(model)[3:], 2.0))
    assert_as_differences(model, start, mbd.RungeKutta853(), dt=0.01, until=0.2)


@pytest.mark.parametrize("scheme", SCHEMES[:3], ids=repr)
def test_interpreted_as_compiled(scheme):
    model = ball(1.0, 2.0, 2.5)
    start = mbd.assemble(model, velocity={NAMES[1]: (1.0, 3.0, -2.0)})
    found = [
        np.vstack(final_state_derivative(mbd.simulate(model, start, scheme, dt=0.1, until=0.2, backend=backend), NAMES))
        for backend in ("llvm", "python")
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-12, abs=1e-13)


# whole turns ---------------------------------------------------------------------------------------------------------
def gyroscope(cut):
    """A wheel that makes many turns in two gimbals, as a tree or of bodies whose joints are all rows."""
    model = mbd.Model("gyroscope", cut=cut)
    outer = mbd.RigidBody("outer", 0.4, (2e-3, 3e-3, 2.5e-3))
    inner = mbd.RigidBody("inner", 0.3, (1e-3, 1.5e-3, 1.2e-3))
    wheel = mbd.RigidBody("wheel", **mbd.disk(1.2, 0.08, axis="x").body)
    model.connect(
        mbd.Revolute("yaw", model.ground.origin, outer.origin, axis="y"),
        mbd.Revolute("pitch", outer.origin, inner.origin),
        mbd.Revolute("spin", inner.point(0.1, 0.0, 0.0), wheel.origin, axis="x"),
    )
    begin = {"yaw.angle": 0.3, "pitch.angle": 0.0, "spin.angle": 120.0}
    return model, mbd.assemble(model, {"pitch.angle": 0.2}, begin)


def test_angles_of_cut_joints_have_the_derivatives_of_trees_after_whole_turns():
    angles = ["yaw.angle", "pitch.angle", "spin.angle"]
    settings = {"dt": 1e-3, "until": 0.2, "wrt": ["wheel.mass", "outer.inertia.yy"], "of": angles}
    tree, cut = (mbd.sensitivities(*gyroscope(cut), mbd.RungeKutta853(), **settings) for cut in ("auto", "all"))
    assert tree.values[2] > 3.0 * 2.0 * np.pi
    np.testing.assert_allclose(cut.values, tree.values, rtol=1e-10)
    np.testing.assert_allclose(cut.matrix, tree.matrix, rtol=1e-6, atol=0.0)
