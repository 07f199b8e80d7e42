"""The labs in space: errors they tell are the true ones, effects that never act leave no trace, for every joint."""

import random

import numpy as np
import pytest

import mbd
import mbd.analysis.accuracy.lab as accuracy_lab
from mbd.analysis.accuracy import choices, points
from mbd.analysis.effects import lab, timing
from mbd.integrators import Integrator
from tests.space_scenes import Scene, cases, scene

UNTIL = 0.3
FAR = 50.0
SCHEMES: tuple[Integrator, ...] = (
    mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853(), mbd.GeneralizedAlpha(0.8, formulation="index3"),
)  # fmt: skip


@pytest.fixture(autouse=True, scope="module")
def quick():
    """Nothing here judges times, and few rows are enough."""
    patch = pytest.MonkeyPatch()
    for place, name, value in (
        (choices, "MIN_ROWS", 150), (choices, "MAX_ROWS", 300), (points, "MAX_REPEATS", 1),
        (accuracy_lab, "MAX_TIMING_SECONDS", 0.0), (timing, "MIN_ROUNDS", 2), (timing, "MAX_ROUNDS", 2),
        (lab, "STEPS", (50, 50)),
    ):  # fmt: skip
        patch.setattr(place, name, value)
    yield
    patch.undo()


# accuracy -----------------------------------------------------------------------------------------------------------
def errors(made: Scene) -> None:
    """What the lab tells of a scheme is its distance from a run of order 8 to round-off, by every result."""
    schemes = {"hht": mbd.HHT(0.05), "radau": mbd.RadauIIA(), "rk4": mbd.RungeKutta4()}
    found = mbd.accuracy(made.model, made.start, UNTIL, integrators=schemes, dts=[0.01, 0.005])
    truth = mbd.simulate(made.model, made.start, mbd.RungeKutta853(), tol=1e-12, until=UNTIL)
    reference = found.reference
    assert reference is not None, found.notes
    instants, names = reference.instants, list(found.quantities)
    right, own = truth.at(instants).read(*names), reference.run.at(instants).read(*names)
    for name in names:
        off = np.max(np.abs(own[name] - right[name])) / reference.scales[name]
        assert off <= 10.0 * reference.bound[name] + 1e-9, name
    told = [(label, point) for label in schemes for point in found.of(label)]
    assert len(told) == 2 * len(schemes)
    assert not any(point.failure and not point.at_most for _, point in told)
    for label, point in told:
        run = mbd.simulate(made.model, made.start, schemes[label], dt=point.dt, until=UNTIL)
        there = run.at(instants).read(*names)
        assert point.errors or label != "hht"
        for name in point.errors:  # others are not clear of the error of the reference
            gap = float(np.max(np.abs(there[name] - right[name]))) / reference.scales[name]
            assert point.errors[name] == pytest.approx(gap, rel=1e-3, abs=2.0 * reference.error + 1e-9), (label, name)


# effects ------------------------------------------------------------------------------------------------------------
IDLE = ("far foot", "far mat", "far stop", "no spring", "no push")


def with_idle_effects(case: tuple[str, str, int]) -> Scene:
    """The same mechanism with contacts that stay open, events that never come, and forces of no strength."""
    made = scene.__wrapped__(*case)  # a model of its own
    model, last = made.model, list(made.model.bodies.values())[-2]
    point, plane = last.point(0.1, 0.2, -0.1), mbd.Plane((0.1, 1.0, 0.2), -FAR, velocity=(0.1, 0.0, 0.0))
    model.constrain(
        mbd.Unilateral("far foot", mbd.touchdown(point, plane), friction=0.0),
        mbd.Penalty("far mat", mbd.touchdown(point, plane), stiffness=1e4, damping=3.0),
        mbd.Unilateral("far stop", mbd.distance(point, model.ground.point(FAR, 0.3, 0.2)), restitution=0.4),
        mbd.Event("far event", mbd.measure(lambda p: p[0] - FAR, point)),
    )
    model.apply(
        mbd.Spring("no spring", model.ground.point(1.0, 2.0, 3.0), point, stiffness=0.0, length=0.4),
        mbd.Applied("no push", point, force=(0.0, 0.0, 0.0)),
    )
    return made


def bits(run: mbd.Trajectory) -> tuple[bytes, ...]:
    record = run.record
    return tuple(part.tobytes() for part in (record.time, record.q, record.v))


def absent(case: tuple[str, str, int]) -> None:
    """Idle effects change no bit of the motion; accelerations and reactions by a rounding at most."""
    bare, full = scene(*case), with_idle_effects(case)
    state = mbd.project(full.model, full.start)
    np.testing.assert_array_equal(full.start.q, bare.start.q)
    np.testing.assert_array_equal(full.start.v, bare.start.v)
    np.testing.assert_allclose(state.q, bare.start.q, rtol=0, atol=1e-12)
    for scheme in SCHEMES:
        one, two = (mbd.simulate(each.model, each.start, scheme, dt=5e-3, until=UNTIL) for each in (bare, full))
        assert bits(one) == bits(two), scheme
        assert [(e.time, e.kind, e.name) for e in one.events] == [(e.time, e.kind, e.name) for e in two.events]
        names = [name for name in one.names if ".reaction_" in name or name.endswith(".force")]
        for name in random.Random(str(case)).sample(names, min(4, len(names))):
            size = float(np.max(np.abs(one[name])))
            np.testing.assert_allclose(two[name], one[name], rtol=0, atol=1e-13 * size, err_msg=name)
        np.testing.assert_allclose(two.record.a, one.record.a, rtol=0, atol=1e-13 * np.max(np.abs(one.record.a)))


def studied(case: tuple[str, str, int]) -> None:
    """The study says of each idle effect that has a force that it changes nothing, to the bit, and of no other."""
    made = with_idle_effects(case)
    found = mbd.effects(made.model, made.start, UNTIL, dt=5e-3)
    assert {each.name for each in found.contributions if each.name in IDLE} == {"far mat"}
    assert found["far mat"].change.identical and found["far mat"].change.largest == 0.0
    for each in found.contributions:
        rest = made.model.without(each.name)
        run = mbd.simulate(rest, found_start(rest, made), dt=5e-3, until=UNTIL)
        assert each.change.identical == (bits(run)[1:] == bits(found.run)[1:]), each.name


def found_start(rest: mbd.Model, made: Scene) -> mbd.State:
    """The start of the whole scene for a reduced one of the same joints."""
    state = made.start
    place, speed = dict(zip(state.names, state.q, strict=True)), dict(zip(state.velocity_names, state.v, strict=True))
    for joint in rest.joints:
        if f"{joint.name}.orientation.w" in place:
            parts = tuple(float(place.pop(f"{joint.name}.orientation.{part}")) for part in "wxyz")
            place[f"{joint.name}.orientation"] = parts
    again = mbd.assemble(rest, place, speed)
    assert again.names == state.names
    return again


FEW = [("loop", "universal", 0)]
HELD = [("loop", "screw", 0)]
"""A loop that holds three of its coordinates, whose rates are round-off."""
SMOOTH = [each for each in cases(range(2)) if each[0] != "feet"]


@pytest.mark.parametrize("case", HELD, ids=str)
def test_errors_that_the_lab_tells_are_true_in_space(case):
    errors(scene(*case))


@pytest.mark.parametrize("case", FEW, ids=str)
def test_idle_effects_change_no_bit_in_space(case):
    absent(case)


@pytest.mark.slow
@pytest.mark.parametrize("case", SMOOTH, ids=str)
def test_errors_that_the_lab_tells_are_true_for_every_joint(case):
    errors(scene(*case))


@pytest.mark.slow
@pytest.mark.parametrize("case", cases(range(2)), ids=str)
def test_idle_effects_change_no_bit_with_any_joint(case):
    absent(case)


@pytest.mark.slow
@pytest.mark.parametrize("case", SMOOTH[::3], ids=str)
def test_the_study_of_effects_finds_what_changes_no_bit_in_space(case):
    studied(case)
