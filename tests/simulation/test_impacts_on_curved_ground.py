"""A foot that strikes curved ground meets the plane that touches it there: velocities, impulses, their derivatives."""

import inspect
import itertools
import math

import numpy as np
import pytest

import mbd
from mbd.hardcases.impacts import impact_figures
from tests.helpers import one_body
from tests.sensitivity.differences import end

LAWS = ("newton", "poisson", "sequential")
FLIGHT = 0.03
AFTER = 0.012
KINDS = ("point in the plane", "body in the plane", "point in space", "body in space")
SCHEMES = {"auto": mbd.RadauIIA(), "nonsmooth": mbd.HHT(0.05)}


def mechanism(kind, ground, **law):
    planar = "plane" in kind
    model = mbd.Model(kind, gravity=(0.3, -9.81, 0.0 if planar else 0.2))
    if kind.startswith("point"):
        body = mbd.PointMass("body", mass=1.3)
        joint, foot = mbd.Translation("place", model.ground.origin, body.origin, axes="xy" if planar else "xyz"), (0, 0)
    else:
        body = mbd.RigidBody("body", 1.3, 0.2 if planar else (0.2, 0.15, 0.25))
        joint, foot = (mbd.Planar if planar else mbd.Free)("place", model.ground.origin, body.origin), (0.3, -0.2)
    model.connect(joint)
    tip = body.point(*foot, *(() if planar else (0.1 * (foot != (0, 0)),)), name="tip")
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(tip, ground), **law))
    return model


def hill(rng, planar, moves):
    """A height function of x, z, t with the arguments that it needs."""
    a, b, c, d, rise = rng.uniform(-0.6, 0.6, 5)

    def level(x):
        return a * x + 0.5 * b * x * x + 0.2 * mbd.sin(3.0 * x + c)

    def across(x, z):
        return level(x) + d * z + b * x * z + 0.3 * z * z

    if planar:
        return (lambda x, t: level(x) + rise * t * (1.0 + 0.5 * x)) if moves else level
    return (lambda x, z, t: across(x, z) + rise * t * (1.0 + 0.5 * x - 0.3 * z)) if moves else across


def touching(ground, x, z, t):
    """Height, unit normal and rise of the ground at a place."""
    names, at = list(inspect.signature(ground).parameters), {"x": x, "z": z, "t": t}

    def value(**change):
        return float(ground(*({**at, **change}[name] for name in names)))

    size = 1e-5
    slope = {n: (value(**{n: at[n] + size}) - value(**{n: at[n] - size})) / (2.0 * size) for n in at}
    normal = np.array([-slope["x"], 1.0, -slope["z"]])
    return value(), normal / np.linalg.norm(normal), np.array([0.0, slope["t"], 0.0])


def start(rng, model, kind, ground):
    """A state from which the foot strikes the ground after the time of the flight, at a random place and speed."""
    planar = "plane" in kind
    x, z = rng.uniform(-1.0, 1.0), 0.0 if planar else rng.uniform(-1.0, 1.0)
    height, normal, rise = touching(ground, x, z, FLIGHT)
    velocity = rng.normal(size=3) * (1.0, 1.0, 0.0 if planar else 1.0)
    velocity += rise - normal * (normal @ velocity + rng.uniform(0.8, 3.0))
    place, turn = np.array([x, height, z]) - FLIGHT * velocity, {}
    if kind == "body in the plane":
        angle, rate = rng.uniform(-1.0, 1.0), rng.normal()
        c, s = math.cos(angle), math.sin(angle)
        arm = np.array([0.3 * c + 0.2 * s, 0.3 * s - 0.2 * c, 0.0])
        turn, velocity = {"place.angle": (angle, rate)}, velocity - rate * np.array([-arm[1], arm[0], 0.0])
        place = place - arm
    elif kind == "body in space":
        place = place - (0.3, -0.2, 0.1)
    axes = "xy" if planar else "xyz"
    q = {f"place.{axis}": value for axis, value in zip(axes, place, strict=False)}
    v = {f"place.{axis}": value for axis, value in zip(axes, velocity, strict=False)}
    for name, (value, rate) in turn.items():
        q[name], v[name] = value, rate
    return lambda model: mbd.assemble(model, position=q, velocity=v)


def strike(model, begin, contact, law):
    """The first impact: its impulse, the velocities after it, its instant and where the foot was."""
    run = mbd.simulate(
        model, begin(model), SCHEMES[contact], dt=1e-3, until=FLIGHT + AFTER, impact=law, contact=contact,
        on_failure="return",
    )  # fmt: skip
    event = next(event for event in run.events if event.kind == "closed")
    row = np.flatnonzero(run.time == event.time)[-1]
    return event.impulses["foot"], run.record.v[row], event.time, np.array([run[f"body.tip.{k}"][row] for k in "xyz"])


def cases(seed):
    for k, (law, contact, kind) in enumerate(itertools.product(LAWS, SCHEMES, KINDS)):
        rng = np.random.default_rng((seed, k))
        e, friction = rng.choice([0.0, 0.5, 1.0]), rng.choice([None, None, None, 0.3, 1.0])
        yield rng, law, contact, kind, float(e), friction


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 12))])
def test_an_impact_on_curved_ground_is_that_on_the_plane_that_touches_it(seed):
    for rng, law, contact, kind, e, friction in cases(seed):
        ground = hill(rng, "plane" in kind, rng.random() < 0.4)
        curved = mechanism(kind, ground, restitution=e, friction=friction)
        begin = start(rng, curved, kind, ground)
        impulse, after, time, place = strike(curved, begin, contact, law)
        _, normal, rise = touching(ground, place[0], place[2], time)
        plane = mbd.Plane(tuple(normal), offset=float(normal @ (place - rise * time)), velocity=tuple(rise))
        flat = mechanism(kind, plane, restitution=e, friction=friction)
        on_plane = strike(flat, begin, contact, law)
        off = 1e-8 if contact == "auto" else 5e-3 * np.linalg.norm(on_plane[0])  # its steps end within dt of the ground
        what = f"{law}, {contact}, {kind}, e = {e}, friction = {friction}"
        assert after == pytest.approx(on_plane[1], abs=off), what
        assert np.linalg.norm(impulse) == pytest.approx(np.linalg.norm(on_plane[0]), abs=2.0 * off), what
        assert impulse[0] == pytest.approx(on_plane[0][0], abs=2.0 * off), what


@pytest.mark.parametrize("contact", SCHEMES)
@pytest.mark.parametrize("law", LAWS)
def test_a_sticking_foot_that_rebounds_leaves_along_the_normal(law, contact):
    """At rest in its tangent, with e times its approach along the normal, at the place where it strikes."""
    ground = hill(np.random.default_rng(5), False, False)
    model = mechanism("point in space", ground, restitution=0.5)
    begin = start(np.random.default_rng(6), model, "point in space", ground)
    impulse, after, time, place = strike(model, begin, contact, law)
    normal = touching(ground, place[0], place[2], time)[1]
    assert np.linalg.norm(after - normal * (normal @ after)) < 1e-9
    assert normal @ after > 0.0
    assert impulse[0] == pytest.approx(3.0 * 1.3 * normal @ after, rel=2e-2 if contact == "nonsmooth" else 1e-9)


def walker(rng):
    """A hip with two legs, whose feet stick on a hill that rises by waves."""
    slope, wave, phase = rng.uniform(0.2, 0.6), rng.uniform(0.02, 0.1), rng.uniform(0.0, 6.0)

    def ground(x):
        return slope * x + wave * mbd.sin(4.0 * x + phase)

    model, hip = one_body(mbd.PointMass("hip", mass=1.0), mbd.Translation, "trunk", title="walker")
    for side in ("left", "right"):
        leg = mbd.Link(f"{side} leg", mass=0.3, length=1.0, center=0.5, inertia=0.02)
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, leg.start))
        model.constrain(mbd.Unilateral(f"{side} foot", mbd.touchdown(leg.end, ground)))
    x, left, right = rng.uniform(-1.0, 1.0), rng.uniform(-0.5, 0.0), rng.uniform(0.1, 0.6)
    feet = [slope * (x + math.sin(a)) + wave * math.sin(4.0 * (x + math.sin(a)) + phase) + math.cos(a)
            for a in (left, right)]  # fmt: skip
    state = mbd.assemble(
        model,
        position={"trunk.x": x, "trunk.y": max(feet) + 0.05, "left hip.angle": left, "right hip.angle": right},
        velocity={"trunk.x": rng.uniform(0.5, 3.0), "left hip.angle": rng.normal(), "right hip.angle": rng.normal()},
    )
    return model, state


@pytest.mark.parametrize("seeds", [range(6), pytest.param(range(6, 120), marks=pytest.mark.slow)])
def test_walkers_uphill_strike_as_their_laws_say(seeds):
    """Momentum balances, feet push, nothing gains energy, and feet that stay are at rest."""
    struck = 0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        model, state = walker(rng)
        run = mbd.simulate(model, state, mbd.RungeKutta853(), dt=1e-2, until=0.4, on_failure="return")
        assert any(event.kind == "closed" for event in run.events), (seed, run.message)
        figures = impact_figures(model, run)
        assert all(figure.passed for figure in figures), (seed, figures)
        struck += len(run.events)
    assert struck >= 2 * len(seeds)


DERIVED = (("newton", None, 0.0, False), ("poisson", None, 0.5, True), ("sequential", 0.3, 0.4, False))


@pytest.mark.parametrize(("law", "friction", "e", "moves"), DERIVED)
def test_derivatives_through_impacts_on_curved_ground_are_those_of_runs(law, friction, e, moves):
    rng = np.random.default_rng(3)
    ground = hill(rng, True, moves)
    model = mechanism("body in the plane", ground, restitution=e, friction=friction)
    state = start(rng, model, "body in the plane", ground)(model)
    settings = {"dt": 5e-3, "until": 0.05, "impact": law}
    wrt = ["place.x", "place.y", "place.angle", "place.x.rate", "place.angle.rate"]
    of = ["place.x.rate", "place.y.rate", "place.angle.rate", "place.angle"]
    found = mbd.sensitivities(model, state, mbd.RadauIIA(), wrt=wrt, of=of, **settings).matrix
    columns = []
    for name in wrt:
        (ahead, one), (behind, two) = (end(model, state, mbd.RadauIIA(), name, s * 1e-5, **settings) for s in (1, -1))
        assert one == two
        columns.append((ahead - behind)[[3, 4, 5, 2]] / 2e-5)
    assert found == pytest.approx(np.column_stack(columns), abs=1e-6 * np.max(np.abs(columns)))


@pytest.mark.parametrize("seed", range(3))
def test_sliding_friction_is_the_same_in_both_rows_of_the_impact_of_another(seed):
    """Two masses that share nothing but the ground: the forces of the one that slides go on as the other strikes."""
    rng = np.random.default_rng((seed, 77))
    ground = hill(rng, False, False)
    model, place, velocity = mbd.Model("two masses"), {}, {}
    for name, friction in (("slider", 0.2), ("striker", None)):
        body = mbd.PointMass(name, mass=1.3)
        model.connect(mbd.Translation(f"{name} place", model.ground.origin, body.origin, axes="xyz"))
        model.constrain(mbd.Unilateral(f"{name} foot", mbd.touchdown(body.origin, ground), friction=friction))
        x, z = rng.uniform(-0.5, 0.5, 2)
        above = 0.02 if name == "slider" else 0.3
        place |= {f"{name} place.x": x, f"{name} place.y": touching(ground, x, z, 0.0)[0] + above}
        place |= {f"{name} place.z": z}
        velocity |= {f"{name} place.x": 1.5 * (name == "slider"), f"{name} place.z": 1.0 * (name == "slider")}
    run = mbd.simulate(
        model, mbd.assemble(model, position=place, velocity=velocity), mbd.HHT(0.05), dt=2e-3, until=0.3,
        contact="events",
    )  # fmt: skip
    row = next(event.row for event in run.events if event.name == "striker foot" and event.kind == "closed")
    parts = [run[f"slider foot.friction.{part}"] for part in ("forward", "sideways")]
    assert run.time[row] == run.time[row - 1] and np.hypot(*(part[row] for part in parts)) > 0.5
    for part in parts:
        assert part[row - 1] == pytest.approx(part[row], abs=1e-9)


@pytest.mark.parametrize("friction", [None, 0.6, 3.0])
def test_a_foot_on_a_steep_hill_that_can_neither_stick_nor_leave_is_told_to_slip(friction):
    """Held it would pull (−0.58 N), released it would sink in (−1.2 m/s²); with friction it slips and goes on."""
    model, body = one_body(mbd.RigidBody("body", 1.448, 0.1082), mbd.Planar, "flight")
    sole = mbd.touchdown(body.point(-0.2, -0.1), lambda x: 0.2873 * mbd.sin(2.107 * x))
    model.constrain(mbd.Unilateral("foot", sole, friction=friction))
    start = mbd.assemble(model, position={"flight.x": 1.72, "flight.y": 0.8636, "flight.angle": 0.0604})
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=5e-3, until=0.45, contact="events", on_failure="return")
    assert run.success == (friction is not None)
    assert run.success or "with which it slips there" in run.message
