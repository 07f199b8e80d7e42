"""One run of each kind of word in three forms: interpreted, cut in two, and read from a file."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.integrators import Integrator
from tests.constraints import test_modes as modes, test_own_laws as own_laws, test_penalty_laws as penalties
from tests.constraints.test_nonholonomic import turning_tractor
from tests.constraints.test_round_on_surface import ball_on, waves
from tests.constraints.test_sampled_laws import arm
from tests.equations.mechanisms import four_bar
from tests.forces.test_held_forces import LAWS as LOADED, arm_on_a_hub, stands
from tests.simulation import (
    frictions,
    test_charts as charts,
    test_cones as cones,
    test_nonsmooth_cones as feet,
    test_redundant_friction as redundant,
    test_states_of_laws as states,
)
from tests.simulation.cut_runs import assert_halves_are_the_whole, at
from tests.simulation.mechanisms import ball, box
from tests.simulation.test_brief_crossings import thrown
from tests.simulation.test_singular_poses import passage
from tests.simulation.test_strike_impulses import wheel
from tests.test_saved_runs import same

TIGHT = 1e-13
HHT, RADAU, EXPLICIT = mbd.HHT(0.05, tolerance=TIGHT), mbd.RadauIIA(tolerance=TIGHT), mbd.RungeKutta853()
ALPHA = mbd.GeneralizedAlpha(0.8, tolerance=TIGHT)
BOTH = (HHT, EXPLICIT)
NONSMOOTH = {"contact": "nonsmooth"}


@dataclass(frozen=True)
class Scene:
    """A model and its start, the schemes of its run, dt and until, and how far iterates may leave the twins apart."""

    make: Callable[[], tuple[Any, mbd.State]]
    schemes: tuple[Integrator, ...]
    dt: float
    until: float
    how: dict[str, Any] = field(default_factory=dict)
    apart: float = 1.0


DROPPED = {"fall.displacement": 1.0}
THROWN = {"rail.displacement": np.sqrt(2.0 * 9.81 * 0.20001)}
TURNED = {"place.y": 0.3, "place.angle": 0.15}, {"place.x": 0.5, "place.y": -1.0, "place.angle": -0.7}
SPUN = {"float.x.rate": 0.8, "float.z.rate": -0.5, "float.angular_velocity": (0.6, 0.3, -0.9)}
LOADS = at(lambda: frictions.four_bar(mbd.PinFriction(0.3, 0.05)), {"pin 0.angle": 0.9}, {"pin 0.angle": 3.0})
DRY = at(lambda: frictions.four_bar(mbd.Coulomb(0.4)), {"pin 0.angle": 0.9}, {"pin 0.angle": 3.0})
SCENES = {
    "four-bar": Scene(at(four_bar), (HHT, RADAU, mbd.GeneralizedAlpha(0.5, formulation="index3")), 1e-3, 0.1, apart=10),
    "flat four-bar": Scene(lambda: passage("one four-bar")[0].start, (HHT, mbd.Newmark(), RADAU), 5e-3, 0.8, apart=1e3),
    "flat slider-crank": Scene(lambda: passage("slider-crank")[0].start, (HHT,), 5e-3, 0.8, apart=1e3),
    "flat pose, velocities": Scene(lambda: passage("row on velocities")[0].start, (HHT,), 5e-3, 0.8, apart=1e3),
    "flat pose, redundant": Scene(lambda: passage("three cranks, redundant")[0].start, (HHT,), 5e-3, 0.8, apart=1e3),
    "blades and a hitch": Scene(lambda: turning_tractor(["hitch"]), (HHT, RADAU, EXPLICIT), 5e-3, 0.25),
    "law that reads a load": Scene(
        lambda: (arm := arm_on_a_hub(LOADED["saturating"], ["foot.force"]), stands(arm)), BOTH, 2e-3, 0.04
    ),
    **{name: Scene(make, (HHT,), 1e-3, 0.15) for name, make in own_laws.SCENES.items()},
    "ball on waves": Scene(
        at(lambda: ball_on(waves, 0.3), {"float.y": 0.5}, {"float.angular_velocity": (2.0, 1.0, -9.0)}),
        (HHT,), 5e-3, 0.3,
    ),
    "loss with a state": Scene(
        lambda: states.pendulum(states.SpringDashpot(20.0, 2.0) + mbd.Viscous(0.1)), (HHT, RADAU), 2e-3, 0.2
    ),
    "law with a state": Scene(states.mat, BOTH, 2e-3, 0.2),
    "mat that knows its impulse": Scene(
        at(lambda: penalties.ball(stiffness=1e4, restitution=0.5), {"fall.displacement": 3e-3}, {"fall.rate": -1.0}),
        (HHT, ALPHA), 1e-3, 0.06,
    ),
    "machine with timers": Scene(at(modes.knee, {"knee.angle": 0.8}), (EXPLICIT, HHT), 0.01, 1.0),
    "late samples": Scene(lambda: arm(delay=0.013), (EXPLICIT, HHT), 4e-3, 0.3),
    "event passed twice": Scene(at(lambda: thrown(1, 0), velocity=THROWN), BOTH, 0.05, 0.4),
    "pushes at strikes": Scene(wheel, BOTH, 5e-3, 0.5),
    "tumbling box": Scene(at(lambda: frictions.brick(0.4), *TURNED), (HHT,), 0.01, 0.5),
    "dry pins": Scene(DRY, (HHT,), 0.01, 0.5),
    "loaded pins": Scene(LOADS, (HHT,), 0.01, 0.5, apart=1e6),
    "runners": Scene(lambda: redundant.start_of(redundant.sled(slope=0.2), -2.0), (HHT,), 1e-2, 0.6),
    "cone": Scene(at(cones.on_incline, velocity={"slide.x": 0.2, "slide.z": 0.3}), (HHT,), 1e-2, 0.5, apart=1e3),
    "bouncing on a ball joint": Scene(lambda: charts.bouncing(True), (HHT,), 0.01, 0.5),
    "top": Scene(charts.top, (ALPHA, RADAU, EXPLICIT), 1 / 64, 0.25),
    "non-smooth box": Scene(at(lambda: box(0.3, 0.4), *TURNED), (HHT,), 4e-3, 0.8, NONSMOOTH),
    "non-smooth ball": Scene(at(lambda: ball(restitution=0.5), DROPPED), (HHT,), 0.01, 1.0, NONSMOOTH),
    "non-smooth cone": Scene(
        at(cones.on_incline, velocity={"slide.x": 0.2, "slide.z": 0.3}), (HHT,), 1e-2, 0.4, NONSMOOTH, apart=1e3
    ),
    "non-smooth feet": Scene(
        at(lambda: feet.on_feet(feet.FOUR), {"float.z": 0.055}, SPUN), (HHT,), 5e-3, 0.1, NONSMOOTH
    ),
}  # fmt: skip
PAIRS = [(name, scheme) for name, scene in SCENES.items() for scheme in scene.schemes]
every_run = pytest.mark.parametrize(("name", "scheme"), PAIRS, ids=[f"{name}, {scheme!r}" for name, scheme in PAIRS])


@cache
def made(name: str) -> tuple[Any, mbd.State]:
    return SCENES[name].make()


def ran(name: str, scheme: Integrator, start: mbd.State | None = None, **more: Any) -> mbd.Trajectory:
    scene, (model, begin) = SCENES[name], made(name)
    how = {"dt": scene.dt, "until": scene.until, **scene.how, **more}
    return mbd.simulate(model, begin if start is None else start, scheme, **how)


@every_run
def test_machine_code_and_plain_python_find_the_same_events_and_rows(name, scheme):
    fast, plain = (ran(name, scheme, backend=backend) for backend in ("llvm", "python"))
    apart = SCENES[name].apart
    assert fast.stats["compiled"] and not plain.stats["compiled"]
    assert [(e.name, e.kind) for e in fast.events] == [(e.name, e.kind) for e in plain.events]
    assert fast.stats["singular_steps"] == plain.stats["singular_steps"]
    one, two = fast.record, plain.record
    for part, bound in (("time", 1e-10), ("q", 1e-10), ("v", 1e-9), ("z", 1e-10), ("a", 1e-6), ("lam", 1e-6)):
        scale = apart * max(1.0, float(np.max(np.abs(getattr(two, part)), initial=0.0)))
        np.testing.assert_allclose(getattr(one, part), getattr(two, part), rtol=0, atol=bound * scale, err_msg=part)
    np.testing.assert_array_equal(one.closed, two.closed)


@every_run
def test_a_run_that_is_cut_and_goes_on_or_was_saved_gives_the_same_bits(name, scheme, tmp_path):
    whole = ran(name, scheme)
    same(whole, mbd.load(whole.save(tmp_path / "whole")))
    steps = np.flatnonzero(np.diff(whole.time, prepend=-1.0, append=np.inf)[1:] > 0.0)[1:-1]
    for place in (0.3, 0.8):
        first = ran(name, scheme, until=float(whole.time[steps[int(place * len(steps))]]))
        for final in (first.final, mbd.load(first.save(tmp_path / f"first {place}")).final):
            assert_halves_are_the_whole(whole, first, ran(name, scheme, final))
