"""No silent explosion of energy: what a scheme puts into a mechanism is reported, and right runs hear nothing."""

import numpy as np
import pytest
import sympy

import mbd
from mbd.results.energy import doubted_ledger
from mbd.simulation.diagnostics.energy import EnergyWatch, judgement
from mbd.simulation.simulate import prepared
from tests.comparisons import at_least, compared
from tests.helpers import one_body
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start

G = (0.0, -9.81, 0.0)
DAMPED = mbd.HHT(alpha=0.05)


def told(run):
    """What the notes say of the scheme's own energy."""
    return [note for note in run.stats["notes"] if note.startswith("numerical energy")]


# explosions -----------------------------------------------------------------------------------------------------------
def thrown(rate=20.0):
    """Two rods of 1 m, the first thrown around."""
    model = mbd.Model("thrown", gravity=G)
    upper, lower = (mbd.Link(name, 1.0, 1.0, 0.5) for name in ("upper", "lower"))
    shoulder, elbow = mbd.Revolute("s", model.ground.origin, upper.start), mbd.Revolute("e", upper.end, lower.start)
    model.connect(shoulder, elbow)
    angles = {"s.angle": 1.0, "e.angle": 1.0}
    return model, mbd.assemble(model, position=angles, velocity={"s.angle": rate, "e.angle": -rate})


def chain(stiffness, mass=0.1, count=5):
    """Points on stiff springs, hung out of line."""
    model = mbd.Model("chain", gravity=G)
    before, places = model.ground.origin, {}
    for k in range(count):
        point = mbd.PointMass(f"p{k}", mass)
        model.connect(mbd.Translation(f"t{k}", model.ground.origin, point.origin))
        model.apply(mbd.Spring(f"k{k}", before, point.origin, stiffness=stiffness, length=0.2))
        before = point.origin
        places |= {f"t{k}.x": 0.16 * (k + 1) + 0.02 * (k % 2), f"t{k}.y": -0.12 * (k + 1)}
    return model, mbd.assemble(model, position=places)


EXPLODING = {
    "stiff chain": (lambda: chain(1e5), mbd.Newmark(), 1e-2, 1.0),
    "stiff chain, damped scheme": (lambda: chain(3e5), DAMPED, 7e-3, 1.0),
    "soft chain, huge steps": (lambda: chain(1e3), DAMPED, 0.1, 3.0),
}


@pytest.mark.parametrize("name", EXPLODING)
def test_a_run_whose_energy_explodes_ends_in_an_error_that_keeps_it(name):
    scene, scheme, dt, until = EXPLODING[name]
    model, start = scene()
    with pytest.raises(mbd.SimulationError, match=r"numerical energy gain .* dt below") as caught:
        mbd.simulate(model, start, scheme, dt=dt, until=until)
    run, message = caught.value.run, str(caught.value)
    assert not run.success and run.message == message and run.time[-1] == pytest.approx(until)
    first = int(np.searchsorted(run.time, float(message.split("t = ")[1].split(" s")[0]) - 1e-9))
    energy = run.energy
    before = slice(0, first)  # until then the energy stays within what the motion turns over
    turned = np.ptp(energy.kinetic[before]) + np.ptp(energy.potential[before])
    assert np.max(energy.total[before]) - energy.total[0] <= turned + 1e-9
    assert np.max(energy.total) - energy.total[0] > 2.0 * turned
    assert run.failure is not None and run.failure.message == message


def test_a_run_that_fails_after_an_explosion_names_both():
    found = 0
    for rate in range(14, 28, 2):  # which of them grow for long enough before a step fails is a matter of round-off
        model, start = thrown(float(rate))
        run = mbd.simulate(model, start, DAMPED, dt=0.05, until=3.0, on_failure="return")
        first, _, second = run.message.partition("; before that, ")
        if run.success or not second:
            continue
        assert "numerical energy" not in first and "numerical energy gain" in second
        assert mbd.replay(run.failure).reproduced
        found += 1
    assert found > 0


def test_smaller_steps_of_the_same_scenes_are_right():
    for (model, start), dt in ((thrown(), 2e-3), (chain(1e3), 3e-3)):
        run = mbd.simulate(model, start, mbd.Newmark(), dt=dt, until=1.0)
        assert run.success and not told(run)


def test_a_long_run_stops_soon_after_its_explosion():
    model, start = chain(1e5)
    run = mbd.simulate(model, start, mbd.Newmark(), dt=1e-2, until=2000.0, on_failure="return")
    assert not run.success and "numerical energy gain" in run.message and len(run.time) < 50000
    assert run.time[-1] < 500.0 and run.final.time == pytest.approx(run.time[-1])


def test_energy_that_a_damped_scheme_takes_is_a_note():
    model, start = chain(1e3)
    run = mbd.simulate(model, start, DAMPED, dt=1e-2, until=3.0)
    (note,) = told(run)
    assert "numerical energy loss" in note
    assert f"{-np.min(run.energy.numerical):.3g} J" in note


def test_an_overshoot_that_a_damped_scheme_takes_back_is_a_note():
    x = mbd.Coordinate("x", unit="m")
    model = mbd.Lagrangian("stiff", [x], kinetic=x.v**2 / 2, potential=1e6 * x.q**2 / 2)
    run = mbd.simulate(model, mbd.assemble(model, position={"x": 1.0}), mbd.HHT(alpha=0.1), dt=1.0, until=60.0)
    (note,) = told(run)
    assert "numerical energy gain" in note and run.energy.total[-1] < run.energy.total[0] < np.max(run.energy.total)


# no false alarms ------------------------------------------------------------------------------------------------------
def ball_on(ground, height, contact="events", dt=1e-3, until=1.5, **law):
    model, ball = one_body(mbd.PointMass("ball", mass=0.3), mbd.Translation, "flight", gravity=G, axes="y")
    model.constrain(mbd.Unilateral("table", mbd.touchdown(ball.origin, ground), **law))
    start = mbd.assemble(model, position={"flight.y": height}) if height else mbd.assemble(model, closed="table")
    return mbd.simulate(model, start, DAMPED, dt=dt, until=until, contact=contact)


def rod(build, velocity=0.0, angle=0.3, scheme=DAMPED, dt=2e-3, until=2.0, **options):
    """One rod on a hinge, with what `build(model, hinge, rod)` adds."""
    model = mbd.Model("rod", gravity=options.pop("gravity", G))
    link = mbd.Link("link", 1.0, 1.0, 0.5)
    hinge = mbd.Revolute("hinge", model.ground.origin, link.start, **options.pop("hinge", {}))
    model.connect(hinge)
    build(model, hinge, link)
    given = {} if angle is None else {"position": {"hinge.angle": angle}, "velocity": {"hinge.angle": velocity}}
    return mbd.simulate(model, mbd.assemble(model, **given), scheme, dt=dt, until=until, **options)


def nothing(model, hinge, link):
    """A rod alone."""


def prescribed(model, hinge, link):
    model.constrain(mbd.Bilateral("crank", hinge, value=lambda t: 5.0 * t * t))


def started(model, hinge, link):
    model.apply(mbd.Motor("motor", hinge, torque=30.0))


def pulsed(model, hinge, link):
    model.apply(mbd.Motor("motor", hinge, torque=lambda t: mbd.where(t < 1.0, 0.0, 200.0)))


def pushed_back(model, hinge, link):
    """Negative damping: a force that feeds the swing until it is large."""
    model.apply(
        mbd.Motor("feed", hinge, torque=lambda w, q: w * (4.0 - q * q), arguments=("hinge.angle.rate", "hinge.angle"))
    )


def kicked(model, hinge, link):
    def reset(values):
        return {"hinge.angle.rate": 20.0}

    model.constrain(mbd.Event("kick", mbd.measure(lambda q: q, hinge), direction=-1, reset=reset))


def stiffened(model, hinge, link):
    def update(t, values, state):
        return {"spring.stiffness": 1.0 + 500.0 * (t > 0.5)}

    model.tunable = ("spring.stiffness",)
    controller = mbd.Controller("stiffen", update, writes=("spring.stiffness",), period=0.1)
    model.apply(mbd.TorsionSpring("spring", hinge, stiffness=1.0), controller)


def resting(contact):
    return ball_on(mbd.Plane(), 0.0, contact)


def walk():
    model = kneed_walker()
    return mbd.simulate(model, kneed_walker_start(model), DAMPED, dt=1e-3, until=2.0)


def chaos():
    model, start = thrown(5.0)
    return mbd.simulate(model, start, mbd.Newmark(), dt=2e-3, until=20.0)


def lagrangian(more=lambda x: 0.0, start=1e-2, until=5.0, **rest):
    """One coordinate x of mass 1 kg, with more kinetic energy and what else is given, as functions of it."""
    x = mbd.Coordinate("x", unit="m")
    made = {name: term(x) for name, term in rest.items()}
    model = mbd.Lagrangian("x", [x], kinetic=x.v**2 / 2 + more(x), **made)
    return mbd.simulate(model, mbd.assemble(model, position={"x": start}), DAMPED, dt=2e-3, until=until)


RIGHT = {
    "rod alone": lambda: rod(nothing),
    "rod that hangs": lambda: rod(nothing, angle=0.0),
    "rod that almost stands": lambda: rod(nothing, angle=np.pi - 1e-9, until=8.0),
    "rod without weight, at rest": lambda: rod(nothing, gravity=(0.0, 0.0, 0.0)),
    "rod in honey": lambda: rod(nothing, velocity=5.0, hinge={"loss": mbd.Viscous(50.0)}, dt=0.05),
    "dry hinge": lambda: rod(nothing, velocity=5.0, hinge={"loss": mbd.Coulomb(2.0)}),
    "motor from rest": lambda: rod(started),
    "motor from rest, few rows": lambda: rod(started, store=100),
    "motor that begins late": lambda: rod(pulsed),
    "prescribed from rest": lambda: rod(prescribed, angle=None),
    "fed by a force": lambda: rod(pushed_back, angle=1e-3, until=6.0),
    "fed by a force, few rows": lambda: rod(pushed_back, angle=1e-3, until=6.0, store=70),
    "kicked by an event": lambda: rod(kicked),
    "stiffened by a controller": lambda: rod(stiffened),
    "hoop that is turned": lambda: lagrangian(
        lambda x: 200.0 * sympy.sin(x.q) ** 2, potential=lambda x: -9.81 * sympy.cos(x.q)
    ),
    "van der Pol": lambda: lagrangian(
        start=1e-3, until=20.0, potential=lambda x: x.q**2 / 2, forces=lambda x: {x: 2.0 * (1.0 - x.q**2) * x.v}
    ),
    "loss that gives": lambda: lagrangian(potential=lambda x: x.q**2 / 2, dissipation=lambda x: -(x.v**2) / 2),
    "potential without floor": lambda: lagrangian(start=1e-5, until=0.8, potential=lambda x: -250.0 * x.q**2),
    "chaos": chaos,
    "walk": walk,
    "fall without end": lambda: ball_on(mbd.Plane(offset=-1e6), 1.0, until=30.0, dt=1e-2),
    "rest": lambda: resting("events"),
    "rest, nonsmooth": lambda: resting("nonsmooth"),
    **{
        f"{what}, {contact}": lambda ground=ground, height=height, law=law, contact=contact: ball_on(
            ground, height, contact, **law
        )
        for contact in ("events", "nonsmooth")
        for what, ground, height, law in (
            ("ball that bounces", mbd.Plane(), 1.0, {"restitution": 0.9}),
            ("ball on a rising floor", mbd.Plane(velocity=(0.0, 3.0)), 0.1, {"restitution": 0.5}),
            ("ball thrown by a table", lambda t: 0.05 * mbd.sin(30.0 * t), 0.0, {"restitution": 0.3}),
            ("ball carried by a table", lambda t: 0.2 * mbd.sin(3.0 * t), 0.0, {}),
        )
    },
}


@pytest.mark.parametrize("name", RIGHT)
def test_a_right_run_is_neither_refused_nor_doubted(name):
    run = RIGHT[name]()
    assert run.success and not told(run)
    q = run.record.q
    found = judgement(*doubted_ledger(run.columns), np.max(np.abs(q - q[0]), axis=1))  # also where a glance sufficed
    assert found.row == -1 and abs(found.share) < 0.1


def test_a_single_step_that_makes_energy_where_there_is_none_is_refused():
    model, point = one_body(mbd.PointMass("p", 1.0), mbd.Translation, "t", title="stiff", gravity=G)
    model.apply(mbd.Spring("k", model.ground.point(0.0, 1.0), point.origin, stiffness=1e9, length=1.0))
    start = mbd.assemble(model, position={"t.x": 0.3, "t.y": 0.01})
    with pytest.raises(mbd.SimulationError, match=r"ω dt = .* but RungeKutta853 is stable up to 5.96") as caught:
        mbd.simulate(model, start, mbd.RungeKutta853(), dt=1.0, until=1.0)
    assert len(caught.value.run.time) == 1


def oscillators(rng, damped):
    """Bodies on springs in a chain of random lengths, masses, units; its matrices M, K, C, and a start."""
    n, unit = int(rng.integers(1, 4)), 10.0 ** rng.uniform(-6, 6)
    masses, springs = unit * 10.0 ** rng.uniform(-1, 1, n), unit * 10.0 ** rng.uniform(0, 4, n)
    losses = 2.0 * np.sqrt(masses * springs) * rng.uniform(0.0, 3.0, n) * damped
    model, M, K, C = mbd.Model("chain", gravity=(0.0, 0.0, 0.0)), np.zeros((n, n)), np.diag(springs), np.diag(losses)
    onto = model.ground.origin
    for i in range(n):
        body = mbd.PointMass(f"body {i}", masses[i])
        loss = mbd.Viscous(losses[i]) if damped else None
        model.connect(mbd.Prismatic(f"slide {i}", onto, body.origin, axis=(1, 0, 0), stiffness=springs[i], loss=loss))
        onto = body.origin
        M[: i + 1, : i + 1] += masses[i]
    size = 10.0 ** rng.uniform(-3, 1)
    place = {f"slide {i}.displacement": size * rng.uniform(-1, 1) for i in range(n)}
    at_rest = rng.random() < 0.5
    rates = {} if at_rest else {name: 1e3 * size * rng.uniform(-1, 1) for name in place}
    return model, mbd.assemble(model, place, rates), M, K, C


@pytest.mark.parametrize("damped", [False, True])
@pytest.mark.parametrize(("scheme", "limit"), [(mbd.RungeKutta853(), 6.4), (mbd.RungeKutta4(), 3.0)], ids=repr)
@pytest.mark.parametrize("seed", range(12))
def test_no_row_follows_a_start_from_which_an_explicit_step_is_beyond_its_stability(seed, scheme, limit, damped):
    """The largest |s| of (M s² + C s + K) x = 0 bounds dt, whatever the start: at rest or as fast as 1000 lengths/s."""
    rng = np.random.default_rng(seed)
    model, start, M, K, C = oscillators(rng, damped)
    n = len(M)
    first = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    fastest = np.max(np.abs(np.linalg.eigvals(first)))
    for share in (10.0 ** rng.uniform(0.5, 12.0), 0.3):
        dt = share * limit / fastest
        run = mbd.simulate(model, start, scheme, dt=dt, until=20.0 * dt, on_failure="return")
        if share < 1.0:
            assert run.success
        else:
            assert not run.success and len(run.time) == 1
            assert "is stable up to" in run.message


def dropped_on_a_mat(scheme, dt):
    """1 kg from 0.1 m onto 1e9 N/m: an impact of 99 µs."""
    model, body = one_body(mbd.PointMass("ball", 1.0), mbd.Prismatic, "fall", gravity=G, axis=(0, 1, 0))
    model.constrain(mbd.Penalty("mat", mbd.height(body.origin), stiffness=1e9))
    start = mbd.assemble(model, position={"fall.displacement": 0.1})
    return mbd.simulate(model, start, scheme, dt=dt, until=0.3, on_failure="return")


@pytest.mark.parametrize("dt", [3e-4, 1e-3])
def test_a_stiff_contact_throws_no_higher(dt):
    run = dropped_on_a_mat(mbd.RungeKutta853(), dt)
    assert run.success and run["fall.displacement"].max() == pytest.approx(0.1, rel=1e-6)


def test_a_blow_far_below_a_step_gives_back_what_it_took():
    run = dropped_on_a_mat(mbd.RadauIIA(), 1e-2)
    assert run.success and [event.kind for event in run.events[:2]] == ["closed", "opened"]
    assert run.energy.total[-1] == pytest.approx(run.energy.total[0], rel=1e-4)


def test_a_contact_that_was_closed_at_the_start_gives_what_it_holds():
    model, body = one_body(mbd.PointMass("ball", 1.0), mbd.Prismatic, "fall", gravity=(0.0, 0.0, 0.0), axis=(0, 1, 0))
    model.constrain(mbd.Penalty("mat", mbd.height(body.origin), stiffness=100.0))
    start = mbd.assemble(model, position={"fall.displacement": -0.1}, closed=["mat"])
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-2, until=1.0)
    assert run.success and not told(run) and run["fall.rate"][-1] == pytest.approx(1.0)


# what it costs --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("until", "most"), [(0.05, 40), (60.0, 100), (1000.0, 200)])
def test_a_right_run_is_looked_at_in_few_rows_and_without_a_ledger(until, most):
    model, _ = one_body(mbd.Link("link", 1.0, 1.0, 0.5), mbd.Revolute, "hinge", title="rod", gravity=G)
    options = {"contact": "events", "impact": "newton", "locate": "root", "store": 1, "rest_speed": 1e-6}
    start = mbd.assemble(model, position={"hinge.angle": 1.0})
    run = prepared(model, start, mbd.Newmark(), 1e-3, until, {}, options | {"backend": "auto"})
    trajectory, problem = run.complete()
    assert not problem and len(trajectory.time) > until / 1e-3
    assert run.energy.rows <= most and run.energy.ledgers == 0


def test_a_watch_begins_with_nothing():
    watch = EnergyWatch()
    assert (watch.problem, watch.note, watch.rows, watch.ledgers) == ("", "", 0, 0)


@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.Newmark(), mbd.GeneralizedAlpha(0.8), mbd.RadauIIA()], ids=repr)
def test_a_step_beyond_the_pole_of_a_potential_is_no_motion(scheme):
    """V = log(x − a) has no value beyond a, but a force."""
    rng = np.random.default_rng(4)
    for pole in rng.uniform(0.2, 0.6, 3):
        model = mbd.Model("well", gravity=(0.0, 0.0, 0.0))
        point = mbd.PointMass("point", mass=0.4)
        model.connect(mbd.Prismatic("rail", model.ground.origin, point.origin))
        model.apply(mbd.Potential("well", lambda x, a=pole: mbd.log(x - a), "rail.displacement"))
        start = mbd.assemble(model, {"rail.displacement": pole + 0.05})
        run = mbd.simulate(model, start, scheme, dt=2e-3, until=0.1, on_failure="return")
        assert not run.success
        if "is not a number" in run.message:
            assert "the potential of 'well'" in run.message
            first = np.flatnonzero(run["rail.displacement"] < pole)[0]
            assert f"t = {run.time[first]:.9g} s" in run.message
        else:
            assert (run["rail.displacement"] > pole).all(), run.message


@pytest.mark.parametrize(("dt", "told"), [(0.03, True), (1e-3, False)])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
def test_non_smooth_steps_tell_a_gain_above_a_fiftieth(scheme, restitution, dt, told):
    """A ball that is lifted out of the floor by m g times its depth, of the size of dt: 6.8 % in the first impact.

    Impacts hide it: with restitution 0 the ball has the gain in one row alone, then it rests.
    """
    model, ball = one_body(mbd.PointMass("ball", mass=1.0), mbd.Translation, "place", title="dropped")
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(ball.origin), restitution=restitution))
    start = mbd.assemble(model, position={"place.y": 0.5})
    run = mbd.simulate(model, start, scheme, dt=dt, until=1.0, contact="nonsmooth")
    notes = [note for note in run.stats["notes"] if note.startswith("numerical energy gain")]
    gain = np.max(run.energy.numerical)
    assert (gain > 0.02 * run.energy.total[0]) == bool(notes) == told
    assert not told or f"gain {gain:.3g} J" in notes[0]


@at_least(4)
def test_losses_of_joints_and_of_feet_that_slide_hide_no_gain_of_non_smooth_steps():
    """A tray that falls, turns and slides on four feet: the note has what the ledger has, with all losses apart."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        model, tray = mbd.Model("tray"), mbd.RigidBody("tray", rng.uniform(1.0, 5.0), 0.3)
        model.connect(mbd.Planar("fall", model.ground.origin, tray.origin, loss={"x": mbd.Viscous(0.5)}))
        for name, side in (("left", -0.4), ("right", 0.4)):
            foot = mbd.touchdown(tray.point(side, -0.1))
            model.constrain(mbd.Unilateral(name, foot, friction=0.3, restitution=rng.uniform(0.0, 0.5)))
        start = mbd.assemble(model, {"fall.y": 0.5, "fall.angle": rng.uniform(-0.3, 0.3)}, {"fall.x": 1.0})
        run = mbd.simulate(model, start, mbd.HHT(0.05), dt=0.03, until=1.0, contact="nonsmooth")
        notes = [note for note in run.stats["notes"] if note.startswith("numerical energy gain")]
        gain = np.max(run.energy.numerical)
        if gain > 0.04 * run.energy.total[0]:
            compared()
            assert notes
            assert float(notes[0].split("gain ")[1].split(" J")[0]) > 0.5 * gain
        elif gain < 0.02 * np.min(run.energy.total[0]):
            compared()
            assert not notes
