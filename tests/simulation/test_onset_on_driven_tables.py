"""A block on a table whose motion is prescribed slips where m |ẍ(t)| = F_s: a root of a known function."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

import mbd

SCHEMES = (
    mbd.HHT(0.05),
    mbd.HHT(0.05, start="consistent"),
    mbd.HHT(0.3),
    mbd.GeneralizedAlpha(0.9),
    mbd.GeneralizedAlpha(0.0),
    mbd.Newmark(),
    mbd.HHT(0.05, formulation="index3"),
    mbd.RadauIIA(),
    mbd.RungeKutta853(),
)
EARLIEST = 0.12
"""When the block sticks at the latest [s]: a table may begin too fast for it."""


def swung(seed):
    """A block on a table that a spline leads to a sudden halt; its acceleration there jumps to and fro, knot by knot.

    Returns the model, the acceleration of the table over time, the largest one at which the block sticks [m/s²], and
    when the spline ends [s].
    """
    rng = np.random.default_rng(seed)
    model = mbd.Model("table")
    table, block = mbd.PointMass("table", 3.0), mbd.PointMass("block", rng.uniform(0.5, 2.0))
    rail = mbd.Prismatic("rail", model.ground.origin, table.origin, axis=(1.0, 0.0, 0.0))
    flight = mbd.Translation("flight", model.ground.origin, block.origin, axes="xyz" if seed % 2 else "xy")
    model.connect(rail, flight)
    t = 0.02 * np.arange(rng.integers(40, 46))  # so many knots that steps do not end at them
    w = rng.uniform(4.0, 8.0)
    values = rng.uniform(0.05, 0.15) * np.sin(w * t)
    acceleration = CubicSpline(t, values, bc_type="clamped").derivative(2)
    model.constrain(mbd.Bilateral("drive", rail, value=mbd.Samples(t, values, kind="spline", ends="clamped")))
    at_knots = np.abs(acceleration(t))
    limit = rng.uniform(1.2 * np.max(at_knots[6:-7]), 0.9 * np.max(at_knots[6:]))
    mu = limit / 9.81
    law = mu if seed % 4 < 2 else mbd.Stribeck(mu, 0.85 * mu, 0.09)
    touch = mbd.touchdown(block.origin, mbd.Plane((0.0, 1.0, 0.0), 0.0, frame=table.origin))
    model.constrain(mbd.Unilateral("foot", touch, friction=law))
    return model, acceleration, limit, t[-1]


@pytest.mark.parametrize("seed", [0, 3, 6, 27, 28, 47])
def test_a_block_slips_where_its_limit_is_reached(seed):
    """Multipliers of steps that are long for the table lag: in a row just after the onset they are too small."""
    model, acceleration, limit, end = swung(seed)
    fine = np.linspace(EARLIEST, end, 20001)
    k = int(np.flatnonzero(np.abs(acceleration(fine)) > limit)[0])
    onset = brentq(lambda t: abs(acceleration(t)) - limit, fine[k - 1], fine[k], xtol=1e-14)
    dt = (onset + seed % 3 * 1.5e-4 + 1e-4) / int(onset / 0.0104)
    assert abs(acceleration(dt * np.ceil(onset / dt))) > limit
    start = mbd.assemble(model, {}, project=True)
    for scheme in SCHEMES:
        run = mbd.simulate(model, start, scheme, dt=dt, until=end)
        slips = [event.time for event in run.events if event.kind == "slipped" and event.time > EARLIEST]
        assert slips, scheme
        assert abs(slips[0] - onset) <= 1e-9, scheme


def shaken(seed):
    """A block on a table that swings to and fro and up and down, ever faster, so that both sides of |T| ≤ μ p change.

    Returns the model, ``|ẍ| − μ (g + ÿ)`` over time, and an instant before which the block sticks [s].
    """
    rng = np.random.default_rng(seed)
    model = mbd.Model("table")
    table, block = mbd.PointMass("table", 3.0), mbd.PointMass("block", rng.uniform(0.5, 2.0))
    flight = mbd.Translation("flight", model.ground.origin, block.origin, axes="xyz" if seed % 2 else "xy")
    model.connect(mbd.Translation("rail", model.ground.origin, table.origin), flight)
    t = 0.02 * np.arange(42)
    excess = []
    for name, rate, least, most in ("x", rng.uniform(4.0, 8.0), 0.1, 0.3), ("y", rng.uniform(8.0, 16.0), 0.05, 0.2):
        values = rng.uniform(least, most) * t**2 * np.sin(rate * t)
        excess.append(CubicSpline(t, values, bc_type="clamped").derivative(2))
        drive = mbd.Samples(t, values, kind="spline", ends="clamped")
        model.constrain(mbd.Bilateral(f"drive {name}", mbd.measure(lambda s: s, f"rail.{name}"), value=drive))
    fine = np.linspace(0.0, t[-1], 20001)
    needed = np.abs(excess[0](fine)) / (9.81 + excess[1](fine))
    late = np.flatnonzero((needed > 1.02 * np.max(needed[fine < 0.5])) | (9.81 + excess[1](fine) < 1.0))[0]
    mu = needed[late]
    touch = mbd.touchdown(block.origin, mbd.Plane((0.0, 1.0, 0.0), 0.0, frame=table.origin))
    model.constrain(mbd.Unilateral("foot", touch, friction=mu))
    return model, lambda s: np.abs(excess[0](s)) - mu * (9.81 + excess[1](s)), fine[late - 1]


@pytest.mark.parametrize("seed", [16, 20, 30])
def test_a_block_slips_where_its_limit_comes_down_to_what_holds_it(seed):
    """Forces change by more than themselves in a step: multipliers of such a step lag by several times their change."""
    model, excess, sticks = shaken(seed)
    fine = np.linspace(sticks - 1e-3, 0.82, 4001)
    k = int(np.flatnonzero(excess(fine) > 0.0)[0])
    onset = brentq(excess, fine[k - 1], fine[k], xtol=1e-14)
    dt = (onset + seed % 3 * 1.5e-4 + 1e-4) / int(onset / 0.0104)
    start = mbd.assemble(model, {}, project=True)
    for scheme in SCHEMES[:6]:
        run = mbd.simulate(model, start, scheme, dt=dt, until=min(0.82, onset + 2.0 * dt))
        slips = [event.time for event in run.events if event.kind == "slipped"]
        assert slips and abs(slips[0] - onset) <= 1e-9, scheme


def turned(seed):
    """A block on a table that turns ever faster, sticking at the start, and when it slips [s]."""
    rng = np.random.default_rng(seed)
    spin, radius, mu = rng.uniform(0.3, 1.0), rng.uniform(0.4, 1.0), rng.uniform(0.3, 0.6)
    model = mbd.Model("turntable")
    table, block = mbd.RigidBody("table", 5.0, (1.0, 1.0, 1.0)), mbd.PointMass("block", rng.uniform(0.5, 2.0))
    turn = mbd.Revolute("turn", model.ground.origin, table.origin, axis=(0.0, 1.0, 0.0))
    model.connect(turn, mbd.Translation("flight", model.ground.origin, block.origin, axes="xyz"))
    model.constrain(mbd.Bilateral("drive", turn, value=lambda t: spin * t * t))
    law = mu if seed % 2 else mbd.Stribeck(mu, 0.6 * mu, 0.08)
    touch = mbd.touchdown(block.origin, mbd.Plane((0.0, 1.0, 0.0), 0.0, frame=table.origin))
    model.constrain(mbd.Unilateral("foot", touch, friction=law))
    onset = brentq(lambda t: radius * np.hypot(2.0 * spin, (2.0 * spin * t) ** 2) - 9.81 * mu, 0.0, 20.0, xtol=1e-14)
    return model, mbd.assemble(model, position={"flight.x": radius}, closed="foot"), onset


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("scheme", [mbd.RungeKutta853(), mbd.RungeKutta4(), mbd.RadauIIA()], ids=str)
def test_friction_goes_on_where_a_block_begins_to_slide_off_a_turntable(seed, scheme):
    """What held the block is what it slides against at first, in steps that follow a tolerance too.

    Its direction settles within ‖γ‖/(μ g), far below the steps that coordinates allow.
    """
    model, start, onset = turned(seed)
    run = mbd.simulate(model, start, scheme, tol=1e-4, until=onset + 0.02)
    assert [(event.kind, round(event.time - onset, 9)) for event in run.events] == [("slipped", 0.0)]
    rows = run.time[(run.time > onset) & (run.time < onset + 2e-3)]
    after = run.at(np.append(rows, onset + np.geomspace(1e-6, 2e-3, 20)))
    before = run.at(onset, side="left")
    friction = np.stack([after["foot.friction.forward"], after["foot.friction.sideways"]])
    held = np.array([float(before["foot.friction.forward"]), float(before["foot.friction.sideways"])])
    apart = np.linalg.norm(friction - held[:, None], axis=0)
    assert np.max(apart) < 0.02 * np.linalg.norm(held)
    assert not any("so sensitive" in str(note) for note in run.stats["notes"])
