"""Newton's, Poisson's, the sequential and Stronge's law: what all share, where they agree, and closed forms."""

from functools import cache
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.compile.mechanisms import mechanism_of
from tests.comparisons import at_least, compared
from tests.simulation.frictions import brick, rod
from tests.simulation.mechanisms import G, run

LAWS = ("newton", "poisson", "sequential")
every_law = pytest.mark.parametrize("law", LAWS)
same_brick, same_rod = cache(brick), cache(rod)


def strike(model, position, velocity, law, **more):
    """The velocities before and after the first impact, and its events."""
    trajectory = run(model, position, velocity, impact=law, until=(next(iter(model.constraints)).name, 2.0), **more)
    rows = [event.row for event in trajectory.events if event.impulse.any()]
    return trajectory, rows[0] - 1, rows[0]


def thrown(model, law, angle, forward, spin):
    """A box thrown down, until its first impact."""
    position = {"place.y": 0.36, "place.angle": angle}
    velocity = {"place.x": forward, "place.y": -2.0, "place.angle": spin}
    trajectory = run(model, position, velocity, impact=law, until=0.6, dt=0.01)
    row = next(event.row for event in trajectory.events if event.impulse.any())
    return trajectory, row - 1, row


# one contact --------------------------------------------------------------------------------------------------------
@every_law
@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.8, 1.0])
def test_all_laws_are_one_for_a_contact_without_friction(law, restitution):
    position, velocity = {"place.y": 0.6, "place.angle": 0.7}, {"place.x": 0.4, "place.angle": 1.5}
    model = same_rod(0.0, restitution)
    trajectory, before, after = strike(model, position, velocity, law)
    rate = trajectory["tip.gap_rate"]
    assert rate[after] == pytest.approx(-restitution * rate[before], rel=1e-12, abs=1e-14)
    assert trajectory["place.x.rate"][after] == pytest.approx(trajectory["place.x.rate"][before], rel=1e-13)
    other, _, place = strike(model, position, velocity, "newton")
    np.testing.assert_allclose(trajectory.record.v[after], other.record.v[place], rtol=1e-12, atol=1e-13)


@every_law
@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3, 0.5, 0.7, 0.747, 0.748, 1.5])
def test_an_oblique_blow_slides_below_the_sticking_ratio_of_impulses_and_sticks_above_it(law, mu):
    """The rod g4: sticking needs impulses (1.2501580, 1.6734189) N s, whose ratio is 0.7470682."""
    angle, speed = 0.5, np.sqrt(2.0 * G * 0.8)
    c, s = np.cos(angle), np.sin(angle)
    D = np.array([[1.0 + 3.0 * s * s, -3.0 * s * c], [-3.0 * s * c, 1.0 + 3.0 * c * c]])  # (along, up) of the tip
    stick = np.linalg.solve(D, [0.0, speed])
    assert stick == pytest.approx([1.2501580110067447, 1.6734188752642962])
    slides = mu < stick[0] / stick[1]
    push = speed / (D[1, 0] * mu + D[1, 1]) if slides else stick[1]
    wanted = [mu * push if slides else stick[0], push]
    model = same_rod(mu)
    trajectory, _before, after = strike(model, {"place.y": 0.8 + 0.5 * s, "place.angle": angle}, None, law)
    impulse = trajectory.events[0].impulse
    np.testing.assert_allclose(impulse[::-1] if mu else [0.0, impulse[0]], wanted, rtol=1e-9, atol=1e-12)
    turn = 12.0 * 0.5 * (s * wanted[0] - c * wanted[1])
    final = [wanted[0], wanted[1] - speed, turn]
    np.testing.assert_allclose(trajectory.record.v[after], final, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_the_rebound_grows_and_the_loss_falls_with_the_restitution(law):
    rebounds, losses = [], []
    for restitution in np.linspace(0.0, 1.0, 6):
        model = same_rod(0.3, float(restitution))
        trajectory, before, after = strike(model, {"place.y": 1.0, "place.angle": 0.5}, {"place.x": 1.0}, law)
        rebounds.append(trajectory["tip.gap_rate"][after])
        losses.append(trajectory.energy.kinetic[before] - trajectory.energy.kinetic[after])
    assert np.all(np.diff(rebounds) > 0.0) and rebounds[0] == pytest.approx(0.0, abs=1e-12)
    assert np.all(np.diff(losses) < 0.0) and losses[-1] > -1e-12


KANE = {"place.y": 1.0, "place.angle": 0.5 * np.pi + 0.6}
FALL = np.sqrt(2.0 * G * (1.0 - 0.5 * np.cos(0.6)))
"""A rod that falls on one end, 0.6 rad from the vertical, and the speed with which it arrives [m/s]."""


def kane(mu, forward, law):
    """Stick or friction with e = 0.9, thrown forwards by a part of the speed of its fall."""
    return strike(same_rod(mu, 0.9), KANE, {"place.x": forward * FALL}, law)


@pytest.mark.covering
@every_law
@pytest.mark.parametrize("mu", [None, 0.2, 0.5, 2.0])
@pytest.mark.parametrize("forward", [-1.5, -0.71, -0.3, 0.0, 0.3, 0.71, 1.5])
def test_restitution_where_the_tip_also_sticks_never_raises_the_energy(mu, forward, law):
    """Kane & Levinson 1985: Newton's law can, where the tip stops or turns around in the impact."""
    trajectory, before, after = kane(mu, forward, law)
    kinetic = trajectory.energy.kinetic
    assert kinetic[after] <= kinetic[before] * (1.0 + 1e-12)
    assert trajectory["tip.gap_rate"][after] >= 0.0


def test_stronges_law_takes_the_place_of_newtons_only_where_that_gains_energy():
    taken = {(mu, f): kane(mu, f, "newton")[0].stats["energetic_impacts"] for mu in (None, 0.5) for f in (-0.71, 0.71)}
    assert taken[None, -0.71] == 1
    assert taken[None, 0.71] == 0


def test_stronges_law_gives_back_e_squared_of_the_work_of_compression():
    """With a tip that sticks: compression to rest, then the same impulses times e; both phases go along one line."""
    trajectory, before, after = kane(None, -0.71, "newton")
    mechanism, record = mechanism_of(same_rod(None, 0.9)), trajectory.record
    terms = mechanism.acceleration_terms(
        record.time[after], record.q[after], record.v[before], mechanism.parameters(), trajectory.columns.anchors[after]
    )
    D = terms.B @ np.linalg.solve(terms.M, terms.B.T)
    normal, tangent = D[0], D[1]
    rate = terms.rate
    first = np.linalg.solve(D, -rate)  # to rest in both directions
    done = -0.5 * first[0] * rate[0]  # what the normal impulse took
    total = trajectory.events[0].impulse
    second = total - first
    assert second @ tangent == pytest.approx(0.0, abs=1e-12), "it sticks in restitution"
    assert 0.5 * second[0] * (second @ normal) == pytest.approx(0.81 * done, rel=1e-10)


# several contacts -----------------------------------------------------------------------------------------------------
def balance(model, trajectory, before, after):
    """M (v⁺ − v⁻) − Bᵀ Λ of the told impulses, over the size of its terms; nothing else may act."""
    mechanism, record = mechanism_of(model), trajectory.record
    terms = mechanism.acceleration_terms(
        record.time[after], record.q[after], record.v[before], mechanism.parameters(), trajectory.columns.anchors[after]
    )
    told = np.zeros(len(mechanism.equations.rows))
    contacts = {contact.name: contact for contact in mechanism.equations.contacts}
    for event in trajectory.events:
        if event.row == after and event.kind == "closed":
            told[list(contacts[event.name].rows)] = event.impulse
    change = terms.M @ (record.v[after] - record.v[before])
    return np.abs(change - terms.B.T @ told).max() / np.abs(change).max(), told, terms


@settings(max_examples=30)
@given(
    law=st.sampled_from(LAWS), mu=st.sampled_from([0.1, 0.4, 1.2]), restitution=st.sampled_from([0.0, 0.5, 1.0]),
    angle=st.one_of(st.just(0.0), st.floats(-3.0, 3.0)), forward=st.floats(-4.0, 4.0),
    spin=st.one_of(st.just(0.0), st.floats(-6.0, 6.0)),
)  # fmt: skip
def test_impulses_of_any_law_balance_push_and_stay_in_the_cone(law, mu, restitution, angle, forward, spin):
    model = same_brick(mu, restitution)
    trajectory, before, after = thrown(model, law, angle, forward, spin)
    missing, told, terms = balance(model, trajectory, before, after)
    assert missing < 1e-12
    contacts = mechanism_of(model).equations.contacts
    size = np.abs(told).max()
    end = terms.B @ (trajectory.record.v[after] - trajectory.record.v[before]) + terms.rate
    for contact in contacts:
        push, along = told[list(contact.rows)]
        assert push >= -1e-12 * size
        assert abs(along) <= mu * push + 1e-12 * size
        if abs(trajectory[f"{contact.name}.gap"][after]) < 1e-12:
            assert end[contact.rows[0]] > -1e-12 * np.abs(terms.rate).max(), "no approach is left"
    kinetic = trajectory.energy.kinetic
    assert kinetic[after] <= kinetic[before] * (1.0 + 1e-12)


@every_law
@pytest.mark.parametrize("mu", [0.0, 0.4])
@pytest.mark.parametrize("restitution", [0.0, 0.6])
def test_the_order_in_which_contacts_are_named_does_not_matter(law, mu, restitution):
    results = []
    for order in list(permutations(range(4)))[::7]:
        trajectory, _before, after = thrown(same_brick(mu, restitution, order), law, 0.0, 1.5, 0.0)
        impulses = {e.name: e.impulse for e in trajectory.events if e.row == after and e.kind == "closed"}
        results.append((trajectory.record.v[after], impulses))
    for velocity, impulses in results[1:]:
        np.testing.assert_allclose(velocity, results[0][0], rtol=0, atol=1e-12)
        for name, impulse in impulses.items():
            np.testing.assert_allclose(impulse, results[0][1][name], rtol=0, atol=1e-12)


@every_law
def test_a_ball_with_friction_and_restitution_bounces_to_rest_and_rolls_no_further(law):
    model = brick(0.3, 0.5)
    trajectory = run(model, {"place.y": 0.3, "place.angle": 0.15}, {"place.x": 0.8}, until=2.5, impact=law)
    assert trajectory["left.force"][-1] + trajectory["right.force"][-1] == pytest.approx(2.0 * G, rel=1e-9)
    np.testing.assert_allclose(trajectory.record.v[-1], 0.0, atol=1e-9)
    energy = trajectory.energy.kinetic + trajectory.energy.potential
    assert np.diff(energy)[np.diff(trajectory.time) == 0.0].max() < 1e-12
    assert len(trajectory.events) < 400


def test_a_cradle_tells_the_laws_apart():
    """Two balls at rest struck by a third, e = 1: Newton −1/3, 2/3, 2/3; one after the other 0, 0, 1."""
    model = mbd.Model("cradle", gravity=(0, 0, 0))
    for k in range(3):
        body = mbd.PointMass(f"ball {k}", mass=1.0)
        model.connect(mbd.Prismatic(f"p{k}", model.ground.origin, body.origin))
    for k in range(2):
        gap = mbd.measure(lambda a, b: b - a - 0.1, f"p{k}.displacement", f"p{k + 1}.displacement")
        model.constrain(mbd.Unilateral(f"c{k}", gap, restitution=1.0))
    place = {"p0.displacement": -0.5, "p1.displacement": 0.1, "p2.displacement": 0.2}
    wanted = {"newton": [-1 / 3, 2 / 3, 2 / 3], "sequential": [0, 0, 1]}
    for law in LAWS:
        trajectory = run(model, place, {"p0.displacement": 1.0}, until=1.0, impact=law)
        if law in wanted:
            np.testing.assert_allclose(trajectory.record.v[-1], wanted[law], rtol=0, atol=1e-12)
        assert trajectory.record.v[-1].sum() == pytest.approx(1.0, rel=1e-12)
        assert np.diff(trajectory.energy.kinetic).max() < 1e-12


@pytest.mark.parametrize(
    "scheme", [mbd.HHT(), mbd.GeneralizedAlpha(0.8), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr
)
def test_a_stop_that_bounces_comes_to_rest_whatever_pushes_it(scheme):
    """The series of bounces has an end; near it a contact may part too slowly for its next instant to be reported."""
    rng = np.random.default_rng(4)
    for _ in range(6):
        model = mbd.Model("stop", gravity=(0.0, 0.0, 0.0))
        flap = mbd.RigidBody("flap", mass=rng.uniform(0.2, 3.0), inertia=rng.uniform(0.02, 0.4))
        pin = mbd.Revolute("pin", model.ground.origin, flap.point(*rng.uniform(-0.4, 0.4, 2)),
                           stiffness=10.0 ** rng.uniform(1.0, 4.0), rest=rng.uniform(0.5, 1.0))  # fmt: skip
        model.connect(pin)
        model.constrain(mbd.Unilateral("stop", mbd.flexion(pin), restitution=rng.uniform(0.1, 0.7)))
        start = mbd.assemble(model, position={"pin.angle": -0.3})
        run = mbd.simulate(model, start, scheme, dt=10.0 ** rng.uniform(-4.0, -2.0), until=1.5)
        assert run["stop.force"][-1] > 0.0 and abs(run["pin.rate"][-1]) < 1e-9


@pytest.mark.parametrize("seeds", [(11, 19, 21), pytest.param(range(40), marks=pytest.mark.slow)])
@at_least(10)
def test_a_rough_foot_on_a_ball_joint_rebounds_whatever_its_friction(seeds):
    """Its three rows leave two motions: with restitution neither sticking nor sliding may obey Newton's law."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        model = mbd.Model("swinging")
        mass, inertia = rng.uniform(0.5, 3.0), tuple(rng.uniform(0.03, 0.05, 3))
        body = mbd.RigidBody("body", mass, inertia, center=tuple(0.2 * rng.normal(size=3)))
        model.connect(mbd.Spherical("ball", model.ground.origin, body.origin))
        tip = body.point(*rng.uniform(-0.6, 0.6, 3))
        wall = mbd.Plane(tuple(rng.normal(size=3)), offset=rng.uniform(-0.5, -0.2))
        e = rng.choice([0.0, 0.5])
        model.constrain(mbd.Unilateral("foot", mbd.touchdown(tip, wall), friction=1.5, restitution=e))
        speeds = {f"ball.angular_velocity.{axis}": 5.0 * rng.normal() for axis in "xyz"}
        for law in ("newton", "poisson", "sequential"):
            run = mbd.simulate(
                model, mbd.assemble(model, velocity=speeds), mbd.RadauIIA(), dt=5e-3, until=1.0, impact=law
            )
            for event in run.events:
                if event.kind == "closed":
                    compared()
                    assert np.linalg.norm(event.impulse[1:]) <= 1.5 * event.impulse[0] * (1.0 + 1e-9) + 1e-12
                    assert event.energy_loss >= -1e-12 * mass
                    assert run["foot.gap_rate"][event.row] >= -1e-9
