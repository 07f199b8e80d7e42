"""Bodies on several feet with friction: which loads they bear at rest, which way they slide, and where they stop."""

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st
from scipy.optimize import minimize

import mbd

G = 9.81
FEET = {
    3: ((0.4, 0.0), (-0.2, 0.35), (-0.2, -0.35)),
    4: ((0.4, 0.25), (-0.3, 0.35), (-0.35, -0.3), (0.3, -0.4)),
    5: ((0.5, 0.0), (0.1, 0.45), (-0.4, 0.3), (-0.35, -0.3), (0.2, -0.4)),
}
HEIGHT, MASS = 0.5, 12.0
NAMES = ("fx", "fy", "tx", "ty", "tz")
THREE_LEGS = {"fx": np.cos(0.3), "fy": np.sin(0.3), "tx": 0.2 * np.sin(0.3), "ty": -0.2 * np.cos(0.3),
              "tz": -0.1 * np.sin(0.3) - 0.25 * np.cos(0.3)}  # fmt: skip
"""The unit push of the case of the three-legged table at its mass center."""
LIMIT, CENTER = 32.30288143783885, (0.25275667263377877, -0.4409898925026128)


def size(t, held, rate, bend):
    """Of the load, as it grows or falls."""
    return held + rate * t + bend * t * t


@lru_cache(maxsize=16)
def table(feet, order=None, turn=0.0):
    """A table on these feet, loaded at its mass center by `size` times (fx, fy) and (tx, ty, tz)."""
    model = mbd.Model("table", gravity=(0.0, 0.0, -G))
    body = mbd.RigidBody("table", MASS, (1.0, 1.2, 1.5))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    cosine, sine = np.cos(turn), np.sin(turn)
    for k in order or range(len(feet)):
        x, y = feet[k]
        place = body.point(cosine * x - sine * y, sine * x + cosine * y, -HEIGHT)
        floor = mbd.touchdown(place, mbd.Plane(normal=(0.0, 0.0, 1.0)))
        model.constrain(mbd.Unilateral(f"foot {k}", floor, friction=0.3))

    def turned(x, y):
        return cosine * x - sine * y, sine * x + cosine * y

    def force(t, held, rate, bend, fx, fy):
        return *(size(t, held, rate, bend) * part for part in turned(fx, fy)), 0.0

    def torque(t, held, rate, bend, tx, ty, tz):
        return tuple(size(t, held, rate, bend) * part for part in (*turned(tx, ty), tz))

    for name, law, parts in ("push", force, NAMES[:2]), ("twist", torque, NAMES[2:]):
        inputs = ("t", *((part, 0.0) for part in ("held", "rate", "bend", *parts)))
        kind = {"force": law} if name == "push" else {"torque": law}
        model.apply(mbd.Applied(name, body.origin, arguments=inputs, **kind))
    return model


def pushed(model, load, scheme, held=0.0, rate=0.0, bend=0.0, mu=0.3, height=HEIGHT, **how):
    feet = [each.name for each in model.constraints]
    values = {f"{name}.{part}": value for name in ("push", "twist") for part, value in
              (("held", held), ("rate", rate), ("bend", bend))}  # fmt: skip
    values |= {f"{'push' if part in NAMES[:2] else 'twist'}.{part}": load.get(part, 0.0) for part in NAMES}
    frictions = dict(zip(sorted(feet), np.broadcast_to(mu, len(feet)), strict=True))
    values |= {f"{foot}.mu": float(frictions[foot]) for foot in feet}
    start = mbd.assemble(model, position={"float.z": height}, closed=feet, parameters=values)
    return mbd.simulate(model, start, scheme, parameters=values, **how)


def largest_load(feet, load, mu):
    """The factor on a load at which it slides, by the motion that is easiest, and that motion (vₓ, v_y, ω)."""
    x, y = np.transpose(feet)
    fx, fy, tx, ty, tz = (load.get(name, 0.0) for name in NAMES)
    share = np.linalg.pinv(np.array([np.ones(len(feet)), x, y]))
    weight = share @ (MASS * G, 0.0, 0.0)
    more = share @ (0.0, ty + HEIGHT * fx, HEIGHT * fy - tx)

    def bearable(u):
        power = fx * u[0] + fy * u[1] + tz * u[2]
        way = mu * np.hypot(u[0] - u[2] * y, u[1] + u[2] * x)
        return (way @ weight) / (power - way @ more) if power > max(way @ more, 0.0) else np.inf

    pull = np.array([fx, fy, tz])
    others = np.linalg.svd(pull[None, :])[2][1:]
    found = [np.array([yk, -xk, 1.0]) * np.sign(fx * yk - fy * xk + tz) for xk, yk in feet]
    for first in (0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0):
        way = minimize(
            lambda s: bearable(pull / (pull @ pull) + s @ others), first, method="Nelder-Mead",
            options={"xatol": 1e-11, "fatol": 1e-14, "maxiter": 2000},
        )  # fmt: skip
        found.append(pull / (pull @ pull) + way.x @ others)
    best = min(found, key=bearable)
    return bearable(best), best, weight + bearable(best) * more


def center(run, row):
    """Of the velocities in a row."""
    vx, vy, w = (run[name][row] for name in ("float.x.rate", "float.y.rate", "float.angular_velocity.z"))
    return np.array([-vy / w, vx / w])


def pulls(run, feet):
    """|λ_T| and p of each foot, over time."""
    sizes = [np.hypot(run[f"foot {k}.friction.forward"], run[f"foot {k}.friction.sideways"]) for k in range(len(feet))]
    return np.array(sizes), np.array([run[f"foot {k}.force"] for k in range(len(feet))])


@pytest.mark.sampled(2)
@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8), mbd.RadauIIA(), mbd.RungeKutta853()])
def test_a_three_legged_table_slips_at_its_limit_load_and_turns_about_its_center(scheme):
    """Both bounds of limit analysis, and the center of rotation at onset."""
    model = table(FEET[3])
    run = pushed(model, THREE_LEGS, scheme, rate=20.0, mu=0.35, dt=1e-2, until=1.625)
    assert [event.kind for event in run.events] == ["slipped"] * 3
    assert all(event.time * 20.0 == pytest.approx(LIMIT, abs=1e-7) for event in run.events)
    row = int(np.searchsorted(run.time, run.events[0].time))
    sizes, forces = pulls(run, FEET[3])
    assert forces[:, row] == pytest.approx([54.670060670732845, 35.61617860674796, 27.433760722519203], abs=1e-7)
    assert np.all(sizes[:, run.time <= run.events[0].time] <= 0.35 * forces[:, run.time <= run.events[0].time] + 1e-9)
    just = pushed(model, THREE_LEGS, scheme, held=LIMIT * (1.0 + 1e-7), mu=0.35, dt=1e-3, until=5e-3)
    assert center(just, -1) == pytest.approx(CENTER, abs=1e-6)
    below = pushed(model, THREE_LEGS, scheme, held=LIMIT * (1.0 - 1e-7), mu=0.35, dt=1e-3, until=5e-3)
    assert not below.events and abs(below["float.angular_velocity.z"][-1]) < 1e-15


@settings(max_examples=12)
@given(data=st.data(), count=st.sampled_from([3, 4, 5]))
def test_tables_slip_at_the_least_load_of_any_motion(data, count):
    part = st.floats(-1.0, 1.0)
    load = {name: scale * data.draw(part, name) for name, scale in zip(NAMES, (1.0, 1.0, 0.2, 0.2, 0.5), strict=True)}
    assume(np.hypot(load["fx"], load["fy"]) + abs(load["tz"]) > 0.2)
    mu = np.array([data.draw(st.floats(0.1, 0.6), "mu") for _ in range(count)])
    limit, way, forces = largest_load(FEET[count], load, mu)
    assume(np.all(forces > 5.0) and limit < 1e3)
    run = pushed(table(FEET[count]), load, mbd.HHT(0.05), rate=limit, mu=mu, dt=0.05, until=1.0005)
    slips = [event for event in run.events if event.kind == "slipped"]
    assert slips and slips[0].time == pytest.approx(1.0, abs=1e-9)
    sizes, pushes = pulls(run, FEET[count])
    assert np.all(sizes <= mu[:, None] * pushes * (1.0 + 1e-9) + 1e-9)
    moved = np.array([run[name][-1] for name in ("float.x.rate", "float.y.rate", "float.angular_velocity.z")])
    assert moved @ way / np.linalg.norm(moved) / np.linalg.norm(way) > 0.99


def test_order_of_feet_and_directions_of_the_plane_do_not_matter_and_friction_takes_energy():
    count, feet, load = 4, FEET[4], {"fx": 0.1, "tz": 1.0}
    how = {"rate": 100.0, "bend": -150.0, "dt": 1e-3, "until": 0.355}
    run = pushed(table(feet), load, mbd.HHT(0.05), **how)
    assert [event.kind for event in run.events] == ["slipped"] * count
    sizes, forces = pulls(run, feet)
    assert np.all(forces > 0.0) and np.all(sizes <= 0.3 * forces * (1.0 + 1e-9))
    taken = np.array([run.energy[f"foot {k} friction"] for k in range(count)])
    assert np.all(np.diff(taken, axis=1) <= 1e-9) and taken[:, -1].sum() < 0.0
    order = tuple(reversed(range(count)))
    for other, turn in (table(feet, order), 0.0), (table(feet, None, 0.8), 0.8):
        same = pushed(other, load, mbd.HHT(0.05), **how)
        back = (same["float.x"] + 1j * same["float.y"]) * np.exp(-1j * turn)
        there = np.interp(run.time, same.time, back)
        assert np.max(np.abs(there - run["float.x"] - 1j * run["float.y"])) < 2e-5
        assert [event.time for event in same.events] == pytest.approx(
            [event.time for event in run.events], abs=2e-5
        )  # errors of steps


SIX = ((0.33, 0.0), (0.16, 0.27), (-0.15, 0.26), (-0.39, -0.02), (-0.13, -0.32), (0.14, -0.37))
SCHEMES = (mbd.GeneralizedAlpha(0.9), mbd.HHT(0.05), mbd.Newmark(), mbd.RadauIIA(), mbd.RungeKutta853())


@pytest.mark.parametrize("seeds", [(5, 14, 19), pytest.param(range(100), marks=pytest.mark.slow)])
def test_tables_pushed_a_little_above_their_limit_slide_on_in_non_smooth_steps(seeds):
    """Whatever the excess: friction within its cones, and where located events lead, to the order of the steps."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        feet, (way, mu) = rng.choice([*FEET, 6]), rng.uniform((0.0, 0.15), (6.28, 0.4))
        feet = FEET.get(feet, SIX)
        tx, ty, tz = rng.normal(size=3) * (0.05, 0.05, 0.3)
        load = {"fx": np.cos(way), "fy": np.sin(way), "tx": tx, "ty": ty, "tz": tz}
        limit, _, weights = largest_load(feet, load, mu)
        excess, dt = 10.0 ** rng.uniform(-5.0, -1.0), rng.choice([1e-2, 5e-3, 2e-3])
        if min(weights) < 1.0:  # it would tip
            continue
        how = {"held": limit * (1.0 + excess), "mu": mu, "until": 0.1}
        run = pushed(table(feet), load, SCHEMES[seed % 5], dt=dt, contact="nonsmooth", **how)
        sizes, forces = pulls(run, feet)
        assert np.all(sizes <= mu * forces + 1e-7)
        located = pushed(table(feet), load, mbd.RadauIIA(), dt=2e-3, **how)
        ends = np.array([[each[f"float.{name}"][-1] for name in ("x.rate", "y.rate", "angular_velocity.z")]
                         for each in (run, located)])  # fmt: skip
        assert ends[0] == pytest.approx(ends[1], abs=5.0 * dt / 0.1 * np.max(np.abs(ends[1]))), seed


@pytest.mark.parametrize(
    ("center", "dt", "least"),
    [(FEET[3][0], 4e-3, 1.9), ((2.0, 0.5), 4e-3, 1.9), ((0.3, 0.1), 1e-3, 1.85)],
    ids=["a foot", "afar", "beside a foot"],
)
def test_a_table_that_turns_and_stops_is_of_second_order(center, dt, least):
    """Beside a foot its direction turns within a few steps, so that the order of 2 shows from 1 ms on only."""
    model, rate = table(FEET[3]), 2.0
    speed = {"float.x.rate": rate * center[1], "float.y.rate": -rate * center[0], "float.angular_velocity.z": rate}
    start = mbd.assemble(
        model, position={"float.z": HEIGHT}, velocity=speed, closed=[each.name for each in model.constraints]
    )

    def end(scheme, dt):
        run = mbd.simulate(model, start, scheme, dt=dt, until=0.6)
        return np.array([run[f"float.{name}"][-1] for name in ("x", "y", "rotation_vector.z")])

    exact = end(mbd.RadauIIA(), 5e-4)
    errors = [np.max(np.abs(end(mbd.HHT(0.05), step) - exact)) for step in (dt, 0.5 * dt)]
    assert least < np.log2(errors[0] / errors[1]) < 2.1


def stool_with_an_arm(seed):
    """A stool on three feet, with an arm on a dry ball joint that a torque turns."""
    rng = np.random.default_rng(seed)
    model = mbd.Model("stool", gravity=(0.0, 0.0, -G))
    base = mbd.RigidBody("base", rng.uniform(1.0, 6.0), tuple(rng.uniform(0.08, 0.15, 3)))
    arm = mbd.RigidBody("arm", 1.0, tuple(rng.uniform(0.02, 0.03, 3)), center=(0.0, 0.0, -0.2))
    model.connect(mbd.Free("place", model.ground.origin, base.origin))
    mu, size = rng.uniform(0.6, 1.2), rng.uniform(1.5, 4.0)
    for k in range(3):
        angle = 2.0 * np.pi * k / 3.0 + rng.uniform(0.0, 0.3)
        foot = base.point(0.3 * np.cos(angle), 0.3 * np.sin(angle), -0.3)
        model.constrain(
            mbd.Unilateral(f"foot {k}", mbd.touchdown(foot, mbd.Plane(normal=(0.0, 0.0, 1.0))), friction=mu)
        )
    model.connect(mbd.Spherical("hip", base.point(0.0, 0.0, 0.1), arm.origin, loss=mbd.Coulomb(rng.uniform(0.2, 0.6))))
    torque = (lambda t: size * mbd.sin(1.3 * t), lambda t: size * mbd.cos(2.1 * t) - size, 0.0)
    model.apply(mbd.Applied("drive", arm.origin, torque=torque))
    return model, mbd.assemble(model, {"place.z": 0.3}, closed=[f"foot {k}" for k in range(3)])


@pytest.mark.sampled(2)
@pytest.mark.parametrize("seed", [1, 2])
def test_explicit_steps_share_a_load_among_feet_once_while_a_joint_slides(seed):
    """Forces that feet in their cones share were shared out again, by another rule: their sum was another one."""
    model, start = stool_with_an_arm(seed)
    runs = [mbd.simulate(model, start, scheme, dt=2e-3, until=1.0) for scheme in (mbd.RadauIIA(), mbd.RungeKutta853())]
    assert [(event.name, event.kind) for event in runs[1].events] == [(e.name, e.kind) for e in runs[0].events]
    times = np.linspace(0.3, 0.99, 24)
    for k in range(3):
        for part in ("force", "friction.forward", "friction.sideways"):
            implicit, explicit = (run.at(times)[f"foot {k}.{part}"] for run in runs)
            np.testing.assert_allclose(explicit, implicit, rtol=0.0, atol=1e-4)
