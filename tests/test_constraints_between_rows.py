"""Between the rows of a run its constraints hold as they do at rows, with every scheme and at every size of step.

Rows of joints, of measures and of closed contacts are evaluated where nothing is stored; prescribed motions are
compared with the tables that prescribe them, whose third derivative jumps within steps.
"""

import random

import numpy as np
import pytest

import mbd
from mbd.hardcases.schemes import SCHEMES
from tests.mechanisms_between_rows import KINDS

ROUND_OFF = 2e-11
"""What constraints miss beside what rows miss, of mechanisms of meters and seconds [m, rad, m/s, rad/s]."""


def some_times(run: mbd.Trajectory, seed: int, count: int = 3) -> np.ndarray:
    """Times within the steps of a run."""
    rng, t = np.random.default_rng(seed), run.time
    steps = np.flatnonzero(np.diff(t) > 1e-6)
    return np.sort(np.concatenate([t[steps] + part * np.diff(t)[steps] for part in rng.uniform(0.05, 0.95, count)]))


def missed(run: mbd.Trajectory, rows) -> tuple[np.ndarray, np.ndarray]:
    """|h| and |ḣ| of the worst row that acts, at each of the states (k,)."""
    columns, found = run.columns, []
    equations = columns.equations
    active = [
        np.ones(len(rows), dtype=bool) if row.contact < 0 else rows.closed[:, row.contact].astype(bool)
        for row in equations.rows if row.friction < 0
    ]  # fmt: skip
    for part in ("value", "rate"):
        values = columns.evaluate([getattr(row, part) for row in equations.rows if row.friction < 0], rows)
        found.append(np.max([np.abs(value) * acts for value, acts in zip(values, active, strict=True)], axis=0))
    return found[0], found[1]


def assert_rows_hold(run: mbd.Trajectory, seed: int = 1) -> None:
    """Rows miss between the rows of a run what they miss there, but for round-off."""
    there = run.columns.between(run.columns.grid.places(some_times(run, seed)))
    (h, rate), (most, fastest) = missed(run, there), missed(run, run.columns.rows)
    assert np.max(h) <= np.max(most) + ROUND_OFF
    assert np.max(rate) <= np.max(fastest) + ROUND_OFF


@pytest.mark.covering
@pytest.mark.parametrize("name", SCHEMES)
@pytest.mark.parametrize(
    ("kind", "seed"), [("loop", 1), ("redundant", 1), ("redundant", 2), ("standing", 2), ("turning", 1), ("turning", 5)]
)
def test_between_rows_constraints_hold_as_at_rows(kind, seed, name):
    model, start = KINDS[kind](seed)
    assert_rows_hold(mbd.simulate(model, start, SCHEMES[name](), dt=0.01, until=0.2), seed)


@pytest.mark.parametrize("name", [name for name in SCHEMES if "index3" in name])
@pytest.mark.parametrize("seed", [0, 1, 4])
def test_between_rows_of_long_steps_constraints_hold_as_at_rows(seed, name):
    """Polynomials are off by 0.1 rad there, which takes Newton's method five corrections."""
    model, start = KINDS["loop"](seed)
    assert_rows_hold(mbd.simulate(model, start, SCHEMES[name](), dt=0.1, until=1.0, on_failure="return"))


@pytest.mark.parametrize("lightest", [1e-3, 1e-6, 1e-8])
def test_between_rows_constraints_hold_at_both_ends_of_a_light_link(lightest):
    """In the metric of inertia the rows at its two ends depend on each other along it, in no singular pose."""
    model, end, position = mbd.Model("light chain", cut="all"), None, {}
    for k, mass in enumerate((2.0, lightest, 3.0)):
        link = mbd.Link(f"link {k}", mass, 0.4, 0.2, 0.015 * mass)
        joint = mbd.Revolute(f"joint {k}", model.ground.origin if end is None else end, link.start)
        model.connect(joint)
        position[f"joint {k}.angle"], end = 0.5 - 0.3 * k, link.end
    assert_rows_hold(mbd.simulate(model, mbd.assemble(model, position=position), dt=0.01, until=0.1))


@pytest.mark.parametrize(
    ("gap", "scheme", "until"),
    [
        (1e-3, mbd.HHT(0.05), 0.5),
        (4e-4, mbd.HHT(0.05), 0.5),
        (1e-6, mbd.RungeKutta853(), 0.3),
        (1e-6, mbd.RadauIIA(), 0.3),
    ],
    ids=repr,
)
def test_between_rows_constraints_hold_next_to_a_flat_pose_that_is_not_met(gap, scheme, until):
    """A four-bar that is a parallelogram but for a part of its base; its rates change fast where it is almost flat."""
    model = mbd.Model("almost flat", gravity=(0.0, 0.0, 0.0))
    sizes = {"crank": 0.4, "coupler": 1.0, "rocker": 0.4}
    crank, coupler, rocker = (mbd.Link(name, 1.0, size, 0.5 * size, 0.1) for name, size in sizes.items())
    model.connect(
        mbd.Revolute("a", model.ground.origin, crank.start), mbd.Revolute("b", crank.end, coupler.start),
        mbd.Revolute("d", model.ground.point(1.0 + gap, 0.0), rocker.start), mbd.Revolute("c", coupler.end, rocker.end),
    )  # fmt: skip
    pose = {"a.angle": 0.9, "b.angle": 0.5 * np.pi - 0.9, "d.angle": 0.9}
    start = mbd.assemble(model, position=pose, velocity={"a.angle": 3.0}, project=True)
    assert_rows_hold(mbd.simulate(model, start, scheme, dt=0.004, until=until, on_failure="return"))


def driven_chain(seed: int, cut: str) -> tuple[mbd.Model, mbd.State, dict[str, mbd.Samples]]:
    """Two links whose joints repeat cycles of few samples; the seed odd, one of them has dry friction."""
    rng = random.Random(seed)
    model, end, tables = mbd.Model(f"driven {seed}", cut=cut), None, {}
    for k in range(2):
        link = mbd.Link(f"link {k}", 1.0, 0.4, 0.2, 0.01)
        loss = mbd.Coulomb(0.1) if seed % 2 and k else None
        joint = mbd.Revolute(f"joint {k}", model.ground.origin if end is None else end, link.start, loss=loss)
        model.connect(joint)
        t = np.linspace(0.0, rng.uniform(0.3, 0.5), 12)
        values = rng.uniform(0.1, 0.3) * np.sin(2.0 * np.pi * t / t[-1]) + rng.uniform(0.01, 0.05) * (np.arange(12) % 2)
        values[-1] = values[0]
        table = mbd.Samples(t, values, periodic=True)
        model.constrain(mbd.Bilateral(f"drive {k}", joint, value=table))
        tables[joint.coordinate_names[0]], end = table, link.end
    return model, mbd.assemble(model, position=dict.fromkeys(tables, 0.0), project=True), tables


@pytest.mark.parametrize("scheme", [mbd.RungeKutta4(), mbd.RungeKutta853(), mbd.RadauIIA()], ids=repr)
@pytest.mark.parametrize("cut", ["auto", "all"])
@pytest.mark.parametrize("seed", range(2))
def test_between_rows_a_drive_follows_its_table(seed, cut, scheme):
    model, start, tables = driven_chain(seed, cut)
    run = mbd.simulate(model, start, scheme, dt=0.015, until=0.15)
    times = some_times(run, seed)
    there = run.at(times)
    for name, table in tables.items():
        off = np.max(np.abs(there[name] - table(times)))
        assert off <= ROUND_OFF, f"{name} is {off:.3g} off its table"
