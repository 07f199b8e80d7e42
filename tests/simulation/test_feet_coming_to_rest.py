"""Feet of a person that slide to rest one after the other: friction turns fast where one of them is slow."""

import pytest

import mbd


@pytest.mark.slow
def test_a_person_who_slides_comes_to_stand_with_any_step():
    """Steps are judged as long as they are, not as long as dt: the motion is there at each."""
    person = mbd.human(70.0, 1.75, "female", passive=True)
    model = mbd.Model("person")
    model.connect(*person.joints)
    model.apply(*person.moments)
    feet = [f"{side} {place}" for side in ("left", "right") for place in ("heel", "inner ball", "outer ball")]
    for foot in feet:
        side, _, place = foot.partition(" ")
        point = person.bodies[f"{side} foot"].frame(place)
        model.constrain(mbd.Unilateral(foot, mbd.touchdown(point), friction=0.5))
    start = mbd.assemble(model, position=person.standing(knees=0.1), velocity={"trunk.x": 0.6, "trunk.z": 0.2})
    places = []
    for dt in (1e-3, 2.5e-4, 1e-4):
        run = mbd.simulate(model, start, mbd.HHT(0.1), dt=dt, until=0.02)
        assert all(abs(run[f"{foot}.friction.forward"][-1]) < 0.5 * run[f"{foot}.force"][-1] for foot in feet)
        places.append(run["trunk.x"][-1])
    assert max(places) - min(places) < 1e-4
