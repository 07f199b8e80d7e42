"""Dry friction of a ball joint sticks, breaks loose and slides as one: ‖T‖ ≤ T_max, sliding against ω."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mbd

LIMIT, INERTIA = 0.3, 0.1
SCHEMES = [
    mbd.HHT(), mbd.GeneralizedAlpha(0.8), mbd.Newmark(), mbd.RadauIIA(), mbd.RungeKutta4(), mbd.RungeKutta853(),
]  # fmt: skip


def ball(loss, torque=None, cut="auto", turn=None, **body):
    """A body on a ball joint in the ground, its child frame turned."""
    model = mbd.Model("ball", gravity=(0.0, 0.0, -9.81 if "center" in body else 0.0), cut=cut)
    ball = mbd.RigidBody("body", body.pop("mass", 2.0), body.pop("inertia", (INERTIA,) * 3), **body)
    ball.point(0.2, 0.1, -0.3, name="end")
    matrix = (turn or Rotation.identity()).as_matrix().tolist()
    frame = replace(ball.point(0.0, 0.0, 0.0), rotation=tuple(map(tuple, matrix)))
    model.connect(mbd.Spherical("hip", model.ground.origin, frame, loss=loss))
    if torque is not None:
        model.apply(mbd.Applied("drive", ball.origin, torque=torque))
    return model


def velocity(run):
    return np.array([run[f"hip.angular_velocity.{axis}"] for axis in "xyz"]).T


def friction(run):
    return np.array([run[f"hip.angular_velocity.{axis}.friction"] for axis in "xyz"]).T


def instants(run):
    return [(event.kind, event.time) for event in run.events]


@pytest.mark.parametrize("cut", ["auto", pytest.param("all", marks=pytest.mark.slow)])
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_a_sphere_spins_down_linearly_and_stays(scheme, cut):
    """ω = ω₀ (1 − t/t_e), t_e = I ‖ω₀‖/T, which is the end of a step."""
    model = ball(mbd.Coulomb(LIMIT), cut=cut)
    start = mbd.assemble(model, velocity={"hip.angular_velocity": (1.0, 2.0, -2.0)})
    run = mbd.simulate(model, start, scheme, dt=1e-2, until=1.5)
    left = np.maximum(1.0 - run.time, 0.0)
    np.testing.assert_allclose(velocity(run), left[:, None] * [1.0, 2.0, -2.0], rtol=0.0, atol=1e-12)
    assert instants(run) == [("stuck", pytest.approx(1.0, abs=1e-12))]
    sliding = run.time < 1.0 - 1e-9
    np.testing.assert_allclose(friction(run)[sliding], np.tile([-0.1, -0.2, 0.2], (sliding.sum(), 1)), atol=1e-9)
    assert np.max(np.abs(run.energy.numerical)) < 1e-12


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_it_sticks_below_its_limit_and_breaks_loose_beyond_it(scheme):
    """Under M = k t u it sticks until k t = T, then I ω = ½ k (t − T/k)² u."""
    way, rate = np.array([2.0, -1.0, 2.0]) / 3.0, 0.5
    torque = tuple((lambda t, part=part: rate * part * t) for part in way.tolist())
    model = ball(mbd.Coulomb(LIMIT), torque)
    run = mbd.simulate(model, mbd.assemble(model), scheme, dt=7e-3, until=1.0)
    assert instants(run) == [("slipped", pytest.approx(LIMIT / rate, abs=1e-9))]
    later = np.maximum(run.time - LIMIT / rate, 0.0)
    exact = 0.5 * rate * later**2 / INERTIA
    np.testing.assert_allclose(velocity(run), exact[:, None] * way, rtol=0.0, atol=2e-5)
    sticks = run.time < LIMIT / rate - 1e-9
    np.testing.assert_allclose(friction(run)[sticks], -rate * run.time[sticks, None] * way, rtol=0.0, atol=1e-12)


def driven(loss, turn=None, cut="auto"):
    """A pendulum that slides, sticks beside the vertical, and breaks loose again."""
    torque = (lambda t: 1.5 * mbd.sin(1.3 * t), lambda t: 1.2 * mbd.cos(2.1 * t) - 1.2, 0.0)
    model = ball(loss, torque, cut, turn, mass=1.0, inertia=(0.02, 0.03, 0.01), center=(0.0, 0.0, -0.3))
    return model, mbd.assemble(model, {"hip.orientation": turn or Rotation.identity()})


@pytest.mark.parametrize("cut", ["auto", pytest.param("all", marks=pytest.mark.slow)])
@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.RadauIIA(), mbd.RungeKutta853()], ids=str)
def test_the_axes_of_the_joint_change_nothing(scheme, cut):
    times, ends = [], []
    for turn in (None, Rotation.from_rotvec([0.4, -1.1, 0.7])):
        model, start = driven(mbd.Coulomb(0.8), turn, cut)
        run = mbd.simulate(model, start, scheme, dt=2e-3, until=2.0)
        assert [kind for kind, _ in instants(run)] == ["slipped", "stuck", "slipped"]
        times.append([at for _, at in instants(run)])
        ends.append([run.final[f"body.end.{axis}"] for axis in "xyz"] + [np.linalg.norm(velocity(run)[-1])])
    np.testing.assert_allclose(*times, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(*ends, rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("loss", [mbd.Viscous(0.02) + mbd.Stribeck(0.9, 0.6, 0.1), mbd.PinFriction(0.3, 0.2)])
def test_schemes_agree_and_friction_dissipates(loss):
    """Stribeck's friction, and that of a ball in its socket, which follows the force in the joint."""
    ends = []
    for scheme in (mbd.GeneralizedAlpha(0.8), mbd.HHT()):
        run = mbd.simulate(*driven(loss), scheme, dt=1e-3, until=2.0)
        assert [kind for kind, _ in instants(run)] == ["slipped", "stuck", "slipped"]
        power = np.einsum("ij,ij->i", friction(run), velocity(run))
        assert np.max(power) < 1e-12
        speed = np.linalg.norm(velocity(run), axis=1)
        moves = speed > 1e-3
        size = np.linalg.norm(friction(run)[moves], axis=1)
        np.testing.assert_allclose(power[moves], -size * speed[moves], rtol=1e-9)
        assert np.max(np.abs(run.energy.numerical)) < 1e-5
        ends.append([*velocity(run)[-1], *(at for _, at in instants(run))])
    np.testing.assert_allclose(*ends, rtol=0.0, atol=1e-4)


def test_nonsmooth_steps_stick_and_slide_at_the_same_instants():
    ends = [
        mbd.simulate(*driven(mbd.Coulomb(0.8)), mbd.HHT(), dt=1e-3, until=2.0, contact=contact)
        for contact in ("events", "nonsmooth")
    ]
    times = [[at for _, at in instants(run)] for run in ends]
    assert [kind for kind, _ in instants(ends[1])] == ["slipped", "stuck", "slipped"]
    np.testing.assert_allclose(*times, rtol=0.0, atol=1.5e-3)
    np.testing.assert_allclose(velocity(ends[0])[-1], velocity(ends[1])[-1], atol=2e-3)


@pytest.mark.parametrize("scheme", [mbd.HHT(), pytest.param(mbd.RadauIIA(), marks=pytest.mark.slow)], ids=str)
def test_derivatives_pass_rest_and_onset(scheme):
    """Exact ones against central differences over 'slipped', 'stuck', 'slipped'."""

    def end(limit):
        return velocity(mbd.simulate(*driven(mbd.Coulomb(limit)), scheme, dt=2e-3, until=2.0))[-1]

    found = mbd.sensitivities(*driven(mbd.Coulomb(0.8)), scheme, dt=2e-3, until=2.0, wrt=["hip loss.torque"])
    exact = [float(found[f"hip.angular_velocity.{axis}", "hip loss.torque"]) for axis in "xyz"]
    np.testing.assert_allclose(exact, (end(0.8 + 1e-5) - end(0.8 - 1e-5)) / 2e-5, rtol=0.0, atol=1e-4)


@pytest.mark.parametrize("scheme", [mbd.RadauIIA(), mbd.RungeKutta4()], ids=str)
def test_an_impact_passes_friction_that_stays_finite(scheme):
    """The joint slides from an impact on as its velocity after it says; friction has no impulse."""
    model = mbd.Model("arm")
    arm = mbd.RigidBody("arm", 1.0, (0.02, 0.03, 0.025), center=(0.3, 0.0, 0.0))
    base = model.ground.point(0.0, 0.3, 0.0)
    model.connect(mbd.Spherical("hip", base, arm.origin, loss=mbd.Coulomb(0.8)))
    model.constrain(mbd.Unilateral("tip", mbd.touchdown(arm.point(0.6, 0.0, 0.1)), friction=0.3, restitution=0.4))
    run = mbd.simulate(
        model, mbd.assemble(model, velocity={"hip.angular_velocity": (0.5, 0.3, 0.2)}), scheme, dt=1e-3, until=0.4
    )
    strike = run.events[0]
    assert strike.name == "tip" and strike.energy_loss > 0.0
    row = int(np.flatnonzero(run.time == strike.time)[-1])
    w, T = velocity(run)[row], friction(run)[row]
    np.testing.assert_allclose(T, -0.8 * w / np.linalg.norm(w), atol=1e-9)
    assert np.max(np.abs(run.energy.numerical)) < 1e-8


def test_two_ball_joints_share_what_turns_the_rod_between_them():
    """A rod that two ball joints hold can turn about itself alone: it sticks while M < 2 T, then I ω̇ = M − 2 T."""
    model = mbd.Model("rod", gravity=(0.0, 0.0, 0.0))
    rod = mbd.RigidBody("rod", 1.0, (0.1, 0.2, 0.2))
    for name, place in (("left", -0.5), ("right", 0.5)):
        socket = model.ground.point(place, 0.0, 0.0)
        model.connect(mbd.Spherical(name, socket, rod.point(place, 0.0, 0.0), loss=mbd.Coulomb(LIMIT)))
    model.apply(mbd.Applied("drive", rod.origin, torque=(lambda t: t, 0.0, 0.0)))
    run = mbd.simulate(model, mbd.assemble(model), mbd.RadauIIA(), dt=1e-2, until=1.0)
    assert run.events[0].kind == "slipped" and run.events[0].time == pytest.approx(2.0 * LIMIT, abs=1e-6)
    speed = np.linalg.norm([run.final[f"left.angular_velocity.{axis}"] for axis in "xyz"])
    assert speed == pytest.approx(0.5 * (1.0 - 2.0 * LIMIT) ** 2 / 0.1, rel=1e-4)


def test_files_and_models_without_it_keep_what_it_is(tmp_path):
    model, start = driven(mbd.Viscous(0.1) + mbd.Coulomb(0.8))
    run = mbd.simulate(model, start, mbd.HHT(), dt=1e-3, until=1.0)
    run.save(tmp_path / "run.npz")
    loaded = mbd.load(tmp_path / "run.npz")
    np.testing.assert_array_equal(loaded.energy.numerical, run.energy.numerical)
    np.testing.assert_array_equal(friction(loaded), friction(run))
    assert [part.name for part in run.energy.parts][-1] == "hip friction"
    assert model.without("hip friction").joints[0].loss.fields() == {"viscous.coefficient": 0.1}
