"""A person in space: de Leva's table, sums and symmetry, what is taken away and changed, motion in flight."""

import warnings
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.errors import ModelError
from mbd.parts.whole_body.table import DE_LEVA, HEIGHTS, SHOULDERS

OTHERS = {
    "male": {
        "head": (0.5976, 0.362, 0.376, 0.312, 0.2033), "forearm": (0.4608, 0.278, 0.267, 0.122, None),
        "hand": (0.79, 0.628, 0.513, 0.401, 0.0862), "shank": (0.4395, 0.251, 0.246, 0.102, None),
    },
    "female": {
        "head": (0.5894, 0.33, 0.359, 0.318, 0.2002), "forearm": (0.4592, 0.263, 0.259, 0.095, None),
        "hand": (0.7474, 0.531, 0.454, 0.335, 0.078), "shank": (0.4352, 0.267, 0.263, 0.092, None),
    },
}  # fmt: skip
"""The same segments between other landmarks (the second half of the table): center, radii, length where it is told."""
TRUNK = {"male": (0.4346, 0.4486, 0.372, 0.347, 0.191), "female": (0.4257, 0.4151, 0.357, 0.339, 0.171)}
"""The trunk as one."""
SHORTEST, TALLEST = 1.2, 2.2
PERSONS = st.tuples(st.floats(20.0, 200.0), st.floats(SHORTEST, TALLEST), st.sampled_from(["male", "female"]))


@pytest.mark.parametrize("sex", DE_LEVA)
def test_the_table_says_the_same_between_other_landmarks(sex):
    for name, (center, sagittal, transverse, long, length) in OTHERS[sex].items():
        row = DE_LEVA[sex][name]
        other = length or row.center * row.length / center  # both begin at the same joint
        assert center * other == pytest.approx(row.center * row.length, abs=1.5e-4), name
        radii = np.array([row.sagittal, row.transverse, row.long]) * row.length
        assert np.array([sagittal, transverse, long]) * other == pytest.approx(radii, abs=4e-4), name


@pytest.mark.parametrize("sex", DE_LEVA)
def test_three_parts_of_the_trunk_weigh_as_the_trunk(sex):
    parts = [DE_LEVA[sex][f"{name} trunk"] for name in ("upper", "middle", "lower")]
    mass, center, *radii = TRUNK[sex]
    length = sum(part.length for part in parts)
    ends = np.cumsum([0.0, *(part.length for part in parts[:2])])
    places = np.array([end + part.center * part.length for end, part in zip(ends, parts, strict=True)])
    weights = np.array([part.mass for part in parts]) / mass
    assert weights.sum() == pytest.approx(1.0, abs=1e-3)
    assert weights @ places == pytest.approx(center * length, abs=4e-3)  # each part is a mean of its own
    spread = weights @ (places - center * length) ** 2
    for name, radius in zip(("sagittal", "transverse"), radii, strict=False):
        own = weights @ np.array([(getattr(part, name) * part.length) ** 2 for part in parts])
        assert np.sqrt(own + spread) == pytest.approx(radius * length, rel=0.02)
    assert SHOULDERS[sex] == pytest.approx({"male": 0.372 / 0.384, "female": 0.357 / 0.379}[sex] * length, rel=2e-3)


@given(PERSONS)
@settings(max_examples=8, deadline=None)
def test_a_person_weighs_and_measures_what_was_asked_and_is_symmetric(numbers):
    mass, height, sex = numbers
    person = mbd.human(mass, height, sex)
    assert person.mass == pytest.approx(mass, rel=1e-14)
    assert person.height == pytest.approx(height, rel=1e-14)
    assert person.freedoms == 34
    assert len(person.bodies) == 15
    for name, body in person.bodies.items():
        if name.startswith("left"):
            twin = person.bodies[name.replace("left", "right")]
            assert body.fields() == twin.fields()
            for point in body.points.values():
                x, y, z = twin.points[point.full_name.replace("left", "right")].offset
                assert point.offset == (x, y, -z)
    assert person.center[2] == pytest.approx(0.0, abs=1e-15 * height)


@pytest.mark.parametrize(("sex", "share"), [("male", 0.57), ("female", 0.55)])
def test_the_center_of_mass_of_who_stands_is_where_textbooks_have_it(sex, share):
    """57 % of the height of men, 55 % of women (J. G. Hay, The Biomechanics of Sports Techniques, 1993)."""
    assert mbd.human(70.0, HEIGHTS[sex], sex).center[1] / HEIGHTS[sex] == pytest.approx(share, abs=2e-3)


@cache
def flight():
    """A person in the air with every joint in motion, the left side larger; and the run."""
    person = mbd.human(70.0, 1.75, name="Kim").scaled("left", mass=1.1, length=1.05).welded("neck")
    model = mbd.Model("flight")
    model.connect(*person.joints)
    for body in person.bodies.values():  # what its angular momentum is made of
        for axis, place in (("x", (1.0, 0.0, 0.0)), ("y", (0.0, 1.0, 0.0)), ("z", (0.0, 0.0, 1.0))):
            body.point(*(a + b for a, b in zip(body.center.offset, place, strict=True)), name=f"to {axis}")
    named = [f"{joint.name}.{each.name}" for joint in person.joints for each in joint.freedoms]
    start = mbd.assemble(model, person.standing(knees=0.4), {name: 0.5 + 0.1 * k for k, name in enumerate(named)})
    return person, model, mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-9, until=0.3)


def momenta(person, run):
    """Σ m v, and Σ m r × v + R I Rᵀ ω about the origin, of all rows."""
    linear, angular = 0.0, 0.0
    for body in person.bodies.values():
        name, m = body.name, body.fields()["mass"]
        place, speed = (np.stack([run[f"{name}.center.{v}{a}"] for a in "xyz"], -1) for v in ("", "v"))
        arms = [np.stack([run[f"{name}.to {b}.{a}"] for a in "xyz"], -1) - place for b in "xyz"]
        rates = [np.stack([run[f"{name}.to {b}.v{a}"] for a in "xyz"], -1) - speed for b in "xyz"]
        half = 0.5 * sum(body.inertia)
        linear = linear + m * speed
        angular = angular + m * np.cross(place, speed)
        for arm, rate, moment in zip(arms, rates, body.inertia, strict=True):
            angular = angular + (half - moment) * np.cross(arm, rate)
    return linear, angular


def test_nothing_but_weight_changes_the_momentum_of_who_flies():
    person, _, run = flight()
    linear, angular = momenta(person, run)
    t, weight = run.t[:, None], np.array([[0.0, -9.81 * person.mass, 0.0]])
    assert np.abs(linear - linear[0] - weight * t).max() < 1e-9 * np.abs(linear).max()
    path = np.stack(
        [sum(b.fields()["mass"] * run[f"{b.name}.center.{a}"] for b in person.bodies.values()) for a in "xyz"], 1
    )
    torque = np.cross(path[:1] * t + 0.5 * linear[0] * t**2, np.array([[0.0, -9.81, 0.0]]))
    assert np.abs(angular - angular[0] - torque).max() < 1e-8 * np.abs(angular).max()
    assert np.ptp(run.energy.total) < 1e-9 * np.abs(run.energy.kinetic).max()


def test_a_person_is_taken_apart_and_changed_by_name():
    person = mbd.human(80.0, 1.8)
    bare = person.without("left arm", "right shank", "head")
    assert set(person.bodies) - set(bare.bodies) == {
        "left upper arm", "left forearm", "left hand", "right shank", "right foot", "head",
    }  # fmt: skip
    assert bare.freedoms == 34 - 5 - 3 - 3
    heavy = person.scaled("left leg", mass=2.0, length=0.9)
    assert heavy.mass - person.mass == pytest.approx((0.1416 + 0.0433 + 0.0137) * 80.0)
    assert heavy.bodies["left shank"].length == pytest.approx(0.9 * person.bodies["left shank"].length)
    assert heavy.bodies["left foot"].inertia[1] == pytest.approx(1.62 * person.bodies["left foot"].inertia[1])
    soft = person.changed("left knee", stiffness=5.0, loss=mbd.Viscous(0.2)).welded("back", "left wrist")
    assert (soft.joint("left knee").stiffness, soft.freedoms) == (5.0, 30)
    blade = mbd.Link("right foot", mass=1.0, length=0.2, center=0.1, inertia=(0.01, 0.001, 0.01))
    assert person.replaced("right foot", blade).bodies["right foot"] is blade
    grounded = person.without("trunk")
    assert grounded.freedoms == 28 == mbd.human(80.0, 1.8, floating=False).freedoms
    for each in (person, bare, heavy, soft, person.replaced("right foot", blade)):
        model = mbd.Model("person")
        model.connect(*each.joints)
        assert model.check() == []


def test_height_and_center_follow_frames_that_turn_what_hangs_on_them():
    """A pelvis whose joint of the back is tilted: the head and the center of mass are where the assembled person has
    them."""
    person = mbd.human(80.0, 1.8)
    old = person.bodies["pelvis"]
    pelvis = mbd.RigidBody("pelvis", old.mass, old.inertia, center=old.center.offset)
    for point in old.points.values():
        place = pelvis.point(*point.offset, name=None if point.name == "back" else point.name)
        if point.name == "back":
            place.turned(0.4, (0.3, 0.2, 1.0), name="back")
    bent = person.replaced("pelvis", pelvis)
    model = mbd.Model("bent")
    model.connect(*bent.joints)
    start = mbd.assemble(model, bent.standing())
    masses = {name: body.fields()["mass"] for name, body in bent.bodies.items()}
    center = sum(m * start[f"{name}.center"] for name, m in masses.items()) / sum(masses.values())
    assert bent.center == pytest.approx(center, abs=1e-12)
    assert abs(bent.center[2]) > 1e-3
    assert bent.height == pytest.approx(start["head.top.y"], abs=1e-12)
    assert bent.height < 1.8 - 0.01


def test_a_blade_in_place_of_a_foot_reaches_down_to_its_lowest_point():
    person, blade = mbd.human(80.0, 1.8), mbd.RigidBody("right foot", 1.0, (0.01, 0.001, 0.01))
    height, ankle = person.standing()["trunk.y"], -person.bodies["right foot"].points["right foot.sole"].offset[1]
    with pytest.raises(ModelError, match=r"how far 'right foot' reaches down.*name='sole'"):
        person.replaced("right foot", blade).standing()
    blade.point(0.1, -0.2, name="tip")
    assert person.replaced("right foot", blade).standing()["trunk.y"] == pytest.approx(height - ankle + 0.2)
    rod = mbd.Link("right foot", mass=1.0, length=0.2, center=0.1, inertia=(0.01, 0.001, 0.01))
    assert person.replaced("right foot", rod).standing()["trunk.y"] == pytest.approx(height - ankle + 0.2)


def test_two_persons_live_in_one_model():
    model = mbd.Model("a pair")
    for name in ("Ann", "Bo"):
        model.connect(*mbd.human(60.0, 1.7, name=name).joints)
    assert model.check() == []


@pytest.mark.parametrize("knees", [0.0, 0.3, 1.2])
def test_who_stands_has_level_soles_on_the_ground_below_the_hips(knees):
    person, model, _ = flight()
    start = mbd.assemble(model, person.standing(knees))
    run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-9, until=0.0)
    at = {
        f"{side} {part}": run[f"Kim {side} foot.{part}"][0]
        for side in ("left", "right")
        for part in ("heel", "toe", "sole")
    }
    assert at["left sole"][1] == pytest.approx(0.0, abs=1e-12) and at["right sole"][1] > 0.0  # the left leg is longer
    for side in ("left", "right"):
        heights = [at[f"{side} {part}"][1] for part in ("heel", "toe", "sole")]
        assert np.ptp(heights) < 1e-12 and abs(at[f"{side} sole"][0]) < 1e-12


def test_a_leg_that_is_changed_stands_on_the_ground_too():
    person = mbd.human(70.0, 1.75)
    knees = "left knee", "right knee"
    for each, lifted in (
        (person.welded("left knee"), "right"), (person.welded(*knees), ""),
        (person.changed("left knee", axis=(0, 0, -1)), ""), (person.welded("left knee", "left ankle"), "right"),
    ):  # fmt: skip
        model = mbd.Model("person")
        model.connect(*each.joints)
        start = mbd.assemble(model, each.standing(knees=0.4))
        for side in ("left", "right"):
            heel, toe = (start[f"{side} foot.{end}"][1] for end in ("heel", "toe"))
            assert heel == pytest.approx(toe, abs=1e-12) and (abs(heel) < 1e-12) == (side != lifted)


def test_passive_moments_are_absent_unless_asked_for():
    assert mbd.human(70.0, 1.75).moments == ()
    person = mbd.human(70.0, 1.75, passive=True).without("right leg")
    assert [moment.name for moment in person.moments] == [
        f"left {at} passive moment" for at in ("hip", "knee", "ankle")
    ]
    model = mbd.Model("person")
    model.connect(*person.joints)
    with pytest.warns(mbd.MbdWarning, match=r"none of the passive moments .*model\.apply\(\*person\.moments\)"):
        model.check()
    model.apply(person.moments[1])  # some of them are a choice
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert model.check() == []
    assert person.joints == mbd.human(70.0, 1.75).without("right leg").joints


def test_what_a_person_lacks_is_named():
    person = mbd.human(70.0, 1.75)
    for act, said in (
        (lambda: person.without("left shnk"), "did you mean 'left shank'"),
        (lambda: person.without("pelvis"), "pelvis"),
        (lambda: person.changed("left knee", stifness=1.0), "did you mean 'stiffness'"),
        (lambda: person.welded("knee"), "The person has"),
        (lambda: person.scaled("left", mass=-1.0), "must be positive"),
        (lambda: person.replaced("left foot", 3), "a body such as"),
        (lambda: person.replaced("left foot", mbd.PointMass("foot", 1.0)), "name the body 'left foot'"),
        (lambda: mbd.human(70.0, 1.75, "mail"), "did you mean 'male'"),
        (lambda: person.without("head").height, "its height ends at the head"),
        (lambda: person.replaced("head", mbd.PointMass("head", 5.0)).height, "the point 'top' of 'head'"),
        (lambda: person.welded("left ankle").standing(knees=0.2), "'left ankle' about z, which it does not allow"),
        (lambda: person.changed("left knee", axis="x").standing(knees=0.2), "'left knee' about z"),
        (lambda: person.joint("kne"), "joint"),
    ):  # fmt: skip
        with pytest.raises(ModelError, match=said):
            act()


def test_wrong_words_for_a_person_are_answered_with_right_ones():
    person = mbd.human(70.0, 1.75)
    with pytest.raises(ModelError, match=r"'left knee' is a joint; without\('left shank'\) leaves it out"):
        person.without("left knee")
    with pytest.raises(ModelError, match="all segments hang on the pelvis"):
        person.without("pelvis")
    with pytest.raises(ModelError, match="did you mean 'left arm'"):
        person.without("left arms")
    with pytest.raises(ModelError, match="no body named 'left toe'; did you mean 'left foot'"):
        person.bodies["left toe"]
    with pytest.warns(mbd.MbdWarning, match="a height of 175 m; heights are in metres"):
        mbd.human(70.0, 175.0)
    assert "left hip         orientation" in str(person)
    held = mbd.human(70.0, 1.75, floating=False)
    assert (held.height, held.center) == (person.height, person.center)
