"""The energy ledger never shows that a passive element gave energy: losses, dampers, friction, stops, impacts."""

from __future__ import annotations

import functools
import random
from dataclasses import dataclass

import numpy as np
import pytest

import mbd
from mbd.errors import MbdError
from mbd.hardcases.schemes import SCHEMES
from mbd.results.ledger import SPENT, Ledger
from mbd.testing.mechanisms import random_scene
from tests.helpers import one_body


def gains(ledger: Ledger) -> dict[str, float]:
    """What passive parts seem to give, over the largest energy: more than before, or more than at the start."""
    size = float(np.max(np.abs(ledger.kinetic) + np.abs(ledger.potential), initial=1e-300))
    found = {}
    for part in ledger.parts:
        if part.kind in SPENT and not part.withheld:
            before = np.minimum.accumulate(part.energy) if part.kind != "penalty" else part.energy[:1]
            found[part.name] = float(np.max(part.energy - before)) / size
    return found


@functools.cache
def falling(**law) -> mbd.Model:
    """A ball of 1 kg above a stop of 2e4 N/m, on which it would lie for 20 ms."""
    model, body = one_body(mbd.PointMass("ball", mass=1.0), mbd.Prismatic, "fall", axis=(0, 1, 0))
    model.constrain(mbd.Penalty("stop", mbd.height(body.origin), stiffness=2e4, **law))
    return model


def ball(dt: float, scheme: mbd.Integrator, **law) -> mbd.Trajectory:
    """The ball falls by 0.7 m."""
    model = falling(**law)
    start = mbd.assemble(model, position={"fall.displacement": 0.7})
    return mbd.simulate(model, start, scheme, dt=dt, until=1.0, on_failure="return")


@pytest.mark.covering
@pytest.mark.parametrize("name", SCHEMES)
@pytest.mark.parametrize("law", [{}, {"damping": 5.0}, {"damping": 20.0, "release": "pull"}, {"restitution": 0.7},
                                 {"exponent": 1.5}, {"exponent": 2.0, "release": "pull"}])  # fmt: skip
def test_a_stop_that_lasts_for_a_step_or_two_gives_no_energy(law, name):
    for dt in (2.1e-2, 1.3e-2, 7e-3):
        ledger = ball(dt, SCHEMES[name](), **law).energy
        assert all(gain < 1e-12 for gain in gains(ledger).values()), dt
        change = sum(part.energy for part in ledger.parts) + ledger.numerical
        np.testing.assert_allclose(ledger.total - ledger.total[0], change, atol=1e-11)


@pytest.mark.parametrize("law", [{}, {"damping": 5.0}, {"restitution": 0.7}, {"exponent": 1.5}])
def test_resolved_blows_take_what_the_ball_has_lost(law):
    run = ball(2e-4, mbd.RungeKutta853(), **law)
    smooth = "restitution" not in law and "exponent" not in law  # others bend at touch, which costs steps their order
    assert abs(run.energy.numerical).max() < (1e-8 if smooth else 5e-6)
    if not law:
        closed = run.record.closed[:, 0].astype(bool)
        np.testing.assert_allclose(run.energy["stop"], -1e4 * np.where(closed, run["stop.gap"], 0.0) ** 2, atol=1e-12)


@pytest.mark.sampled(4)
@pytest.mark.parametrize("seed", range(24))
def test_no_passive_part_of_a_random_scene_gains(seed):
    """Losses, dry friction, stops, bumpers, feet, at steps from fine to far too long."""
    rng = random.Random(seed)
    model = random_scene(seed, 2)
    scheme = SCHEMES[list(SCHEMES)[seed % len(SCHEMES)]]()
    start = mbd.assemble(model, velocity={c: rng.uniform(-2, 2) for c in _rates(model)})
    try:
        run = mbd.simulate(model, start, scheme, dt=rng.choice([2e-3, 1e-2, 3e-2]), until=1.0, on_failure="return")
    except MbdError:
        pytest.skip("the scene asks for what the scheme refuses")
    found = gains(run.energy)
    assert found and all(gain < 1e-11 for gain in found.values()), found


def _rates(model: mbd.Model) -> list[str]:
    return [f"{joint.name}.{label.name}" for joint in model.joints for label in joint.labels]


def test_a_row_of_balls_books_its_impacts_together_where_one_would_seem_to_give():
    model = mbd.Model("cradle", gravity=(0, 0, 0))
    for k in range(3):
        model.connect(mbd.Prismatic(f"p{k}", model.ground.origin, mbd.PointMass(f"ball {k}", mass=1.0).origin))
    for k in range(2):
        apart = mbd.measure(lambda a, b: b - a - 0.1, f"p{k}.displacement", f"p{k + 1}.displacement")
        model.constrain(mbd.Unilateral(f"c{k}", apart, restitution=0.8))
    position = {"p0.displacement": -0.5, "p1.displacement": 0.1, "p2.displacement": 0.2}
    start = mbd.assemble(model, position=position, velocity={"p0.displacement": 1.0})
    run = mbd.simulate(model, start, dt=1e-2, until=1.0, impact="sequential")
    assert min(event.energy_loss for event in run.events) < -0.01
    (part,) = run.energy.of("impact")
    assert part.name == "c0 and c1 impact"
    assert -part.energy[-1] == pytest.approx(sum(event.energy_loss for event in run.events))
    assert all(gain <= 1e-12 for gain in gains(run.energy).values())


@dataclass(frozen=True)
class Rubber(mbd.Penalty):
    """A law of a user's own, that does not tell what it can give back."""

    def force(self, gap, gap_rate, scope, approach=1.0):
        return scope.parameter(self.name, "stiffness", self.stiffness) * mbd.maximum(-gap, 0.0)


def bounced(dt: float, stiffness: float, store: int = 1) -> mbd.Trajectory:
    """A ball of 1 kg that falls 0.7 m onto rubber."""
    model, body = one_body(mbd.PointMass("ball", mass=1.0), mbd.Prismatic, "fall", axis=(0, 1, 0))
    model.constrain(Rubber("stop", mbd.height(body.origin), stiffness=stiffness))
    start = mbd.assemble(model, position={"fall.displacement": 0.7})
    return mbd.simulate(model, start, mbd.RungeKutta853(), dt=dt, until=1.0, store=store, on_failure="return")


@pytest.mark.parametrize("store", [15, 20, 25])
def test_a_law_of_ones_own_is_withheld_where_rows_do_not_tell_its_work(tmp_path, store):
    """The impact lasts for 70 ms: seventy steps of 1 ms, of which a few are rows."""
    thinned, full = bounced(1e-3, 2e3, store), bounced(1e-3, 2e3)
    (part,) = thinned.energy.of("penalty")
    assert part.withheld and np.isnan(part.energy).all()
    assert "withheld" in repr(thinned.energy) and np.isfinite(thinned.energy.numerical).all()
    assert mbd.load(thinned.save(tmp_path / "run")).energy.parts[0].withheld == part.withheld
    (part,) = full.energy.of("penalty")
    assert not part.withheld and part.energy.max() < 1e-6


def test_a_law_of_ones_own_is_told_where_dt_alone_would_not_resolve_its_blow():
    """An impact of 22 ms at dt = 20 ms takes shorter steps of its own, each of which is a row."""
    ledger = bounced(2e-2, 2e4).energy
    (part,) = ledger.of("penalty")
    assert not part.withheld and gains(ledger)["stop"] < 1e-12
    assert part.energy.min() < -5.0 and abs(ledger.numerical).max() < 1e-10
