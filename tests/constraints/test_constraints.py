"""What single measures and constraints do, and what they refuse."""

import math
import pickle

import pytest
import sympy

import mbd
from mbd.bodies import Ground
from mbd.errors import ModelError
from tests.helpers import FreeScope

GROUND = Ground()
ROD = mbd.Link("rod", 1.0, 0.5, 0.2)
HINGE = mbd.Revolute("hinge", GROUND.origin, ROD.start)
FOOT = mbd.touchdown(ROD.end)


def rod_at(angle: float, rate: float = 0.0) -> FreeScope:
    """The rod at its hinge, turned about z; its other coordinates stay exact zeros."""
    scope = FreeScope([HINGE])
    scope.move("rod", (0.0, 0.0, 0.0, 0.0, 0.0, angle), (0.0, 0.0, 0.0, 0.0, 0.0, rate))
    return scope


class PlanarScope(FreeScope):
    """Bodies move in x–y: place z and the turns about x, y are exact zeros."""

    def coordinates(self, body):
        x, y, _, _, _, angle = super().coordinates(body)
        zero = self.tape.zero
        return [x, y, zero, zero, zero, angle]


def test_heights_and_angles():
    scope = rod_at(0.3)
    assert scope.value(mbd.height(ROD.end).gap(scope)) == pytest.approx([-0.5 * math.cos(0.3)])
    assert scope.value(FOOT.gap(scope)) == pytest.approx([-0.5 * math.cos(0.3)])
    assert scope.value(mbd.flexion(HINGE).gap(scope)) == pytest.approx([-0.3])
    assert scope.value(mbd.extension(HINGE, offset=0.1).gap(scope)) == pytest.approx([0.2])


def test_distances():
    scope = rod_at(0.3)
    post = GROUND.point(2.0, 0.0)
    assert scope.value(mbd.distance(post, ROD.start).gap(scope)) == pytest.approx([2.0])
    assert scope.value(mbd.separation(post, ROD.start, (-3, 0, 0)).gap(scope)) == pytest.approx([2.0])
    turning = mbd.separation(ROD.start, post, (1, 0, 0))
    assert scope.value(turning.gap(scope)) == pytest.approx([2.0 * math.cos(0.3)])


def test_a_planar_foot_has_one_tangent_and_no_anchor_in_z():
    scope = PlanarScope()
    assert len(FOOT.captured(scope)) == 2
    rows = FOOT.tangents(scope, [scope.tape.input("anchor", k) for k in range(2)])
    assert [part for part, _ in rows] == ["forward"]


def test_a_planar_foot_on_a_hill_has_one_tangent():
    scope = PlanarScope()
    rows = mbd.touchdown(ROD.end, lambda x: 0.1 * x * x).tangents(scope, [1.0, 0.1])
    assert [part for part, _ in rows] == ["forward"]


def test_level_ground_costs_no_more_than_a_height():
    scope = rod_at(0.3)
    assert FOOT.gap(scope) is mbd.height(ROD.end).gap(scope)


@pytest.mark.parametrize("ground", [lambda x: 0.5 * x * x, 0.5 * sympy.Symbol("x") ** 2], ids=["function", "sympy"])
def test_ground_may_be_a_function_or_an_expression(ground):
    scope = rod_at(0.3)
    x, y = 0.5 * math.sin(0.3), -0.5 * math.cos(0.3)
    assert scope.value(mbd.touchdown(ROD.end, ground).gap(scope)) == pytest.approx(
        [(y - 0.5 * x * x) / math.sqrt(1.0 + x * x)]
    )


def test_a_users_measure_of_names_frames_and_joints():
    scope = rod_at(0.3)
    both = mbd.measure(lambda angle, end: angle + end[1], HINGE, ROD.end)
    assert scope.value(both.gap(scope)) == pytest.approx([0.3 - 0.5 * math.cos(0.3)])
    angle = sympy.Symbol("angle")
    assert scope.value(mbd.measure(2 * angle, ("angle", "hinge.angle"), unit="rad").gap(scope)) == pytest.approx([0.6])


def test_a_bilateral_prescribes_a_motion():
    drive = mbd.Bilateral("drive", HINGE, value=lambda t: 2.0 * t)
    scope = rod_at(0.3)
    scope.numbers[scope.time] = 0.1
    assert scope.value(drive.residual(scope)) == pytest.approx([0.1])
    assert drive.measure.unit == "rad"


def test_the_length_of_a_bilateral_rod_is_a_parameter():
    rod = mbd.Bilateral("rope", mbd.distance(GROUND.origin, ROD.end), value=0.4)
    scope = rod_at(0.3)
    assert scope.value(rod.residual(scope)) == pytest.approx([0.1])
    assert rod.parameters() == {"rope.value": 0.4} == {k: v for k, v in scope.recorded.items() if "rope" in k}
    assert rod.measure.reaction == "tension"


def test_a_foot_sticks_unless_told_to_slide():
    assert mbd.Unilateral("foot", FOOT).sticks
    assert not mbd.Unilateral("foot", FOOT, friction=0).sticks
    assert not mbd.Unilateral("knee lock", mbd.flexion(HINGE)).sticks


def test_release_rules():
    foot = mbd.Unilateral("foot", FOOT, release=mbd.When("other foot"), only_while="knee lock")
    assert foot.opens_on == "when"
    assert foot.releases == (mbd.When("other foot", after_impact=False),)
    assert foot.others == ("other foot", "knee lock")
    several = mbd.Unilateral("foot", FOOT, release=[mbd.When("a"), mbd.When("b", after_impact=True)])
    assert several.others == ("a", "b")
    assert mbd.Unilateral("foot", FOOT).opens_on == "pull"
    assert mbd.Unilateral("foot", FOOT, only_while=mbd.extension(HINGE)).mentions() == [ROD.end, HINGE]


def test_a_penalty_pushes_while_it_is_pressed():
    stop = mbd.Penalty("stop", mbd.flexion(HINGE), stiffness=100.0, damping=2.0)
    scope = FreeScope()
    assert scope.value(stop.force(-0.1, -3.0, scope)) == pytest.approx([16.0])
    assert stop.parameters() == scope.recorded


def test_a_hertzian_penalty_does_not_fail_just_outside():
    stop = mbd.Penalty("stop", mbd.flexion(HINGE), stiffness=100.0, exponent=1.5)
    scope = FreeScope()
    gap = scope.tape.input("q", 0)
    force = stop.force(gap, 0.0, scope)
    assert scope.value(force, given={gap: -0.04}) == pytest.approx([0.8])
    assert scope.value(force, given={gap: 1e-9}) == [0.0]


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: mbd.touchdown(ROD), "must be a frame"),
        (lambda: mbd.touchdown(ROD.end, ground=3.0), "height function"),
        (lambda: mbd.flexion(ROD), "must be a joint"),
        (lambda: mbd.separation(ROD.end, ROD.start, (0, 0, 0)), "must not be zero"),
        (lambda: mbd.Plane((0, 0, 0)), "must not be zero"),
        (lambda: mbd.measure(lambda: 1.0), "what the function depends on"),
        (lambda: mbd.measure("hinge.angle", "t"), "takes no arguments"),
        (lambda: mbd.measure(abs, "t", unit="kg"), "'m' or 'rad'"),
        (lambda: mbd.measure(abs, ("k", 3.0)), "belongs into the function"),
        (lambda: mbd.Bilateral("b", ROD.end), "needs a joint or a measure"),
        (lambda: mbd.Bilateral("b", mbd.Planar("p", GROUND.origin, ROD.start)), "one coordinate"),
        (lambda: mbd.Unilateral("foot", HINGE), "needs a measure"),
        (lambda: mbd.Unilateral("foot", FOOT, release="other foot"), "mbd.When"),
        (lambda: mbd.Unilateral("foot", FOOT, only_while=3.0), "name of a contact"),
        (lambda: mbd.Unilateral("foot", FOOT, friction=math.nan), "must be finite"),
        (lambda: mbd.Penalty("stop", FOOT, stiffness=1.0, release="never"), "'gap' or 'pull'"),
        (lambda: mbd.Penalty("stop", FOOT, stiffness="hard"), "must be a number"),
        (lambda: mbd.When(3), "name of another contact"),
        (lambda: mbd.Event("fall", HINGE), "is a measure, the name of a quantity"),
        (lambda: mbd.Event("fall", FOOT, direction=2), "-1, 0 or 1"),
        (lambda: mbd.Event("fall", FOOT, reset=3.0), "maps names to values"),
        (lambda: mbd.Controller("knee", None, period=0.01), "update"),
        (lambda: mbd.Controller("knee", max), "never called"),
        (lambda: mbd.Controller("knee", max, period=0.0), "must be positive"),
    ],
)
def test_wrong_constraints_are_refused_in_words(make, told):
    with pytest.raises(ModelError, match=told):
        make()


def test_friction_without_a_direction_to_slide_in_is_a_fault():
    (fault,) = mbd.Unilateral("foot", mbd.height(FOOT.point), friction=0.5).faults()
    assert "no direction to slide in" in fault and "touchdown" in fault


def test_impossible_constraints_tell_why():
    bad = mbd.Unilateral("foot", FOOT, restitution=1.5, friction=-0.1, release=mbd.When("foot"), only_while="foot")
    text = " ".join(bad.faults())
    assert "restitution 1.5" in text
    assert "friction -0.1" in text
    assert "release=When('foot') names itself" in text
    assert "only_while='foot' names itself" in text
    stop = mbd.Penalty("stop", FOOT, stiffness=-1.0, damping=-1.0, exponent=0.5)
    assert len(stop.faults()) == 3
    assert "never move apart" in mbd.Bilateral("b", mbd.distance(ROD.start, ROD.end)).faults()[0]


def test_constraints_are_values():
    foot = mbd.Unilateral("foot", FOOT, release=mbd.When("other"))
    assert pickle.loads(pickle.dumps(foot)) == foot
    assert {foot, mbd.Event("fall", FOOT, reset={"hinge.rate": 0.0}), mbd.Controller("c", max, period=1.0, state={})}
