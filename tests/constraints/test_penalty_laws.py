"""Force laws of contact: what they give back of the approach speed, and that they neither pull nor feed energy in."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

import mbd
from mbd.constraints.restitution import CLASSICS, chi_for, damping_ratio_for, restitution_of_chi, restitution_of_ratio
from mbd.errors import ModelError
from tests.helpers import SECOND_ORDER, halved
from tests.problems import case

SCHEMES = [mbd.Newmark(), mbd.HHT(), mbd.GeneralizedAlpha(0.9)]
PUBLISHED = {"hunt-crossley": 0.663, "lankarani-nikravesh": 0.725, "flores": 0.470, "gonthier": 0.488}
"""What the classics give where 0.5 is asked."""
POINT = mbd.height(mbd.PointMass("ball", mass=1.0).origin)


def ball(gravity: float = 0.0, mass: float = 2.0, **law) -> mbd.Model:
    """A ball over the mat 'mat', at 'fall.displacement'."""
    model = mbd.Model("ball", gravity=(0.0, -gravity, 0.0))
    body = mbd.PointMass("ball", mass=mass)
    model.connect(mbd.Prismatic("fall", model.ground.origin, body.origin, axis=(0, 1, 0)))
    model.constrain(mbd.Penalty("mat", mbd.height(body.origin), **law))
    return model


def thrown(model: mbd.Model, speed: float, dt: float, until: float, scheme=SCHEMES[0], **options) -> mbd.Trajectory:
    """The ball thrown down from a little above the mat, a third of a step off the grid."""
    start = mbd.assemble(
        model,
        position={"fall.displacement": 2.3 * dt * speed},
        velocity={"fall.displacement": -speed},
        **{name: options.pop(name) for name in ("parameters",) if name in options},
    )
    return mbd.simulate(model, start, scheme, dt=dt, until=until, **options)


def energy_of(run: mbd.Trajectory) -> np.ndarray:
    return run.energy["kinetic"] + run.energy["potential"]


# restitution --------------------------------------------------------------------------------------------------------
@given(restitution=st.floats(0.05, 1.0))
def test_the_exact_chi_solves_its_equation(restitution):
    chi = chi_for(restitution)
    assert 0.0 <= chi * restitution < 1.0
    assert restitution_of_chi(chi) == pytest.approx(restitution, rel=1e-12)
    u = -math.log1p(-restitution * chi)
    assert (1 + restitution) * chi == pytest.approx(math.log1p(chi) + u, rel=1e-7, abs=1e-15)


def test_the_exact_chi_of_a_nearly_elastic_blow_is_that_of_hunt_and_crossley():
    for loss in (1e-4, 1e-8, 1e-12):
        assert chi_for(1.0 - loss) == pytest.approx(1.5 * loss, rel=max(2 * loss, 1e-3))
    assert chi_for(1.0) == 0.0


@pytest.mark.parametrize("law", PUBLISHED)
def test_the_classics_give_what_is_known_of_them(law):
    assert restitution_of_chi(chi_for(0.5, law)) == pytest.approx(PUBLISHED[law], abs=5e-4)


@pytest.mark.parametrize(
    ("restitution", "stiffness", "mass", "exponent", "speed"),
    [
        (0.05, 1e5, 2.0, 1.5, 1.0),
        (0.3, 1e9, 0.1, 1.5, 0.2),
        (0.5, 1e5, 2.0, 1.0, 1.0),
        (0.5, 3e6, 40.0, 1.5, 3.0),
        (0.5, 1e7, 2.0, 2.0, 1.0),
        (0.7, 1e4, 0.5, 1.0, 5.0),
        (0.9, 1e8, 1.0, 3.0, 1.0),
        (1.0, 1e6, 1.0, 1.5, 1.0),
    ],
)
def test_a_ball_rebounds_with_the_restitution_asked_for(restitution, stiffness, mass, exponent, speed):
    model = ball(mass=mass, stiffness=stiffness, exponent=exponent, restitution=restitution)
    stiff = mbd.penalty_parameters(restitution, 1.0, mass, speed, exponent)  # as soft as for 1 m; k scales the rest
    depth = (stiff.stiffness / stiffness) ** (1.0 / (exponent + 1.0))
    advice = mbd.penalty_parameters(restitution, depth, mass, speed, exponent)
    assert advice.stiffness == pytest.approx(stiffness)
    run = thrown(model, speed, dt=advice.largest_dt / 8.0, until=1.5 * advice.duration)
    assert [event.kind for event in run.events] == ["closed", "opened"]
    assert run["fall.rate"][-1] / speed == pytest.approx(restitution, abs=1e-3)
    assert -run["fall.displacement"].min() == pytest.approx(depth, rel=5e-3)
    assert run.events[1].time - run.events[0].time == pytest.approx(advice.duration, rel=1e-2)


@pytest.mark.parametrize("law", PUBLISHED)
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_a_ball_rebounds_with_what_a_published_law_really_gives(law, exponent):
    advice = mbd.penalty_parameters(0.5, 1e-3, 2.0, 1.0, exponent, law=law)
    model = ball(stiffness=advice.stiffness, exponent=exponent, restitution=0.5, law=law)
    run = thrown(model, 1.0, dt=advice.largest_dt / 8.0, until=1.5 * advice.duration)
    assert run["fall.rate"][-1] == pytest.approx(PUBLISHED[law], abs=1.5e-3)
    assert run["fall.rate"][-1] == pytest.approx(advice.restitution, abs=1e-3)


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda scheme: type(scheme).__name__)
def test_the_restitution_is_reached_to_second_order(scheme):
    advice = mbd.penalty_parameters(0.5, 1e-3, 2.0, 1.0, 1.5)
    model = ball(stiffness=advice.stiffness, exponent=1.5, restitution=0.5)

    def error(dt: float) -> float:
        return float(thrown(model, 1.0, dt, 1.5 * advice.duration, scheme)["fall.rate"][-1] - 0.5)

    falls = halved(error, advice.largest_dt / 2.0)[:, 0]
    assert np.all((falls[:-1] / falls[1:] > SECOND_ORDER[0] - 0.3) & (falls[:-1] / falls[1:] < SECOND_ORDER[1] + 0.3))


@pytest.mark.parametrize("release", ["gap", "pull"])
@pytest.mark.parametrize("restitution", [0.05, 0.1353352832366127, 0.5, 0.95])
def test_kelvin_voigt_gives_the_restitution_asked_for(release, restitution):
    advice = mbd.penalty_parameters(restitution, 1e-3, 2.0, 1.0, law="kelvin-voigt", release=release)
    law = {"stiffness": advice.stiffness, "release": release}
    for more in {"damping": advice.damping}, {"restitution": restitution, "law": "kelvin-voigt", "effective_mass": 2.0}:
        model = ball(**law, **more)
        run = thrown(model, 1.0, dt=advice.largest_dt / 12.0, until=1.5 * advice.duration)
        assert run["fall.rate"][-1] == pytest.approx(restitution, abs=1e-3)
        assert -run["fall.displacement"].min() == pytest.approx(1e-3, rel=5e-3)
        assert run.events[1].time - run.events[0].time == pytest.approx(advice.duration, rel=5e-3)


def test_the_damping_ratios_are_those_in_closed_form():
    assert damping_ratio_for(0.5, "gap") == pytest.approx(math.log(2) / math.hypot(math.pi, math.log(2)), rel=1e-14)
    assert damping_ratio_for(math.exp(-2.0), "pull") == pytest.approx(1.0, rel=1e-12)
    for ratio in (0.0, 0.3, 0.99999, 1.00001, 2.0):
        e = restitution_of_ratio(ratio, "pull")
        assert damping_ratio_for(e, "pull") == pytest.approx(ratio, abs=1e-9)
    wide = 2.0 * 2.0 * math.acosh(2.0) / math.sqrt(3.0)
    assert restitution_of_ratio(2.0, "pull") == pytest.approx(math.exp(-wide), rel=1e-14)


# force and energy ---------------------------------------------------------------------------------------------------
@given(
    gap=st.floats(-1.0, 0.5), rate=st.floats(-50.0, 50.0), approach=st.floats(0.0, 10.0),
    exponent=st.sampled_from([1.0, 1.5, 2.0, 3.0]), restitution=st.floats(0.05, 1.0),
    law=st.sampled_from([None, *CLASSICS]),
)  # fmt: skip
def test_the_force_never_attracts_and_loses_energy_both_ways(gap, rate, approach, exponent, restitution, law):
    from tests.helpers import FreeScope

    mat = mbd.Penalty("mat", POINT, 1e3, exponent=exponent, restitution=restitution, law=law)
    scope = FreeScope()
    force, elastic = scope.value(mat.force(gap, rate, scope, approach), mat.force(gap, 0.0, scope, approach))
    assert force >= 0.0
    assert elastic == pytest.approx(1e3 * max(-gap, 0.0) ** exponent)
    assert (force - elastic) * -rate >= -1e-12 * abs(elastic * rate)  # what it adds to the spring opposes the motion


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("release", ["gap", "pull"])
@pytest.mark.parametrize("damping", [0.0, 30.0])
def test_a_spring_with_a_damper_opens_by_its_rule_for_every_exponent(exponent, release, damping):
    model = ball(stiffness=1e5, damping=damping, exponent=exponent, release=release)
    run = thrown(model, 1.0, dt=1e-4, until=0.5)
    assert [event.kind for event in run.events] == ["closed", "opened"]
    assert 0.0 < run["fall.rate"][-1] <= 1.0 + 1e-3
    least = run["mat.force"].min()
    assert least < -1.0 if release == "gap" and damping else least > -1e-6


@pytest.mark.covering
@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda scheme: type(scheme).__name__)
@pytest.mark.parametrize("law", [None, *CLASSICS])
def test_a_bouncing_ball_never_gains_energy_and_comes_to_rest(law, scheme):
    advice = mbd.penalty_parameters(0.5, 2e-3, 2.0, 2.0, 1.5, law=law)
    model = ball(gravity=9.81, stiffness=advice.stiffness, exponent=1.5, restitution=0.5, law=law)
    start = mbd.assemble(model, position={"fall.displacement": 0.05})
    run = mbd.simulate(model, start, scheme, dt=advice.largest_dt / 4.0, until=0.9)
    force, total = run["mat.force"], energy_of(run)
    stored = np.where(run["mat.gap"] < 0.0, advice.stiffness * np.maximum(-run["mat.gap"], 0.0) ** 2.5 / 2.5, 0.0)
    assert force.min() >= 0.0
    assert np.max(np.diff(total + stored)) < 2e-3 * total[0]
    assert force[-1] == pytest.approx(2.0 * 9.81, rel=1e-3)
    assert run["fall.rate"][-1] == pytest.approx(0.0, abs=1e-3)


def test_each_blow_remembers_its_own_approach_speed():
    model = ball(gravity=0.3, stiffness=1e7, exponent=1.5, restitution=0.6)
    model.constrain(mbd.Penalty("lid", mbd.measure(lambda y: 0.01 - y, "fall.displacement"), 1e7, 0, 1.5, 0.6))
    start = mbd.assemble(model, position={"fall.displacement": 1e-3}, velocity={"fall.rate": -2.0})
    run = mbd.simulate(model, start, dt=1e-5, until=0.07)
    speeds = [abs(float(run.at([event.time], side="left")["fall.rate"][0])) for event in run.events]
    ratios = [after / before for before, after in zip(speeds[::2], speeds[1::2], strict=False)]
    assert len(ratios) >= 3
    assert len({round(speed, 1) for speed in speeds}) == len(ratios) + 1
    np.testing.assert_allclose(ratios, 0.6, atol=3e-3)


def test_a_start_inside_the_mat_takes_its_speed_there_as_the_approach_speed():
    model = ball(stiffness=1e5, restitution=0.5)
    start = mbd.assemble(model, position={"fall.displacement": -1e-3}, velocity={"fall.rate": -0.7}, closed="mat")
    np.testing.assert_array_equal(start.anchors, [0.7])


def test_stiffness_damping_and_chi_are_inputs_of_a_run():
    model = ball(stiffness=1e5, restitution=0.5)
    assert set(model.constraints[0].parameters()) == {"mat.stiffness", "mat.chi", "mat.slowest"}
    changed = {"mat.stiffness": 4e5, "mat.chi": chi_for(0.8)}
    run = thrown(model, 1.0, dt=5e-5, until=0.05, parameters=changed)
    assert run["fall.rate"][-1] == pytest.approx(0.8, abs=1e-3)


# limits -------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_with_growing_stiffness_a_penalty_becomes_a_unilateral_contact(exponent):
    """What other forces do during the impact, and its duration, vanish with it."""

    def rebound(contact: type, dt: float, **law) -> list[float]:
        model = mbd.Model("ball")
        body = mbd.PointMass("ball", mass=2.0)
        model.connect(mbd.Prismatic("fall", model.ground.origin, body.origin, axis=(0, 1, 0)))
        model.constrain(contact("mat", mbd.height(body.origin), restitution=0.5, **law))
        run = mbd.simulate(model, mbd.assemble(model, position={"fall.displacement": 0.2}), dt=dt, until=0.26)
        return [run["fall.displacement"][-1], run["fall.rate"][-1]]

    hard = np.array(rebound(mbd.Unilateral, 1e-3))
    depths = 4e-3 / 4.0 ** np.arange(3)
    errors = []
    for depth in depths:
        advice = mbd.penalty_parameters(0.5, depth, 2.0, math.sqrt(2 * 9.81 * 0.2), exponent)
        soft = rebound(mbd.Penalty, advice.largest_dt / 10, stiffness=advice.stiffness, exponent=exponent)
        errors.append(np.abs(soft - hard))
    falls = np.array(errors)[:-1] / np.array(errors)[1:]
    assert np.all((falls > 3.5) & (falls < 5.0)), errors
    assert np.all(errors[-1] < 5e-3)


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_ten_giganewtons_per_metre_run_with_the_advised_step(exponent):
    restitution, speed, mass = 0.5, 1.0, 1.0
    soft = mbd.penalty_parameters(restitution, 1.0, mass, speed, exponent)
    advice = mbd.penalty_parameters(
        restitution, (soft.stiffness / 1e10) ** (1.0 / (exponent + 1.0)), mass, speed, exponent
    )
    assert advice.stiffness == pytest.approx(1e10)
    model = ball(mass=mass, gravity=9.81, stiffness=1e10, exponent=exponent, restitution=restitution)
    run = thrown(model, speed, advice.largest_dt, until=3 * advice.duration)
    assert run["fall.rate"][-1] == pytest.approx(restitution, abs=0.02)
    assert run.stats["notes"] == []


def test_the_step_advised_is_a_tenth_of_a_blow_without_loss():
    for exponent in (1.0, 1.5, 3.0):
        advice = mbd.penalty_parameters(1.0, 1e-3, 2.0, 1.0, exponent)
        assert advice.largest_dt == pytest.approx(advice.duration / 10.0, rel=1e-4)
        assert advice.stiffness == pytest.approx((exponent + 1.0) * 2.0 / 2.0 / 1e-3 ** (exponent + 1.0))
    spring = mbd.penalty_parameters(1.0, 1e-3, 2.0, 1.0, law="kelvin-voigt")
    assert spring.duration == pytest.approx(math.pi * math.sqrt(2.0 / spring.stiffness))
    hertz = mbd.penalty_parameters(1.0, 1e-3, 2.0, 1.0, 1.5)  # Landau & Lifshitz, Theory of Elasticity, §9, problem
    assert hertz.duration == pytest.approx(2.0 * 1e-3 * 1.4716370, rel=1e-5)


# the stiff case -----------------------------------------------------------------------------------------------------
J6 = case("j6-stiff-penalty-1e9")


def dropped(scheme, dt: float) -> mbd.Trajectory:
    """The ball of the case from just above the mat, as fast as its fall makes it, until it is up there again."""
    given = J6.definition
    model = ball(gravity=given["g"], mass=given["m"], stiffness=given["k"], damping=given["c"])
    height = min(given["drop"], 2.3 * dt)
    speed = math.sqrt(2.0 * given["g"] * (given["drop"] - height))
    start = mbd.assemble(model, position={"fall.displacement": height}, velocity={"fall.displacement": -speed})
    return mbd.simulate(model, start, scheme, dt=dt, until=12 * dt + 3e-4)


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda scheme: type(scheme).__name__)
@pytest.mark.parametrize("factor", [0.15, 1.1, 3.0, 10.0, 100.0])
def test_a_step_longer_than_the_blow_is_told_and_gives_way_to_shorter_ones(scheme, factor):
    run = dropped(scheme, factor * J6["contact duration"].value)
    total = energy_of(run)
    (note,) = run.stats["notes"]
    assert note.startswith("'mat' took steps of down to")
    assert run["mat.force"].max() == pytest.approx(J6["peak contact force"].value, rel=0.02)
    assert total[0] * 0.98 < total[-1] <= total[0] * (1.0 + 1e-3)
    assert abs(run.energy["numerical"][-1]) < 0.01 * total[0]


# what is refused ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"restitution": 0.5, "damping": 3.0}, "damping 3 and restitution 0.5"),
        ({"law": "flores"}, "law='flores'.*restitution"),
        ({"restitution": 0.5, "law": "florez"}, "did you mean 'flores'"),
        ({"restitution": 0.5, "law": "kelvin-voigt"}, "law='kelvin-voigt'.*effective_mass"),
        ({"restitution": 0.5, "law": "kelvin-voigt", "effective_mass": -1.0}, "law='kelvin-voigt'.*effective_mass"),
        (
            {"restitution": 0.5, "law": "kelvin-voigt", "effective_mass": 1.0, "exponent": 1.5},
            "law='kelvin-voigt'.*exponent 1.5",
        ),
        ({"effective_mass": 1.0}, "effective_mass.*restitution"),
        ({"restitution": 0.5, "effective_mass": 1.0}, "effective_mass.*law=None"),
        ({"restitution": 0.02}, "mbd.Unilateral"),
        ({"restitution": 0.0, "law": "hunt-crossley"}, "mbd.Unilateral"),
        ({"restitution": 1.5}, "between 0 and 1"),
        ({"restitution": "half"}, "must be a number"),
    ],
)
def test_contradictions_are_told_with_both_names(given, told):
    with pytest.raises(ModelError, match=told):
        mbd.Penalty("mat", POINT, 1e5, **given)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"penetration": 0.0}, "penetration 0 must be positive"),
        ({"approach_speed": -1.0}, "approach_speed -1 must be positive"),
        ({"restitution": 0.01}, "mbd.Unilateral"),
        ({"exponent": 0.5}, "exponent 0.5"),
        ({"law": "hertz"}, "no penalty law named 'hertz'"),
        ({"law": "kelvin-voigt", "exponent": 1.5}, "law='kelvin-voigt'.*exponent"),
        ({"release": "never"}, "'gap' or 'pull'"),
    ],
)
def test_parameters_of_no_blow_are_refused(given, told):
    impact = {"restitution": 0.5, "penetration": 1e-3, "effective_mass": 2.0, "approach_speed": 1.0}
    with pytest.raises(ModelError, match=told):
        mbd.penalty_parameters(**{**impact, **given})


def test_a_description_tells_the_loss():
    assert "stiffness 100000, chi 1.43275" in ball(stiffness=1e5, restitution=0.5).describe()
    assert "stiffness 100000, damping 20" in ball(stiffness=1e5, damping=20.0).describe()
