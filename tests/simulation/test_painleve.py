"""A rod that stands on a foot with much friction and is drawn aside: it slides, or parts where no slide is possible.

With the pushes (p, T) on the foot its acceleration is ``(w, g̈) = w₀ + G (T, p)``. Sliding towards the pull has
``dg̈/dp = 1/m + l² sin φ (sin φ − μ cos φ)/J`` (Génot & Brogliato 1999, Eur. J. Mech. A 18:653). Where that is negative,
sticking, sliding and parting are all consistent below the limit ``|T| = μ p``, and beyond it parting alone.
"""

import numpy as np
import pytest

import mbd
from mbd.sensitivity.derivative import final_state_derivative
from tests.sensitivity.differences import differences, off
from tests.simulation.test_dry_walkers import falling_walker
from tests.simulation.test_pushed_soles import two_pushed_feet

G, MASS, INERTIA, HALF, LEAN, RATE = 9.81, 2.0, 0.1, 1.0, 0.5, 50.0
S, C = np.sin(LEAN), np.cos(LEAN)
SCHEMES = [mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8), mbd.RadauIIA(), mbd.RungeKutta853()]


def drawn_rod(mu, pull):
    """A rod that leans by φ; a force `pull` at its center draws it aside, and a torque keeps it from turning."""
    model, rod = mbd.Model("rod", gravity=(0.0, -G, 0.0)), mbd.RigidBody("rod", mass=MASS, inertia=INERTIA)
    model.connect(mbd.Planar("place", model.ground.origin, rod.origin))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(rod.point(-HALF * S, -HALF * C)), friction=mu))

    def torque(t):
        return 0.0, 0.0, HALF * (MASS * G * S - pull(t) * C)

    model.apply(mbd.Applied("pull", rod.origin, arguments=("t",), force=lambda t: (-pull(t), 0.0, 0.0), torque=torque))
    return model, mbd.assemble(model, position={"place.y": HALF * C}, closed="foot")


def gain(mu):
    """dg̈/dp of the foot that slides towards the pull [1/kg]."""
    return 1.0 / MASS + HALF**2 * S * (S - mu * C) / INERTIA


def gap_after(mu, time):
    """Gap of the foot that long after it has parted at the limit of its friction [m]."""
    spin = HALF * (MASS * G * (S - mu * C) * time**2 / 2.0 - RATE * C * time**3 / 6.0) / INERTIA
    at = LEAN - spin  # the lean from the vertical, against the angle of the body
    return HALF * C - G * time**2 / 2.0 - HALF * np.cos(at)


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.parametrize("mu", [0.3, 0.6, 0.8, 1.2])
def test_a_foot_at_its_limit_slides_or_parts_as_its_normal_force_is_stable(mu, scheme):
    model, start = drawn_rod(mu, lambda t: RATE * t)
    limit = mu * MASS * G / RATE
    run = mbd.simulate(model, start, scheme, dt=1e-3, until=limit + 0.02)
    (event,) = run.events
    assert event.kind == ("slipped" if gain(mu) > 0.0 else "opened")
    assert event.time == pytest.approx(limit, rel=1e-9)
    if gain(mu) < 0.0:
        assert run["foot.gap"][-1] == pytest.approx(gap_after(mu, run.time[-1] - limit), rel=2e-3)
        assert gap_after(mu, 1e-4) == pytest.approx(-MASS * G * gain(mu) * 1e-8 / 2.0, rel=1e-2)


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.parametrize("mu", [0.3, 0.8, 1.2])
def test_a_foot_that_can_stick_sticks_though_it_could_slide_or_part(mu, scheme):
    model, start = drawn_rod(mu, lambda t: 0.95 * mu * MASS * G)
    run = mbd.simulate(model, start, scheme, dt=1e-3, until=0.05)
    assert not run.events
    assert np.abs(run["foot.gap"]).max() < 1e-12 and run["foot.force"][-1] == pytest.approx(MASS * G, rel=1e-9)


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_a_start_beyond_the_limit_parts_where_no_slide_is_possible(scheme):
    model, start = drawn_rod(0.8, lambda t: 0.82 * MASS * G)
    run = mbd.simulate(model, start, scheme, dt=1e-3, until=0.01)
    assert [(event.kind, event.time) for event in run.events] == [("opened", 0.0)]
    assert run["foot.gap"][-1] > 0.0


def test_a_walker_whose_foot_can_stick_no_more_parts():
    """It slipped and stuck at 0.73226 s without end: the slide has dg̈/dp = −0.11 /kg."""
    model, start = falling_walker(2)
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=0.74)
    assert (run.events[-1].name, run.events[-1].kind) == ("foot0", "opened")
    fine = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=0.74)
    assert run.events[-1].time == pytest.approx(fine.events[-1].time, abs=1e-4)
    assert run["foot0.gap"][-1] == pytest.approx(fine["foot0.gap"][-1], rel=0.02)


def thrown_rod(mu):
    """Without torque the rod that slides sinks in if open, ``g̈₀ = −g``, and would have to pull if closed."""
    model, rod = mbd.Model("rod", gravity=(0.0, -G, 0.0)), mbd.RigidBody("rod", mass=MASS, inertia=INERTIA)
    model.connect(mbd.Planar("place", model.ground.origin, rod.origin))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(rod.point(-HALF * S, -HALF * C)), friction=mu))
    return model, mbd.assemble(model, {"place.y": HALF * C}, {"place.x": -1.0}, closed="foot")


@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.parametrize("mu", [0.8, 1.2])
def test_an_impulse_without_collision_stops_a_slide_that_no_force_lets_go_on(mu, scheme):
    """G (Λ_T, Λ) = (1, 0) with G that of the foot, whatever the friction; the loss is ½ Λ_T v."""
    model, start = thrown_rod(mu)
    run = mbd.simulate(model, start, scheme, dt=1e-3, until=0.05)
    stopped = run.events[0]
    across, mixed = 1.0 / MASS + HALF**2 * C * C / INERTIA, -(HALF**2) * S * C / INERTIA
    above = 1.0 / MASS + HALF**2 * S * S / INERTIA
    push, pull = np.linalg.solve([[above, mixed], [mixed, across]], [0.0, 1.0])
    assert (stopped.name, stopped.kind, stopped.time) == ("foot", "stuck", 0.0)
    assert np.abs(stopped.impulse) == pytest.approx([abs(push), abs(pull)], rel=1e-9)
    assert stopped.energy_loss == pytest.approx(0.5 * abs(pull), rel=1e-9)
    assert np.abs(run["foot.gap"]).max() < 1e-9 and np.abs(run.energy.numerical).max() < 1e-6


def slid_onto_rough_ground(feet):
    """A rod, or a block on two feet, whose friction grows where it has slid for 2 cm: no force is consistent then."""
    model = mbd.Model("slide", gravity=(0.0, -G, 0.0))
    body = mbd.RigidBody("body", mass=MASS, inertia=INERTIA if feet == 1 else 0.15)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    high, sense = (HALF * C, -1.0) if feet == 1 else (0.65, 1.0)
    names = [f"foot{k}" for k in range(feet)]
    for k, name in enumerate(names):
        place = body.point(-HALF * S, -high) if feet == 1 else body.point(0.2 * (2 * k - 1), -high)
        model.constrain(mbd.Unilateral(name, mbd.touchdown(place), friction=0.1))
    far = mbd.measure(lambda x: sense * x - 0.02, "place.x")
    step = mbd.Transition("smooth", "rough", when=far, direction=1)
    rough = {f"{name}.mu": {"rough": 1.45} for name in names}
    model.apply(mbd.Mode("floor", ("smooth", "rough"), transitions=[step], sets=rough))
    return model, mbd.assemble(model, {"place.y": high}, {"place.x": sense}, closed=names)


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05, tolerance=1e-12), mbd.RungeKutta853()], ids=str)
@pytest.mark.parametrize("feet", [1, 2])
def test_derivatives_follow_an_impulse_without_collision(feet, scheme):
    model, start = slid_onto_rough_ground(feet)
    settings, names = {"dt": 1e-3, "until": 0.05}, ["place.x", "place.x.rate", "gravity.y", "body.mass"]
    run = mbd.simulate(model, start, scheme, **settings)
    assert [event.kind for event in run.events] == ["event", "stuck", *["opened"] * (feet - 1)]
    assert run.events[1].impulse.all()
    wanted, _ = differences(model, start, scheme, names, 1e-5, **settings)
    assert off(np.vstack(final_state_derivative(run, names)), wanted).max() < 1e-7


def test_derivatives_by_a_start_at_an_impulse_without_collision_are_refused():
    model, start = thrown_rod(0.8)
    with pytest.raises(mbd.errors.OneSidedError, match="'foot' happens as the run starts.*velocities of the first row"):
        mbd.sensitivities(model, start, dt=1e-3, until=0.02, wrt=["place.x.rate"])


def test_a_slide_into_the_paradox_is_stopped_there_and_the_ledger_knows():
    """The slide of 'foot0' at 0.666 s had no consistent force."""
    model, start = falling_walker(19)
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=0.8)
    assert np.abs(run.energy.numerical).max() < 1e-6


def sliding_block(seed, space):
    """A block that slides on two or three feet so high that it tips about the first one."""
    rng = np.random.default_rng(seed)
    height, speed = rng.uniform(0.5, 0.8), rng.uniform(0.2, 1.0)
    model = mbd.Model("block", gravity=(0.0, 0.0, -G) if space else (0.0, -G, 0.0))
    inertia = tuple(rng.uniform(0.1, 0.19, 3))
    body = mbd.RigidBody("body", rng.uniform(1.0, 3.0), inertia if space else inertia[0])
    joint = (mbd.Free if space else mbd.Planar)("place", model.ground.origin, body.origin)
    model.connect(joint)
    count = 3 if space else 2
    turn = rng.uniform(0.0, 2.0)
    for k in range(count):
        if space:
            angle = 2.0 * np.pi * k / 3.0 + turn
            place = body.point(0.25 * np.cos(angle), 0.25 * np.sin(angle), -height)
            touch = mbd.touchdown(place, mbd.Plane(normal=(0.0, 0.0, 1.0)))
        else:
            touch = mbd.touchdown(body.point(0.2 * (2 * k - 1), -height))
        model.constrain(mbd.Unilateral(f"foot{k}", touch, friction=1.45))
    velocity = {"place.x": speed, "place.y": 0.3} if space else {"place.x": speed}
    feet = [f"foot{k}" for k in range(count)]
    return model, mbd.assemble(model, {"place.z" if space else "place.y": height}, velocity, closed=feet)


@pytest.mark.parametrize("space", [False, True])
def test_blocks_that_slide_on_several_feet_stop_on_the_foremost(space):
    """Nothing penetrates, energy falls by the reported loss, and schemes agree on impulses."""
    stops = 0
    for seed in range(6):
        model, start = sliding_block(seed, space)
        runs = [mbd.simulate(model, start, scheme, dt=1e-3, until=0.05) for scheme in (mbd.HHT(0.05), mbd.RadauIIA())]
        first, second = ([e for e in run.events if e.kind == "stuck" and e.impulse.any()] for run in runs)
        assert [e.name for e in first] == [e.name for e in second], seed
        for one, other in zip(first, second, strict=True):
            assert one.impulse[0] > 0.0 and np.linalg.norm(one.impulse[1:]) <= 1.45 * one.impulse[0] * (1.0 + 1e-9)
            assert one.impulse == pytest.approx(other.impulse, rel=1e-9) and one.energy_loss > 0.0
            stops += 1
        for run in runs:
            assert min(run[f"{each.name}.gap"].min() for each in model.constraints) > -1e-9, seed
    assert stops > 3


def test_where_a_slide_and_parting_are_consistent_both_are_told():
    pull = 0.95 * 1.2 * MASS * G
    model, _ = drawn_rod(1.2, lambda t: pull)
    start = mbd.assemble(model, {"place.y": HALF * C}, {"place.x": -1.0}, closed="foot")
    run = mbd.simulate(model, start, dt=1e-3, until=0.1, on_failure="return")
    free = -G - HALF**2 * S * (MASS * G * S - pull * C) / INERTIA
    assert "Painlevé: more than one consistent contact force at 'foot'" in run.message
    assert f"it may push with {-free / gain(1.2):.3g} N or open with {free:.3g} m/s²" in run.message


@pytest.mark.slow
def test_no_numbers_are_told_of_a_corner_that_other_corners_hold():
    model, start = two_pushed_feet(7)
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=0.21, on_failure="return")
    assert "each newton" not in run.message and "more than one" not in run.message
