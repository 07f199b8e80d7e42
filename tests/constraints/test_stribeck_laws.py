"""Stribeck's friction in every row: the size that the law has at the slip, against the slip, and taking energy only."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd

SCHEMES = [mbd.HHT(0.05), mbd.GeneralizedAlpha(0.9), mbd.Newmark(), mbd.RadauIIA(), mbd.RungeKutta853()]
MASS, SPIN, G = 0.4, 1.0, 9.81


def size_at(loss, speed):
    """T_k + (T_s − T_k) e^{−(v/v_s)²} of a sum of losses, and what is viscous."""
    parts = loss.losses if hasattr(loss, "losses") else (loss,)
    found = 0.0
    for part in parts:
        if isinstance(part, mbd.Stribeck):
            found = found + part.kinetic + (part.static - part.kinetic) * np.exp(-((speed / part.speed) ** 2))
        elif isinstance(part, mbd.Coulomb):
            found = found + part.torque
    return found


def turntable(law, spin):
    """A disc that spins up, and a block on it."""
    model = mbd.Model("turntable")
    disc, block = mbd.RigidBody("disc", 5.0, (1.0, 2.0, 1.0)), mbd.PointMass("block", MASS)
    axle = mbd.Revolute("axle", model.ground.origin, disc.origin, axis=(0, 1, 0))
    model.connect(axle, mbd.Translation("fly", model.ground.origin, block.origin, axes="xyz"))
    model.constrain(
        mbd.Bilateral("drive", axle, value=lambda t: 0.5 * spin * t * t),
        mbd.Unilateral("rub", mbd.touchdown(block.origin, mbd.Plane(frame=disc.origin)), friction=law),
    )
    return model


def slips(run, spin):
    """Velocity of the slip (n, 2) and the friction on the block m a (n, 2), from motions alone."""
    rate = spin * run.time
    slip = np.stack([run["fly.x.rate"] - rate * run["fly.z"], run["fly.z.rate"] + rate * run["fly.x"]], axis=1)
    return slip, MASS * np.stack([run["fly.x.acceleration"], run["fly.z.acceleration"]], axis=1)


def by_hand(law, spin, radius, heading, onset, until):
    """Place of the block (x, z) from the onset on, in axes that turn along: r of the disc, u = dr/dt."""

    def slope(t, y):
        x, z, u, w = y
        turn, gain = spin * t, spin
        speed = math.hypot(u, w)
        size = size_at(law, speed) * G
        # r̈ = F/m − Ω̇×r − 2 Ω×u − Ω×(Ω×r), of Ω along y
        ahead = [-gain * z - 2.0 * turn * w + turn * turn * x, gain * x + 2.0 * turn * u + turn * turn * z]
        return [u, w, ahead[0] - size * u / speed, ahead[1] - size * w / speed]

    # a series at the onset: the slip begins along the force that was asked for, with the jerk that is left over
    turn = spin * onset
    asked = np.array([turn * turn, spin]) * radius
    way = asked / np.linalg.norm(asked)
    excess = np.array([2.0 * turn * spin * radius, 0.0]) @ way  # d‖asked‖/dt
    h = 1e-6
    start = [radius, 0.0, *(0.5 * excess * h * h * way)]
    found = solve_ivp(slope, (onset + h, until), start, method="Radau", rtol=1e-9, atol=1e-12)
    x, z = found.y[0, -1], found.y[1, -1]
    angle = heading + 0.5 * spin * until**2
    return np.array([x * math.cos(angle) + z * math.sin(angle), -x * math.sin(angle) + z * math.cos(angle)])


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda scheme: type(scheme).__name__)
def test_a_block_on_a_disc_that_spins_up_slides_by_the_law_from_the_onset_on(scheme, seed):
    rng = np.random.default_rng(seed)
    static, radius, spin = rng.uniform(0.3, 0.8), rng.uniform(0.2, 0.8), rng.uniform(0.5, 2.0)
    law = mbd.Stribeck(static, rng.uniform(0.4, 0.9) * static, 10.0 ** rng.uniform(-2.0, -1.0))
    law = law + mbd.Coulomb(0.05) if seed % 2 else law
    model = turntable(law, spin)
    onset = math.sqrt(math.sqrt((size_at(law, 0.0) * G / radius) ** 2 - spin**2)) / spin
    until = onset + 0.15
    heading = rng.uniform(0.0, 2.0 * np.pi)
    right = by_hand(law, spin, radius, heading, onset, until)
    place = {"fly.x": radius * math.cos(heading), "fly.z": -radius * math.sin(heading)}
    start = mbd.assemble(model, position=place, closed="rub")
    misses = []
    for dt in (1e-3, 5e-4):
        run = mbd.simulate(model, start, scheme, dt=dt, until=until)
        assert [event.kind for event in run.events] == ["slipped"]
        np.testing.assert_allclose(run.events[0].time, onset, atol=1e-8)
        slip, force = slips(run, spin)
        speed, push = np.linalg.norm(slip, axis=1), run["rub.force"]
        moves = speed > 1e-5
        limit = size_at(law, speed) * push
        np.testing.assert_allclose(np.linalg.norm(force, axis=1)[moves], limit[moves], rtol=3e-6)
        against = -slip[moves] * (limit[moves] / speed[moves])[:, None]
        np.testing.assert_allclose(force[moves], against, atol=1e-4 * limit.max())
        friction = np.hypot(run["rub.friction.forward"], run["rub.friction.sideways"])
        np.testing.assert_allclose(friction[moves], limit[moves], rtol=1e-6)
        assert np.all(friction <= size_at(law, 0.0) * push * (1.0 + 1e-6))
        misses.append(np.hypot(run["fly.x"][-1] - right[0], run["fly.z"][-1] - right[1]))
    assert misses[0] < 1e-4 and misses[1] < max(0.35 * misses[0], 2e-8), misses


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda scheme: type(scheme).__name__)
def test_friction_in_a_joint_is_all_there_is_and_takes_energy_only(scheme):
    rng = np.random.default_rng(5)
    for _ in range(3):
        torque = rng.uniform(0.2, 1.0)
        law = mbd.Stribeck(torque, rng.uniform(0.3, 0.9) * torque, rng.uniform(0.1, 0.5)) + mbd.Coulomb(0.1)
        model = mbd.Model("hinge", gravity=(0.0, -G, 0.0))
        bar = mbd.Link("bar", mass=1.0, length=1.0, center=0.5, inertia=0.1)
        model.connect(mbd.Revolute("hinge", model.ground.origin, bar.start, loss=law))
        rate = rng.choice([-1.0, 1.0]) * rng.uniform(1.0, 3.0)
        start = mbd.assemble(model, {"hinge.angle": rng.uniform(-1.0, 1.0)}, {"hinge.angle": rate})
        run = mbd.simulate(model, start, scheme, dt=2e-3, until=1.5)
        speed, friction = run["hinge.rate"], run["hinge.friction"]
        # in motion the law at the rate, against it; at rest what holds the bar, within the static size
        moves = np.abs(speed) > 1e-6
        np.testing.assert_allclose(friction[moves], (-np.sign(speed) * size_at(law, speed))[moves], rtol=1e-9)
        assert np.all(np.abs(friction) <= size_at(law, 0.0) * (1.0 + 1e-9))
        # the ledger books it in one place, where it only takes
        assert not any("loss" in name for name in run.names)
        (part,) = [each for each in run.energy.parts if each.name == "hinge friction"]
        assert np.all(np.diff(part.energy) <= 1e-12)
        np.testing.assert_allclose(run["hinge friction.power"], friction * speed, atol=1e-9)
