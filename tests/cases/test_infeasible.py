"""Case j15 and its kin: constraints that cannot hold together are refused with the smallest set of them."""

import re
from collections.abc import Callable, Sequence
from typing import Any

import pytest

import mbd
from tests.cases.linkages import four_bar
from tests.problems import case
from tests.simulation.mechanisms import kneed_walker

J15 = case("j15-infeasible-constraints")
LINKS, GROUND = tuple(J15.definition["links"]), J15.definition["ground"]
MISS = J15["smallest closure error"].value


def refusal(model: mbd.Model, **wish: Any) -> str:
    """The one sentence with which a start is refused."""
    with pytest.raises(mbd.AssemblyError) as refused:
        mbd.assemble(model, **wish)
    (sentence,) = refused.value.faults
    return sentence


def between(sentence: str) -> list[str]:
    """The names that a refusal says are in conflict."""
    return re.findall(r"'([^']+)'", sentence.partition("; ")[2].partition(": ")[0])


# j15 ----------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("cut", ["auto", "all", ["a"], ["d"], ["b", "d"]], ids=str)
def test_a_four_bar_that_cannot_close_is_refused_with_its_closure_error(cut: Any) -> None:
    said = refusal(four_bar(LINKS, GROUND, cut), velocity={"crank.end.vy": 1.0})
    found = re.match(
        r"constraints cannot be satisfied: closure error (\S+) m at joint '([abcd])' after (\d+) iterations; ", said
    )
    assert found is not None, said
    assert float(found[1]) == pytest.approx(MISS, abs=1e-6)
    assert int(found[3]) > 0
    assert sorted(between(said)) == ["a", "b", "c", "d"]
    assert "change a length in the loop" in said


def test_the_report_of_the_mobility_says_the_same() -> None:
    found = mbd.mobility(four_bar(LINKS, GROUND))
    (conflict,) = found.conflicts
    assert not found.consistent
    assert conflict.error == pytest.approx(MISS, abs=1e-12)
    assert conflict.names == ("a", "b", "c", "d")
    assert "closure error 0.4 m at joint" in str(found)


def test_a_four_bar_that_just_closes_is_not_refused() -> None:
    start = mbd.assemble(four_bar(LINKS, 0.5999))
    assert start["a.angle"] != 0.0


# constraints --------------------------------------------------------------------------------------------------------
Words = Callable[[mbd.Model, Sequence[mbd.PointMass]], Sequence[Any]]


def points(count: int, words: Words) -> mbd.Model:
    """Free points in the plane with constraints on them."""
    model = mbd.Model("points")
    masses = [mbd.PointMass(f"p{k}", mass=1.0 + k) for k in range(count)]
    for k, mass in enumerate(masses):
        model.connect(mbd.Translation(f"place {k}", model.ground.origin, mass.origin))
    model.constrain(*words(model, masses))
    return model


def test_two_different_distances_between_the_same_points_are_named_and_nothing_else() -> None:
    model = points(
        2,
        lambda model, p: [
            mbd.Bilateral("bystander", mbd.height(p[1].origin), value=0.3),
            mbd.Bilateral("short", mbd.distance(model.ground.origin, p[0].origin), value=1.0),
            mbd.Bilateral("thread", mbd.distance(p[0].origin, p[1].origin), value=2.0),
            mbd.Bilateral("long", mbd.distance(model.ground.origin, p[0].origin), value=1.1),
        ],
    )
    said = refusal(model, position={"place 0.x": 0.6})
    assert "closure error 0.1 m at constraint 'long'" in said
    assert between(said) == ["short", "long"]
    assert "give up one of the constraints, change its value, or make it a force" in said


@pytest.mark.parametrize("count", [2, 3, 5])
def test_a_conflict_through_a_chain_of_rods_names_the_whole_chain(count: int) -> None:
    """Rods of 1 m one after the other do not reach an end `count` + 1 m away; a branch of the chain has no part."""

    def words(model: mbd.Model, p: Sequence[mbd.PointMass]) -> list[Any]:
        frames = [model.ground.origin, *(mass.origin for mass in p)]
        rods = [mbd.Bilateral(f"rod {k}", mbd.distance(frames[k], frames[k + 1]), value=1.0) for k in range(count)]
        branch = mbd.Bilateral("branch", mbd.distance(frames[1], frames[-1]), value=0.7)
        end = mbd.Bilateral("end", mbd.distance(model.ground.origin, frames[count]), value=count + 1.0)
        return [rods[0], branch, *rods[1:], end]

    said = refusal(points(count + 1, words))
    assert f"closure error {1.0:g} m at constraint 'end'" in said
    assert sorted(between(said)) == sorted([*(f"rod {k}" for k in range(count)), "end"])


def test_two_separate_conflicts_are_both_told() -> None:
    model = points(
        2,
        lambda model, p: [
            mbd.Bilateral(f"{name} {k}", mbd.height(p[k].origin), value=value + k)
            for name, value in (("low", 0.1), ("high", 0.3))
            for k in (0, 1)
        ],
    )
    with pytest.raises(mbd.AssemblyError) as refused:
        mbd.assemble(model)
    assert [sorted(between(fault)) for fault in refused.value.faults] == [["high 0", "low 0"], ["high 1", "low 1"]]


def test_contacts_that_cannot_be_closed_together_are_named() -> None:
    model = points(
        2,
        lambda model, p: [
            mbd.Unilateral("floor", mbd.touchdown(p[0].origin)),
            mbd.Unilateral("other floor", mbd.touchdown(p[1].origin)),
            mbd.Unilateral("shelf", mbd.separation(model.ground.point(0.0, 0.5), p[0].origin, (0, 1, 0))),
        ],
    )
    said = refusal(model, closed=["floor", "shelf", "other floor"])
    assert "closure error 0.5 m at contact 'shelf'" in said
    assert between(said) == ["floor", "shelf"]
    assert "leave one of the contacts out of closed=[…]" in said
    assert mbd.mobility(model, closed=["floor", "shelf"]).conflicts[0].names == ("floor", "shelf")
    assert mbd.mobility(model, closed=["floor", "other floor"]).consistent


# velocities ---------------------------------------------------------------------------------------------------------
def test_motions_prescribed_at_different_speeds_are_named() -> None:
    model = points(
        2,
        lambda model, p: [
            mbd.Bilateral("still", mbd.height(p[0].origin), value=0.5),
            mbd.Bilateral("other", mbd.height(p[1].origin), value=lambda t: 0.5 - t),
            mbd.Bilateral("lift", mbd.height(p[0].origin), value=lambda t: 0.5 + 0.25 * t),
        ],
    )
    said = refusal(model)
    assert said.startswith("velocities cannot be satisfied: error 0.25 m/s at constraint 'lift'")
    assert between(said) == ["still", "lift"]


def test_a_blade_and_a_motion_across_it_are_named() -> None:
    model = mbd.Model("sledge")
    body = mbd.RigidBody("body", mass=1.0, inertia=0.1)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    model.constrain(
        mbd.Bilateral("along", mbd.measure("place.x"), value=lambda t: 2.0 * t),
        mbd.Bilateral("across", mbd.height(body.origin), value=lambda t: 0.3 * t),
        mbd.KnifeEdge("blade", body.origin),
    )
    said = refusal(model)
    assert said.startswith("velocities cannot be satisfied: error 0.3 m/s at constraint 'blade'")
    assert between(said) == ["across", "blade"]
    assert mbd.mobility(model).conflicts[0].names == ("across", "blade")


def test_motions_prescribed_with_different_accelerations_are_found_by_the_mobility() -> None:
    model = points(
        1,
        lambda model, p: [
            mbd.Bilateral("still", mbd.height(p[0].origin), value=0.5),
            mbd.Bilateral("lift", mbd.height(p[0].origin), value=lambda t: 0.5 + 3.0 * t * t),
        ],
    )
    (conflict,) = mbd.mobility(model).conflicts
    assert (conflict.level, conflict.names) == ("acceleration", ("still", "lift"))
    assert conflict.error == pytest.approx(6.0, abs=1e-6)
    with pytest.raises(mbd.SimulationError, match="constraint 'still', constraint 'lift' cannot hold together"):
        mbd.simulate(model, mbd.assemble(model), dt=1e-3, until=0.1)


def test_named_rates_that_the_loop_contradicts_are_told_with_who_is_in_conflict() -> None:
    model = four_bar((0.3, 1.0, 0.8), 0.9)
    with pytest.raises(mbd.AssemblyError) as refused:
        mbd.assemble(model, {"a.angle": 0.4}, {"a.angle": 1.0, "d.angle": 3.0})
    assert len(refused.value.faults) == 2
    for fault in refused.value.faults:
        assert fault.endswith("(in conflict: 'c', 'a.angle.rate', 'd.angle.rate')")


def test_named_angles_that_the_loop_contradicts_are_told_with_who_is_in_conflict() -> None:
    with pytest.raises(mbd.AssemblyError) as refused:
        mbd.assemble(four_bar((0.3, 1.0, 0.8), 0.9), {"a.angle": 0.0, "d.angle": 3.0})
    for fault in refused.value.faults:
        assert fault.endswith("(in conflict: 'c', 'a.angle', 'd.angle')")


def test_each_of_two_contradicted_contacts_is_told_with_its_own_named_values() -> None:
    """Thigh and shank lean as far to and fro, so that the hip angle does not push at first order; it takes part."""
    walker = kneed_walker()
    wish = {"left hip.angle": 0.2, "left knee.angle": -0.4, "trunk.y": 0.9}
    with pytest.raises(mbd.AssemblyError) as refused:
        mbd.assemble(walker, wish, closed=["left foot", "left knee lock"])
    foot, lock = refused.value.faults
    assert lock.endswith("(in conflict: 'left knee lock', 'left knee.angle')")
    names = set(re.findall(r"'([^']+)'", foot.partition("(in conflict: ")[2]))
    assert names == {"left foot", *wish}


def test_of_two_loops_only_the_one_that_cannot_close_is_named() -> None:
    model = four_bar((0.3, 1.0, 0.8), 0.9)
    rocker = model.joints[-1].child.body
    arm = mbd.Link("arm", mass=1.0, length=0.4, center=0.2, inertia=0.01)
    model.connect(
        mbd.Revolute("e", rocker.end, arm.start),
        mbd.Revolute("f", arm.end, model.ground.point(4.0, 0.0, name="too far")),
    )
    said = refusal(model)
    assert sorted(between(said)) == ["d", "e", "f"]
    assert re.search(r"closure error 1\.9 m at joint '[def]'", said), "3.1 m away, 0.8 m and 0.4 m long"


# during a run -------------------------------------------------------------------------------------------------------
def test_a_floor_that_stops_a_prescribed_motion_ends_the_run_and_both_are_named() -> None:
    model = points(
        1,
        lambda model, p: [
            mbd.Bilateral("drive", mbd.height(p[0].origin), value=lambda t: 0.5 - t),
            mbd.Unilateral("floor", mbd.height(p[0].origin)),
        ],
    )
    with pytest.raises(mbd.SimulationError, match=r"t = 0\.5 s .*rows conflict: 'drive', 'floor' \(normal\)"):
        mbd.simulate(model, mbd.assemble(model), dt=1e-2, until=1.0)


def test_rows_that_agree_at_first_and_part_later_end_the_run_and_are_named() -> None:
    model = points(
        1,
        lambda model, p: [
            mbd.Bilateral("still", mbd.height(p[0].origin), value=lambda t: 0.5 + 0.0 * t),
            mbd.Bilateral("late", mbd.height(p[0].origin), value=lambda t: 0.5 + mbd.maximum(t - 0.3, 0.0) ** 3),
        ],
    )
    run = mbd.simulate(model, mbd.assemble(model), dt=1e-2, until=1.0, on_failure="return")
    assert not run.success and "constraint 'still', constraint 'late' cannot hold together" in run.message
    assert 0.29 < run.time[-1] < 0.35
