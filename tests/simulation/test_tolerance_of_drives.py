"""Where drives prescribe a motion, `tol` holds for their forces: over random mechanisms, against Newton and Euler."""

from functools import cache

import numpy as np
import pytest

import mbd
from mbd.errors import MbdWarning
from mbd.simulation.tolerance.comparison import MAX_PARTS, MAX_PLACES, _inside_steps
from tests.simulation.vanishing import Units, driven as driven_scene

SCHEMES = [
    mbd.HHT(0.05), mbd.HHT(0.3), mbd.GeneralizedAlpha(0.9), mbd.GeneralizedAlpha(0.3), mbd.Newmark(), mbd.RadauIIA(),
    mbd.RungeKutta853(), mbd.RungeKutta4(),
]  # fmt: skip
UNTIL = 1.2
G = np.array([1.0, -9.0])


def motions(rng, count):
    """Smooth motions of joints as (function of time for the model, the same with numbers)."""
    made = []
    for _ in range(count):
        kind = rng.integers(4)
        q, w, size = rng.uniform(-1.5, 1.5), rng.uniform(2.0, 7.0), rng.uniform(0.2, 0.6)
        if kind == 0:  # it swings
            made.append((lambda t, q=q, w=w, s=size: q + s * mbd.sin(w * t), (kind, q, w, size)))
        elif kind == 1:  # it runs at constant speed
            made.append((lambda t, q=q, w=w: q + w * t, (kind, q, w, size)))
        elif kind == 2:  # it moves and is held: 10 x³ − 15 x⁴ + 6 x⁵
            made.append((lambda t, q=q, s=size: q + s * _smooth(mbd.minimum(t / 0.7, 1.0)), (kind, q, w, size)))
        else:  # it is held
            made.append((q, (kind, q, w, size)))
    return made


def _smooth(x):
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


def known(numbers, t):
    """q, q̇, q̈ of such a motion."""
    kind, q, w, size = numbers
    if kind == 0:
        return q + size * np.sin(w * t), size * w * np.cos(w * t), -size * w * w * np.sin(w * t)
    if kind == 1:
        return q + w * t, w + 0.0 * t, 0.0 * t
    if kind == 2:
        x = np.minimum(t / 0.7, 1.0)
        first, second = 30.0 * x**2 * (1.0 - x) ** 2, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
        return q + size * _smooth(x), size * first / 0.7, size * second / 0.49
    return q + 0.0 * t, 0.0 * t, 0.0 * t


@cache
def chain(seed, cut):
    """A chain of links on hinges, all driven but for the last one of odd seeds; its start and lengths."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 4)) if seed % 2 == 0 else int(rng.integers(2, 4))
    bodies = []
    for _ in range(count):
        length = rng.uniform(0.3, 0.9)
        bodies.append((rng.uniform(0.3, 3.0), length, rng.uniform(0.1, 0.9) * length, rng.uniform(0.005, 0.1)))
    driven = motions(rng, count if seed % 2 == 0 else count - 1)
    if all(numbers[0] == 3 for _, numbers in driven):
        driven[0] = (lambda t: 0.4 * mbd.sin(5.0 * t), (0, 0.0, 5.0, 0.4))
    model = mbd.Model("chain", gravity=(*G, 0.0), cut=cut)
    onto = model.ground.origin
    for k, (mass, length, center, inertia) in enumerate(bodies):
        link = mbd.Link(f"link {k}", mass, length, center, inertia)
        model.connect(mbd.Revolute(f"hinge {k}", onto, link.start))
        onto = link.end
    for k, (value, _) in enumerate(driven):
        model.constrain(mbd.Bilateral(f"drive {k}", model.joints[k], value=value))
    begin = {f"hinge {k}.angle": float(known(numbers, 0.0)[0]) for k, (_, numbers) in enumerate(driven)}
    rates = {f"hinge {k}.angle": float(known(numbers, 0.0)[1]) for k, (_, numbers) in enumerate(driven)}
    if len(driven) < count:
        begin[f"hinge {count - 1}.angle"] = 0.3
        rates[f"hinge {count - 1}.angle"] = 0.0
    return model, mbd.assemble(model, begin, rates), bodies, [numbers for _, numbers in driven]


@cache
def reference(seed):
    """The motion of a chain that is driven in part, by another scheme in fine steps."""
    model, start, _, _ = chain(seed, "auto")
    return mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-3, until=UNTIL)


def torques(seed, time):
    """Those of all drives at times (k, times) by Newton's and Euler's equations: Σ m (r̈ − g)·∂r/∂q + J φ̈ ∂φ/∂q."""
    _, _, bodies, driven = chain(seed, "auto")
    q, v, a = np.array([known(numbers, time) for numbers in driven]).transpose(1, 0, 2)
    if len(driven) < len(bodies):
        last, fine = f"hinge {len(bodies) - 1}.angle", reference(seed).at(time)
        free = (fine[last], fine[f"{last}.rate"], fine[f"{last}.acceleration"])
        q, v, a = (np.vstack(both) for both in zip((q, v, a), free, strict=True))
    angle, rate, change = (np.cumsum(x, axis=0) for x in (q, v, a))
    found = np.zeros_like(q)
    for k, (mass, _, center, inertia) in enumerate(bodies):
        arms = [*(bodies[j][1] for j in range(k)), center]
        # a point of a link lies along (sin φ, −cos φ)
        along = [np.array([np.sin(angle[j]), -np.cos(angle[j])]) for j in range(k + 1)]
        across = [np.array([np.cos(angle[j]), np.sin(angle[j])]) for j in range(k + 1)]
        push = sum(arms[j] * (change[j] * across[j] - rate[j] ** 2 * along[j]) for j in range(k + 1)) - G[:, None]
        for j in range(k + 1):
            lever = sum(arms[i] * across[i] for i in range(j, k + 1))
            found[j] += mass * np.sum(push * lever, axis=0) + inertia * change[k]
    return found[: len(driven)]


@pytest.mark.covering
@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("cut", ["auto", "all"])
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_torques_of_drives_are_as_accurate_as_tol_says(seed, cut, scheme):
    model, start, _, _ = chain(seed, cut)
    instants = np.linspace(0.0, UNTIL, 301)
    for tol in (1e-3,) if seed % 4 == 3 else (1e-2, 1e-5):
        run = mbd.simulate(model, start, scheme, tol=tol, until=UNTIL)
        assert run.stats["tolerance"]["estimated"] <= tol
        largest = np.max(np.abs(torques(seed, instants)))
        for time in (run.time, instants):
            true = torques(seed, time)
            ours = run.at(time).read(*(f"drive {k}.torque" for k in range(len(true))))
            error = max(np.max(np.abs(ours[f"drive {k}.torque"] - true[k])) for k in range(len(true)))
            assert error <= 2.0 * tol * largest, tol


def leg(seed):
    """A driven thigh whose light shank swings fast until its damper has stilled it; steps are short, then long."""
    rng = np.random.default_rng(seed)
    mass, length, share, inertia = (
        rng.uniform(5, 10),
        rng.uniform(0.4, 0.9),
        rng.uniform(0.3, 0.6),
        rng.uniform(0.1, 0.3),
    )
    light, small, w, damped = (
        rng.uniform(0.01, 0.05),
        rng.uniform(1e-4, 1e-3),
        rng.uniform(40, 80),
        rng.uniform(0.05, 0.2),
    )
    size, period, begin, bent = rng.uniform(0.5, 1.5), rng.uniform(1, 2), rng.uniform(-1, 1), rng.uniform(0.5, 1)
    model = mbd.Model("leg", gravity=(0.0, -9.81, 0.0))
    thigh, shank = mbd.Link("thigh", mass, length, share * length, inertia), mbd.Link("shank", light, 0.3, 0.1, small)
    hip = mbd.Revolute("hip", model.ground.origin, thigh.start)
    model.connect(hip)
    loss = mbd.Viscous(small * w * damped)
    model.connect(mbd.Revolute("knee", thigh.end, shank.start, stiffness=1.5 * small * w * w, loss=loss))
    model.constrain(mbd.Bilateral("drive", hip, value=lambda t: begin + size * mbd.sin(3.1 * t / period)))
    rates = {"hip.angle": 3.1 * size / period}
    return model, mbd.assemble(model, {"hip.angle": begin, "knee.angle": bent}, rates, project=True)


@pytest.mark.parametrize(
    ("seed", "scheme", "tol"), [(0, mbd.RadauIIA(), 1e-6), (0, mbd.HHT(0.05), 1e-2), (1, mbd.RadauIIA(), 1e-6)]
)
def test_the_estimate_bounds_torques_within_long_steps_among_many_short_ones(seed, scheme, tol):
    """Estimates neglect higher orders of the step, a tenth here; without long steps the first one misses a fifth."""
    model, start = leg(seed)
    run = mbd.simulate(model, start, scheme, tol=tol, until=4.0)
    fine = mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-3, until=4.0)
    assert len(run) > 400 and np.max(np.diff(run.time)) > 7.0 * np.mean(np.diff(run.time))
    instants = np.linspace(0.0, 4.0, 3001)
    true = fine.at(instants)["drive.torque"]
    error = np.max(np.abs(run.at(instants)["drive.torque"] - true)) / np.max(np.abs(true))
    assert error <= 1.1 * run.stats["tolerance"]["estimated"]


@pytest.mark.parametrize("seed", range(40))
def test_places_within_steps_are_shared_by_their_length(seed):
    rng = np.random.default_rng(seed)
    step = 10.0 ** rng.uniform(-rng.uniform(0.0, 6.0), 0.0, int(10.0 ** rng.uniform(0.0, 4.0)))
    begin = np.append(0.0, np.cumsum(step)[:-1])
    places = _inside_steps(begin, step)
    where = np.searchsorted(begin, places, side="right") - 1
    assert np.all(places < (begin + step)[where]) and len(places) <= 1.6 * MAX_PLACES
    parts = np.bincount(where, minlength=len(step))
    assert np.max(parts) <= MAX_PARTS and np.all(parts[step > np.sum(step) / MAX_PLACES] >= 1)
    order = np.argsort(step)
    assert np.all(
        np.maximum.accumulate(parts[order]) <= parts[order] + 1
    )  # a longer step has as many, but for rounding
    assert np.min(parts) >= (2 * len(step) <= MAX_PLACES)


def test_a_driven_run_says_what_its_tolerance_holds_for():
    model, start, _, _ = chain(0, "auto")
    run = mbd.simulate(model, start, tol=1e-3, until=UNTIL)
    assert any("prescribe the whole motion: tol holds for torques of drives" in note for note in run.stats["notes"])
    with pytest.warns(
        MbdWarning, match="'hinge 1.angle.rate' are right in steps of any size: tol does not cover forces"
    ):
        mbd.simulate(model, start, tol=1e-3, tol_of=["hinge 1.angle.rate"], until=UNTIL)
    model, start, _, _ = chain(1, "auto")
    run = mbd.simulate(model, start, tol=1e-3, until=UNTIL)
    assert not any("the whole motion" in note for note in run.stats["notes"])


@pytest.mark.parametrize("seed", [2, 8])
def test_no_singular_pose_is_told_where_steps_are_only_long(seed):
    """A step of a quarter of the run may seem to end next to one; a shorter try of it does not."""
    scene = driven_scene("four-bar", seed, Units())
    start = mbd.assemble(scene.model, **scene.start, project=True)
    for scheme in (mbd.HHT(0.05), mbd.GeneralizedAlpha(0.5)):
        run = mbd.simulate(scene.model, start, scheme, tol=1e-4, until=0.6)
        assert run.stats["singular_steps"] == 0
        assert not any("singular" in str(note) for note in run.stats["notes"])


def test_multipliers_do_not_alternate_where_steps_change():
    """An error of the algorithmic acceleration returned with its sign turned: rows differed by 9 of 17 N m."""
    model, start, _, _ = chain(3, "auto")
    for scheme in SCHEMES[:5]:
        run = mbd.simulate(model, start, scheme, tol=1e-3, until=UNTIL)
        bent = np.diff(run["drive 0.torque"], 2)
        assert np.mean(bent[1:] * bent[:-1] < 0.0) < 0.3, scheme


@pytest.mark.parametrize("scheme", [SCHEMES[0], SCHEMES[2], SCHEMES[4]], ids=repr)
def test_driven_runs_that_follow_a_tolerance_have_derivatives(scheme):
    """The pass takes their steps as they were, with rates and multipliers of the balance at the ends."""
    model, start, _, _ = chain(3, "auto")
    wrt, of = ["link 2.mass", "link 0.inertia"], ["hinge 2.angle", "drive 0.torque"]
    found = mbd.sensitivities(model, start, scheme, tol=1e-4, until=0.8, wrt=wrt, of=of)
    exact = mbd.sensitivities(model, start, mbd.RungeKutta853(), tol=1e-9, until=0.8, wrt=wrt, of=of)
    for result in of:
        size = max(abs(exact[result, name]) for name in wrt)
        for name in wrt:
            assert found[result, name] == pytest.approx(exact[result, name], abs=2e-3 * size)


def test_a_row_that_moves_at_a_speed_drives_and_one_that_holds_a_speed_does_not():
    model = mbd.Model("speeds")
    wheel, arm = mbd.RigidBody("wheel", 1.0, 0.1), mbd.Link("arm", 1.0, 0.5, 0.25, 0.02)
    model.connect(mbd.Revolute("axle", model.ground.origin, wheel.origin))
    model.connect(mbd.Revolute("elbow", wheel.point(0.3, 0.0), arm.start))
    for bias, driven in ((-2.0, True), (0.0, False)):
        row = mbd.Nonholonomic("row", lambda w: w, bias=bias, arguments=("axle.rate",), unit="rad")
        model.constraints[:] = [row]
        run = mbd.simulate(model, mbd.assemble(model), tol=1e-3, until=0.2)
        assert run.settings["driven"] is driven
