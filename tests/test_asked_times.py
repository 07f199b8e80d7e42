"""Results at asked times against the same run stepped so that a row falls there, and against a far more accurate one.

``put`` ends at the asked time, so that its last row is a step of the scheme; what a run says between its rows may be no
worse than rows: not further from the motion than a few times what `put` is, or the row before the asked time. (The last
row of schemes with rows in position only is made consistent on all levels, and more accurate than those before.)
"""

from __future__ import annotations

import random
from collections.abc import Mapping
from functools import cache, cached_property

import numpy as np
import pytest

import mbd
from mbd.hardcases.redundant_rows import bricard
from mbd.hardcases.schemes import SCHEMES
from mbd.results.balance import Balance
from mbd.results.columns import ModelColumns
from tests.fuzz import judge
from tests.fuzz.structures import SPACE, structure
from tests.mechanisms_between_rows import KINDS

UNTIL = 0.4
PARTS = (0.15, 0.8)
"""Where times are asked for, about, over the length of a run [-]."""
STEPS = {"RadauIIA": 2.5e-3, "RungeKutta853": 2e-2}
"""dt of schemes of high order; others take the usual one [s]."""
USUAL = 4e-3
FACTOR = 6.0
"""Error between rows over the largest one of rows at the same times, by kind of quantity [-]."""
FLOOR = 1e-10
"""The same where both are round-off, relative to the quantity [-]."""
NOTHING = 1e-12
"""What counts as zero of a mechanism of meters, kilograms and seconds, which may stand still."""


def kinds_of(run: mbd.Trajectory) -> Mapping[str, list[str]]:
    """Named scalars of a run by kind."""
    coordinates = {c.name for c in run.record.equations.coordinates}
    tests = {
        "coordinates": lambda name: name in coordinates,
        "rates": lambda name: name.endswith(".rate"),
        "accelerations": lambda name: name.endswith("acceleration"),
        "multipliers": lambda name: name.endswith(".multiplier"),
        "reactions": lambda name: "reaction_" in name or name.endswith((".force", ".friction", ".tension", ".torque")),
        "energies": lambda name: name.endswith("_energy"),
    }
    return {kind: [name for name in run.names if test(name)] for kind, test in tests.items()}


@cache
def mechanism(kind: str, seed: int) -> tuple[mbd.Model, mbd.State]:
    return KINDS[kind](seed)


@cache
def exact(kind: str, seed: int, until: float) -> mbd.Trajectory:
    return mbd.simulate(*mechanism(kind, seed), mbd.RadauIIA(), dt=1e-3, until=until)


def check(kind: str, seed: int, scheme: mbd.Integrator, dt: float) -> None:
    """Assert the law at a few random times."""
    model, start = mechanism(kind, seed)
    run = mbd.simulate(model, start, scheme, dt=dt, until=UNTIL)
    rng = random.Random(seed)
    found = dict.fromkeys(kinds_of(run), (0.0, 0.0, 0.0))
    for part in PARTS:
        t = (part + 0.1 * rng.random()) * UNTIL
        if any(abs(event.time - t) < 2.0 * dt for event in run.events):
            continue
        put, true = mbd.simulate(model, start, scheme, dt=dt, until=t), exact(kind, seed, t)
        moments, before = run.at(t), int(np.searchsorted(run.time, t)) - 1
        for group, names in kinds_of(run).items():
            end, right = (one.at(one.time[-1]).read(*names) for one in (put, true))
            nearby = true.at(run.time[before]).read(*names)
            for name, (value,) in moments.read(*names).items():
                row = max(abs(end[name][0] - right[name][0]), abs(run[name][before] - nearby[name][0]))
                errors = abs(value - right[name][0]), row, float(np.max(np.abs(run[name])))
                found[group] = tuple(map(max, found[group], errors))
    for group, (between, row, size) in found.items():
        assert between <= FACTOR * row + FLOOR * size + NOTHING, (
            f"{group}: {between:.2g} between rows, {row:.2g} at them"
        )


@pytest.mark.covering
@pytest.mark.parametrize("name", SCHEMES)
@pytest.mark.parametrize("kind", KINDS)
def test_between_rows_results_are_as_accurate_as_at_rows(kind, name):
    check(kind, 1, SCHEMES[name](), STEPS.get(name, USUAL))


@pytest.mark.slow
@pytest.mark.parametrize("name", SCHEMES)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [0, *range(2, 12)])
def test_between_rows_results_of_many_mechanisms_are_as_accurate_as_at_rows(kind, name, seed):
    check(kind, seed, SCHEMES[name](), STEPS.get(name, USUAL))


@pytest.mark.parametrize("kind", KINDS)
def test_no_instant_between_long_steps_is_worse_than_the_others(kind):
    """Wherever it is asked: choices between two ways to find a force must not flip within an interval."""
    until = 0.4
    run = mbd.simulate(*mechanism(kind, 0), mbd.RadauIIA(), dt=2.5e-2, until=until)
    true = exact(kind, 0, until)
    times = np.setdiff1d(np.linspace(0.0, until, 241), run.time)
    for event in run.events:
        times = times[np.abs(times - event.time) > 5e-2]
    names = kinds_of(run)["reactions"] + kinds_of(run)["accelerations"]
    rows, right = run.at(run.time).read(*names), true.at(run.time).read(*names)
    there, expected = run.at(times).read(*names), true.at(times).read(*names)
    size = max(np.max(np.abs(column)) for column in rows.values())
    for name, column in rows.items():
        found = np.abs(there[name] - expected[name])
        row = np.max(np.abs(column - right[name]))
        assert np.max(found) <= 30.0 * max(row, np.median(found)) + 1e-9 * size, name


@pytest.mark.covering
@pytest.mark.parametrize(("kind", "seed"), [("tree", 0), ("tree", 4), ("loop", 1), ("loop", 4), ("redundant", 0)])
@pytest.mark.parametrize("tol", [1e-4, 1e-7])
def test_rates_between_long_implicit_steps_are_as_accurate_as_at_rows(kind, seed, tol):
    """Local errors of single steps are no motion: polynomials through rows missed rates by these over the step."""
    run = mbd.simulate(*mechanism(kind, seed), mbd.RadauIIA(), tol=tol, until=0.6)
    fine = mbd.simulate(*mechanism(kind, seed), mbd.RungeKutta853(), dt=5e-3, until=0.6)
    steps = np.diff(run.time)
    times = np.concatenate([run.time[:-1] + part * steps for part in (0.15, 0.5, 0.8)])
    errors, names = [], run.record.equations.velocity_names
    for asked in (run.time, times):
        ours, theirs = run.at(asked).read(*names), fine.at(asked).read(*names)
        errors.append(max(np.max(np.abs(ours[name] - theirs[name])) for name in names))
    assert errors[1] < 1.5 * errors[0] + NOTHING


def test_between_implicit_steps_of_a_stiff_mechanism_results_stay_with_the_rows():
    """A stiff damped spring, which explicit steps of that length cannot follow, under a pendulum that swings."""
    model = mbd.Model("stiff base")
    base, rod = mbd.PointMass("base", 1.0), mbd.Link("rod", 1.0, 1.0, 1.0)
    model.connect(
        mbd.Prismatic("slide", model.ground.origin, base.origin, stiffness=1e8, loss=mbd.Viscous(1e4)),
        mbd.Revolute("hinge", base.origin, rod.start),
    )
    start = mbd.assemble(model, position={"hinge.angle": 1.0})
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=2e-2, until=1.0)
    fine = mbd.simulate(model, start, mbd.RadauIIA(), dt=5e-4, until=1.0)
    late = run.time[run.time > 0.2]
    between = 0.5 * (late[1:] + late[:-1])
    for name in ("hinge.angle", "hinge.angle.rate", "slide.displacement"):
        rows = np.max(np.abs(run.at(late)[name] - fine.at(late)[name]))
        size = np.max(np.abs(run[name]))
        assert np.max(np.abs(run.at(between)[name] - fine.at(between)[name])) < 10.0 * rows + 1e-5 * size, name


@pytest.mark.parametrize("tol", [1e-4, 1e-9])
def test_explicit_steps_with_a_redundant_row_keep_their_tolerance_between_rows(tol):
    model, start = bricard()
    run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=tol, until=1.0)
    fine = mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-3, until=1.0)
    times = np.linspace(0.0, 1.0, 173)
    ours, exact = run.at(times), fine.at(times)
    for coordinate in run.record.equations.coordinates:
        np.testing.assert_allclose(ours[coordinate.name], exact[coordinate.name], rtol=0, atol=tol)
    for name in ("P3.reaction_torque.x", "P3.reaction_force.y"):
        np.testing.assert_allclose(ours[name], exact[name], rtol=0, atol=300.0 * tol)


@pytest.mark.parametrize("number", [SPACE + 26, SPACE + 154])
def test_between_explicit_steps_of_a_loop_in_a_tilted_plane_the_laws_hold(number):
    """Redundant rows of its hinges are nothing but round-off; one was solved with, and for an instant tore the loop."""
    form = structure(number)
    start = mbd.assemble(form.model, form.position, project=True)
    for until in 0.15, 0.22:
        run = mbd.simulate(form.model, start, mbd.RungeKutta853(), dt=1e-2, until=until)
        assert judge.between(run, form.model).faults == ()


def test_forces_between_rows_of_a_stiff_mechanism_stay_with_the_rows():
    """Springs far too stiff for dt: positions between rows are off by little, the spring's force by (ω dt)² as much."""
    for stiffness in (1e6, 1e8, 1e10):
        model = mbd.Model("stiff")
        body, tip = mbd.PointMass("body", 1.0), mbd.PointMass("tip", 1.0)
        model.connect(mbd.Translation("place", model.ground.origin, body.origin))
        model.connect(mbd.Translation("far", model.ground.origin, tip.origin))
        model.constrain(mbd.Bilateral("rod", mbd.distance(model.ground.point(0.0, 1.0), body.origin), value=1.0))
        model.apply(mbd.Spring("spring", body.origin, tip.origin, stiffness=stiffness, length=0.5))
        near = {"place.x": np.sin(0.7), "place.y": 1.0 - np.cos(0.7)}
        out = {"far.x": 1.5 * np.sin(0.7), "far.y": 1.0 - 1.5 * np.cos(0.7)}
        run = mbd.simulate(model, mbd.assemble(model, position=near | out), mbd.HHT(alpha=0.3), dt=5e-3, until=0.5)
        rows = np.arange(10, len(run) - 1)
        for name in ("rod.tension", "place.y.acceleration"):
            values = run[name]
            low, high = np.minimum(values[rows], values[rows + 1]), np.maximum(values[rows], values[rows + 1])
            between = run.at(0.5 * (run.time[rows] + run.time[rows + 1]))[name]
            room = 0.05 * np.max(np.abs(values)) + (high - low)
            assert np.all((between > low - room) & (between < high + room)), (stiffness, name)


@pytest.mark.parametrize("part", [1e-3, 1e-2, 0.1])
@pytest.mark.parametrize("seed", range(4))
def test_within_a_short_last_step_accelerations_are_those_of_its_ends(part, seed):
    """Rows of index 3 have velocities off their constraints, the last one has not: that is no acceleration."""
    rng, dt = np.random.default_rng(seed), 4e-3
    model = mbd.Model("flail", gravity=(1.5, -9.81, 0.0), cut="all")
    rod = mbd.Link("rod", 0.5, 1.0, rng.uniform(0.6, 0.9), 0.3)
    bob = mbd.RigidBody("bob", 0.6, 0.16, center=(0.2, 0.03, 0.0))
    model.connect(
        mbd.Revolute("hinge", model.ground.origin, rod.point(-0.1, -0.7), stiffness=rng.uniform(10.0, 30.0)),
        mbd.Prismatic("rail", model.ground.point(2.0, 0.0), bob.origin, axis=(0.6, 0.8, 0.0), stiffness=14.0, rest=0.1),
    )
    position = {"hinge.angle": rng.uniform(-3.0, 3.0), "rail.displacement": -0.4}
    start = mbd.assemble(model, position=position, velocity={"hinge.angle": rng.uniform(5.0, 20.0)})
    scheme = mbd.HHT(0.05, formulation="index3")
    run = mbd.simulate(model, start, scheme, dt=dt, until=(100 + part) * dt)
    times = run.time[-2] + np.linspace(0.1, 0.9, 9) * (run.time[-1] - run.time[-2])
    names = [name for name in run.names if name.endswith("acceleration")]
    size = max(np.max(np.abs(run[name])) for name in names)
    for name in names:
        ends = run[name][-2:]
        room = 0.02 * size + np.ptp(ends)
        between = run.at(times)[name]
        assert np.all((between > np.min(ends) - room) & (between < np.max(ends) + room)), name


def hung_by_light_links(mass, seed):
    """A bob on a chain of hinged links of hardly any mass, held by rows: its places are coordinates of their own."""
    rng = np.random.default_rng(seed)
    model = mbd.Model("chain", gravity=(0.0, -9.81, 0.0))
    length, angle, bob = rng.uniform(0.3, 1.5), rng.uniform(-1.2, 1.2), mbd.PointMass("bob", rng.uniform(0.5, 3.0))
    link = mbd.Link("stick", mass, length, 0.5 * length, mass * length**2 / 12.0)
    model.connect(mbd.Revolute("pivot", model.ground.origin, link.start))
    model.connect(mbd.Translation("place", model.ground.origin, bob.origin), mbd.Revolute("pin", link.end, bob.origin))
    place = {"place.x": length * np.sin(angle), "place.y": -length * np.cos(angle)}
    return model, mbd.assemble(model, position={"pivot.angle": angle, **place})


def test_between_rows_a_light_link_moves_as_one_without_mass():
    t = np.linspace(0.0, 1.0, 301)
    for seed in range(2):
        angles = []
        for mass in (0.0, 1e-9, 1e-13, 1e-15):
            model, start = hung_by_light_links(mass, seed)
            run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-8, until=1.0)
            angles.append(run.at(t)["pivot.angle"])
        assert np.max(np.abs(np.array(angles) - angles[0])) < 1e-7


@pytest.mark.parametrize("name", ["HHT", "RadauIIA", "RungeKutta853"])
def test_states_at_times_that_are_asked_for_again_are_found_once(name, monkeypatch):
    """Also where the array of times has changed in the meantime, then those at the new ones."""
    model, start = mechanism(sorted(KINDS)[0], 1)
    once, again = (mbd.simulate(model, start, SCHEMES[name](), dt=STEPS.get(name, USUAL), until=0.1) for _ in range(2))
    found, between = [], ModelColumns._between

    def counted(columns, places, forces):
        found.append(places)
        return between(columns, places, forces)

    monkeypatch.setattr(ModelColumns, "_between", counted)
    times, (one, other) = np.array([0.0123, 0.0456, 0.0789]), start.names[:1] + start.velocity_names[:1]
    first = once.at(times)[one]
    assert np.any(once.at(times.copy())[other] != first) and len(found) == 1
    times += 1e-3
    moved = once.at(times)[one]
    assert len(found) == 2 and np.all(moved != first)
    np.testing.assert_array_equal(moved, again.at([0.0133, 0.0466, 0.0799])[one])


class ByNumpy(ModelColumns):
    """Quantities of a run without machine code."""

    machine = None

    @cached_property
    def balance(self) -> Balance:
        """The equations of motion in numpy."""
        found = Balance(self)
        vars(found)["between"] = None
        return found


@pytest.mark.parametrize("name", ["HHT", "RadauIIA", "RungeKutta853"])
@pytest.mark.parametrize("kind", sorted(KINDS))
def test_machine_code_finds_the_states_between_rows_that_numpy_finds(kind, name):
    """A file of the run is read by numpy."""
    run = mbd.simulate(*mechanism(kind, 2), SCHEMES[name](), dt=STEPS.get(name, USUAL), until=0.1)
    columns, times = run._model_columns, np.linspace(0.003, 0.097, 12)
    places = columns.grid.places(times)
    others = ByNumpy(run.record, columns.equations)
    quick, plain = columns.between(places), others.between(places)
    assert columns.machine is not None and others.balance.between is None
    for part in ("q", "v", "z", "a", "lam"):
        expected = getattr(plain, part)
        np.testing.assert_allclose(
            getattr(quick, part), expected, rtol=1e-7, atol=1e-9 * (1.0 + np.max(np.abs(expected), initial=0.0))
        )
