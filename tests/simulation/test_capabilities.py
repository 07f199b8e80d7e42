"""Every supported pair of law, scheme and strategy runs and agrees with the reference; every other one is refused."""

from functools import lru_cache
from pathlib import Path

import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.simulation.capabilities import LAWS, SCHEMES, STRATEGIES, as_markdown, as_text, refusals, supports
from tests.integrators.own import ProjectedMidpoint
from tests.simulation.capability_scenes import SCENES

PAGE = Path(__file__).resolve().parents[2] / "docs" / "integration.md"

LAW_OF = {
    "tree": None, "rows on positions": "rows on positions", "rows on velocities": "rows on velocities",
    "rolling": "rows on velocities", "sticking contact": "Unilateral", "frictionless contact": "Unilateral",
    "restitution": "Unilateral", "friction μ": "friction=μ", "release=When": "release=When", "penalty": "Penalty",
    "penalty with restitution": "Penalty", "dry joint": "dry friction of joints",
    "pin friction": "dry friction of joints", "event": "Event", "controller": "Controller",
}  # fmt: skip
"""The law that each scene is about."""

COMPILED = [(name, scheme) for name, schemes in SCHEMES.items() for scheme in schemes if "averaged" not in name]
INTERPRETED = [("HHT averaged", mbd.HHT(0.05, form="averaged")), ("own", ProjectedMidpoint())]
DT = 2e-3


@lru_cache
def scene(name):
    """A scene of its own name, with the reference: a fine run."""
    model, start, until, quantity = SCENES[name]()
    fine = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.8), dt=5e-5, until=until)
    return model, start, until, quantity, fine[quantity][-1]


def told(name, scheme, **options):
    """What is refused of a scene."""
    model = scene(name)[0]
    return refusals(mechanism_of(model).equations, scheme, options)


def check(name, scheme, dt=DT, **options):
    """A run agrees at order dt, or is refused with both parts and something else to use."""
    model, start, until, quantity, expected = scene(name)
    if told(name, scheme, **options):
        with pytest.raises(mbd.CapabilityError, match=r"; (in space )?use ") as caught:
            mbd.simulate(model, start, scheme, dt=dt, until=until, **options)
        assert all(fault.count("'") >= 2 for fault in caught.value.faults), caught.value
        return
    run = mbd.simulate(model, start, scheme, dt=dt, until=until, **options)
    assert run.success
    assert abs(run[quantity][-1] - expected) < 5.0 * dt


def test_every_law_of_the_table_has_a_scene():
    assert {law for law in LAW_OF.values() if law} == {law.title for law in LAWS}
    assert set(LAW_OF) == set(SCENES)
    for name, title in LAW_OF.items():
        model = scene(name)[0]
        present = {law.title for law in LAWS if law.parts(model, mechanism_of(model).equations)}
        assert title is None or title in present, name


@pytest.mark.parametrize("name", SCENES)
def test_every_scheme_runs_with_every_law_or_is_refused(name):
    for _, scheme in COMPILED:
        check(name, scheme)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", SCENES)
def test_interpreted_schemes_run_with_every_law(name):
    for _, scheme in INTERPRETED:
        check(name, scheme, dt=4e-3)


@pytest.mark.parametrize("name", SCENES)
def test_every_strategy_runs_with_every_law_or_is_refused(name):
    for options in STRATEGIES:
        for scheme in (mbd.HHT(0.05), mbd.GeneralizedAlpha(0.5, formulation="index3"), mbd.RadauIIA()):
            check(name, scheme, **options)
    for impact in ("poisson", "sequential"):
        check(name, mbd.GeneralizedAlpha(0.9), contact="nonsmooth", impact=impact)


@pytest.mark.parametrize("name", ["sticking contact", "friction μ", "restitution"])
def test_non_smooth_steps_run_with_interpreted_schemes(name):
    for _, scheme in INTERPRETED:
        check(name, scheme, dt=4e-3, contact="nonsmooth")


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", SCENES)
def test_the_plain_twin_runs_with_every_law(name):
    check(name, mbd.HHT(0.05), dt=5e-3, backend="python")


def test_what_the_table_says_is_what_is_refused():
    for name, title in LAW_OF.items():
        for law in (law for law in LAWS if law.title == title):
            for _, scheme in COMPILED:
                assert supports(law, scheme) or told(name, scheme), (name, scheme)
        assert not any(told(name, mbd.HHT(), **options) for options in STRATEGIES), name


def test_an_integrator_of_ones_own_says_what_it_cannot_keep_and_the_rows_are_named():
    class Explicit(ProjectedMidpoint):
        def check(self, rows):
            return "Explicit cannot keep rows; use mbd.HHT()" if rows else None

    model, start, *_ = scene("rows on positions")
    with pytest.raises(mbd.CapabilityError, match=r"Explicit cannot keep rows; use .*'rod'"):
        mbd.simulate(model, start, Explicit(), dt=1e-3, until=1.0)


def test_arguments_that_exclude_each_other_are_refused():
    model, start, *_ = scene("restitution")
    with pytest.raises(mbd.CapabilityError, match=r"contact='nonsmooth' .*locate='linear'.*use locate='root'"):
        mbd.simulate(model, start, dt=1e-3, until=0.1, contact="nonsmooth", locate="linear")


def in_space():
    model, bar = mbd.Model("in space"), mbd.RigidBody("bar", 1.0, (1.0, 1.0, 1.0))
    model.connect(mbd.Revolute("hinge", model.ground.origin, bar.origin, axis=(1.0, 1.0, 0.0)))
    return model, bar


def test_many_contacts_that_are_to_be_located_roughly_are_located():
    model = mbd.Model("many")
    for k in range(17):
        ball = mbd.PointMass(f"ball {k}", 1.0)
        model.connect(mbd.Prismatic(f"slide {k}", model.ground.origin, ball.origin, axis=(0, 1, 0)))
        model.constrain(mbd.Unilateral(f"floor {k}", mbd.height(ball.origin)))
    start = mbd.assemble(model, position={f"slide {k}.displacement": 1.0 for k in range(17)})
    chosen = {locate: mbd.simulate(model, start, dt=1e-2, until=0.02, locate=locate) for locate in ("root", "linear")}
    assert {locate: run.settings["contact"] for locate, run in chosen.items()} == {
        "root": "events", "linear": "events",
    }  # fmt: skip
    assert "locate='linear'" in chosen["linear"].settings["contact_reason"]


def test_what_only_planar_models_have_is_refused_in_space():
    rolls, wheel = in_space()
    rolls.constrain(mbd.Rolling("tyre", wheel.origin, 0.3))
    with pytest.raises(mbd.CapabilityError, match="'tyre'.*planar.*Nonholonomic"):
        mbd.assemble(rolls)


def test_a_reset_happens_once_where_events_are_located_roughly():
    model, start, until, *_ = scene("event")
    for scheme in (mbd.HHT(), ProjectedMidpoint()):
        run = mbd.simulate(model, start, scheme, dt=4e-3, until=until, locate="linear")
        assert [event.name for event in run.events] == ["push"]


def test_the_page_has_the_table():
    assert as_markdown() in PAGE.read_text(encoding="utf-8"), (
        "docs/integration.md has another table of what goes with what: put this in its place\n" + as_markdown()
    )


def test_the_table_is_told_by_info(capsys):
    from mbd.cli import main

    assert main(["info"]) == 0
    assert as_text().split() == capsys.readouterr().out.split()[-len(as_text().split()) :]
