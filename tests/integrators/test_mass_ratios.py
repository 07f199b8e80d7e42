"""Masses that differ by many orders of magnitude: explicit steps keep the digits of accelerations."""

from functools import lru_cache

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from tests.fuzz.judge import judge

DIGITS = 60
"""Decimal digits of the accelerations that are compared with [-]."""
LEFT = 32.0 * float(np.finfo(float).eps)
"""Error of accelerations over what the largest force would give the lightest mass: directions are rounded [-]."""
TOL = 1e-7
"""Error of angles that is asked for [rad]."""


def chain(masses, lengths, cut="auto"):
    """Point masses at the ends of links in a row, hung up at the ground."""
    model = mbd.Model("chain", cut=cut)
    links = [
        mbd.Link(f"link {k}", mass, length, length)
        for k, (mass, length) in enumerate(zip(masses, lengths, strict=True))
    ]
    ends = [model.ground.origin, *(link.end for link in links)]
    model.connect(*(mbd.Revolute(f"joint {k}", ends[k], link.start) for k, link in enumerate(links)))
    return model


def exact(masses, lengths, q, v):
    """Accelerations of the joint angles by the closed form in absolute angles, with 60 digits."""
    with mp.workdps(DIGITS):
        m, length, g = [mp.mpf(x) for x in masses], [mp.mpf(x) for x in lengths], mp.mpf(9.81)
        angles, rates = ([mp.fsum(mp.mpf(float(x)) for x in part[: k + 1]) for k in range(len(m))] for part in (q, v))
        carried = [mp.fsum(m[k:]) for k in range(len(m))]
        M, f = mp.matrix(len(m)), mp.matrix(len(m), 1)
        for i in range(len(m)):
            f[i] = -carried[i] * g * length[i] * mp.sin(angles[i])
            for j in range(len(m)):
                common = carried[max(i, j)] * length[i] * length[j]
                M[i, j] = common * mp.cos(angles[i] - angles[j])
                f[i] -= common * mp.sin(angles[i] - angles[j]) * rates[j] ** 2
        found = mp.lu_solve(M, f)
        return np.array([float(found[k] - (found[k - 1] if k else 0)) for k in range(len(m))])


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    links=st.integers(2, 4),
    spread=st.sampled_from([0.0, 3.0, 6.0, 8.0]),
    line=st.sampled_from([1.0, 1e-3, 1e-5]),
)
def test_accelerations_are_those_of_exact_arithmetic_whatever_the_masses(seed, links, spread, line):
    rng = np.random.default_rng(seed)
    masses = 10.0 ** rng.uniform(-0.5 * spread, 0.5 * spread, links)
    lengths = rng.uniform(0.5, 1.5, links)
    position = {f"joint {k}.angle": rng.normal() * (line if k else 1.0) for k in range(links)}  # nearly in line
    velocity = {f"joint {k}.angle": 10.0 * rng.normal() for k in range(links)}
    model = chain(masses, lengths)
    run = mbd.simulate(model, mbd.assemble(model, position, velocity), mbd.RungeKutta853(), dt=1e-8, until=3e-8)
    for k in range(1, len(run.time)):
        wanted = exact(masses, lengths, run.record.q[k], run.record.v[k])
        pulled = np.sum(masses) * (9.81 + np.sum(lengths * np.cumsum(run.record.v[k]) ** 2))
        bound = pulled / np.min(masses) / np.min(lengths)
        np.testing.assert_allclose(run.record.a[k], wanted, rtol=0, atol=LEFT * bound)


@pytest.mark.parametrize("seed", range(4))
def test_a_heavy_mass_below_a_light_one_follows_a_tolerance_with_joint_angles_and_with_free_bodies(seed):
    rng = np.random.default_rng(seed)
    masses, lengths, angles = (1.0, 10.0 ** rng.uniform(5.5, 6.5)), rng.uniform(0.5, 1.5, 2), rng.uniform(0.3, 1.0, 2)
    times, found = np.linspace(0.0, 1.0, 41), []
    for cut in ("auto", "all"):
        model, second = chain(masses, lengths, cut), angles.sum()
        names = (
            ("joint 0.angle", "joint 1.angle") if cut == "auto" else ("link 0 floating.angle", "link 1 floating.angle")
        )
        start = mbd.assemble(model, dict(zip(names, (angles[0], angles[1] if cut == "auto" else second), strict=True)))
        run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=TOL, until=1.0)
        found.append(run.at(times)[names[0]])
    assert np.max(np.abs(found[0] - found[1])) < 2.0 * TOL


SHAPE = (0.05, 0.03, 0.06)
"""Moments of inertia of a body over its mass [m²]."""


# implicit steps in space ---------------------------------------------------------------------------------------------
def balls_with_a_light_link(mass, cut="auto"):
    """Three bodies on ball joints, that in the middle light."""
    model = three_balls(cut)
    inertia = {f"body 1.inertia.{2 * axis}": mass * each for axis, each in zip("xyz", SHAPE, strict=True)}
    start = mbd.assemble(
        model,
        {"joint 0.orientation": ("zxy", (0.9, 0.4, -1.0)), "joint 1.orientation": ("zxy", (-0.7, 0.8, 0.5))},
        {f"joint {k}.angular_velocity": (0.3, -0.2, 0.5) for k in range(3)},
        parameters={"body 1.mass": mass, **inertia},
    )
    return model, start


@lru_cache(maxsize=4)
def three_balls(cut="auto"):
    """Of 3 kg each."""
    model = mbd.Model("light link", cut=cut)
    end = model.ground.origin
    for k in range(3):
        body = mbd.RigidBody(f"body {k}", 3.0, [3.0 * each for each in SHAPE], center=(0.0, -0.2, 0.05))
        model.connect(mbd.Spherical(f"joint {k}", end, body.origin))
        end = body.point(0.0, -0.4, 0.0)
    return model


@pytest.mark.parametrize("mass", [5e-3, 5e-5, 5e-6])
@pytest.mark.parametrize("scheme", [mbd.HHT, mbd.GeneralizedAlpha, mbd.RadauIIA], ids=lambda scheme: scheme.__name__)
def test_what_newtons_method_leaves_does_not_show_in_the_motion_of_a_light_link(scheme, mass):
    """A residual of 10⁻⁹ of the heavy bodies' forces would be an acceleration of 10⁻³ of the light one's.

    What the tolerance that a scheme has by itself leaves of accelerations is far below what a step half as long
    changes of them.
    """
    model, start = balls_with_a_light_link(mass)
    tight = scheme(tolerance=1e-12)
    usual, exact = (mbd.simulate(model, start, each, dt=2e-3, until=0.04) for each in (scheme(), tight))
    finer = mbd.simulate(model, start, tight, dt=1e-3, until=0.04)
    step = np.abs(finer.record.a[::2] - exact.record.a).max()
    left = np.abs(usual.record.a - exact.record.a).max()
    assert left < 0.05 * step + 1e-8 * np.abs(exact.record.a).max(), (left, step)
    assert judge(usual, model, start.parameters).faults == ()


@pytest.mark.parametrize("mass", [5e-3, 5e-6])
def test_radau_steps_of_a_light_link_are_of_the_full_order_in_a_few_iterations(mass):
    """Its direction of little inertia turns within a step, so that no mass matrix serves two stages."""
    model, start = balls_with_a_light_link(mass)
    exact = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-10, until=0.32).record.q[-1]
    runs = [mbd.simulate(model, start, mbd.RadauIIA(), dt=dt, until=0.32) for dt in (0.032, 0.016)]
    coarse, fine = (np.abs(run.record.q[-1] - exact).max() for run in runs)
    assert coarse > 20.0 * fine, (coarse, fine)
    assert all(run.stats["iterations"] < 8 * run.stats["steps"] and not run.stats["shortened"] for run in runs)
    compiled, twin = (
        mbd.simulate(model, start, mbd.RadauIIA(), dt=4e-3, until=8e-3, backend=backend)
        for backend in ("llvm", "python")
    )
    np.testing.assert_allclose(compiled.record.a, twin.record.a, rtol=0, atol=1e-9)


@pytest.mark.parametrize("mass", [5e-3, 5e-5])
@pytest.mark.parametrize("cut", [0, 1, 2])
def test_radau_steps_of_a_light_link_whose_joints_are_cut_are_those_of_the_tree(cut, mass):
    """Corrections with rows and masses of the middle stage alone left seven tenths of the error, and steps failed."""
    model, start = balls_with_a_light_link(mass, cut=(f"joint {cut}",))
    _, uncut = balls_with_a_light_link(mass)
    exact = mbd.simulate(three_balls(), uncut, mbd.RungeKutta853(), tol=1e-10, until=0.32)
    runs = [mbd.simulate(model, start, mbd.RadauIIA(), dt=dt, until=0.32) for dt in (0.032, 0.016)]
    coarse, fine = (
        max(
            np.abs(run[f"body {k}.origin.{c}"][-1] - exact[f"body {k}.origin.{c}"][-1]) for k in range(3) for c in "xyz"
        )
        for run in runs
    )
    assert coarse > 20.0 * fine, (coarse, fine)
    assert all(run.stats["iterations"] < 8 * run.stats["steps"] and not run.stats["shortened"] for run in runs)


def light_link(seed):
    """A light body between two heavy ones on ball joints."""
    rng = np.random.default_rng(seed)
    model = mbd.Model("light link")
    end, position, velocity = model.ground.origin, {}, {}
    for k, mass in enumerate((rng.uniform(3.0, 15.0), 10.0 ** rng.uniform(-6.0, -3.0), rng.uniform(3.0, 15.0))):
        inertia = tuple(float(mass * x) for x in (0.05, 0.03, 0.06))
        body = mbd.RigidBody(f"body {k}", float(mass), inertia, center=(0.0, -0.2, 0.05))
        model.connect(mbd.Spherical(f"joint {k}", end, body.origin))
        end = body.point(0.0, -0.4, 0.0)
        turn = rng.normal(size=4)
        position[f"joint {k}.orientation"] = tuple(map(float, turn / np.linalg.norm(turn)))
        velocity[f"joint {k}.angular_velocity"] = tuple(map(float, rng.uniform(-0.7, 0.7, 3)))
    return model, mbd.assemble(model, position=position, velocity=velocity)


@pytest.mark.parametrize("seed", [0, 2, 6, 9])
@pytest.mark.parametrize(
    "scheme", [mbd.GeneralizedAlpha(0.7, formulation="index3"), mbd.HHT(0.05), mbd.Newmark()], ids=repr
)
def test_rows_of_implicit_schemes_have_the_accelerations_of_the_balance_of_a_light_body(scheme, seed):
    """An old tangent, and a correction taken by half, leave much of a small residual: neither tells its round-off.

    Newton's method stops at 10⁻⁴ of its first correction, by which accelerations of the light body may be off.
    """
    model, start = light_link(seed)
    run = mbd.simulate(model, start, scheme, dt=5e-3, until=1.5, on_failure="return")
    assert len(run) > 100
    M, f, *_ = run.columns.balance.terms_at(run.columns.rows)
    wanted = -np.linalg.solve(M, f[..., None])[..., 0]
    off = np.max(np.abs(run.record.a - wanted), axis=1) / np.max(np.abs(wanted), axis=1)
    assert np.max(off) <= 3e-4
