"""Where nothing acts a run goes on: scales are those of the mechanism, not of terms that vanish."""

from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import mbd
from tests.simulation.vanishing import BALANCED, DRIVEN, Scene, Units, balanced, driven, shaft

SCHEMES = {
    "HHT": mbd.HHT(0.05), "generalized-alpha": mbd.GeneralizedAlpha(0.9), "Newmark": mbd.Newmark(),
    "index 3": mbd.GeneralizedAlpha(0.8, formulation="index3"), "RadauIIA": mbd.RadauIIA(),
}  # fmt: skip
STEPS = ({"dt": 5e-3}, {"dt": 1e-3}, {"dt": 2e-4}, {"tol": 1e-6})
OTHER_UNITS = (Units(1e3), Units(1e-3), Units(mass=1e-9), Units(mass=1e9), Units(time=1e3), Units(time=1e-6),
               Units(1e3, 1e-3, 1e3))  # fmt: skip
SI = Units()


def ran(scene: Scene, scheme: Any, units: Units = SI, until: float = 0.6, **step: float) -> Any:
    step = {name: value * units.time if name == "dt" else value for name, value in step.items()}
    start = mbd.assemble(scene.model, **scene.start)
    run = mbd.simulate(scene.model, start, scheme, until=until * units.time, on_failure="return", **step)
    assert run.success, (scene.model, scheme, step, run.message)
    if scene.drives and scheme.stabilized:
        assert not any("not resolved" in note or "singular" in note for note in run.stats["notes"])
    return run


def steps_of(seed: int, name: str) -> Any:
    """One step for each scheme, by turns; index 3 has no tolerance."""
    step = STEPS[(seed + len(name)) % len(STEPS)]
    return {"dt": 1e-3} if name == "index 3" and "tol" in step else step


def works(scene: Scene, scheme: str, step: Any) -> None:
    run = ran(scene, SCHEMES[scheme], **step)
    for coordinate, motion in scene.drives.items():
        wanted = np.array([float(np.real(motion(float(t)))) for t in run.time])
        np.testing.assert_allclose(run[coordinate], wanted, rtol=0.0, atol=1e-8)


@pytest.mark.covering
@pytest.mark.parametrize("kind", DRIVEN)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_driven_mechanisms_rest_move_and_are_held(scheme: str, kind: str) -> None:
    seed = len(scheme) + len(kind)
    works(driven(kind, seed, SI, ("auto", "all")[seed % 2], "moved and held"), scheme, steps_of(seed, scheme))


@pytest.mark.slow
@pytest.mark.parametrize("kind", DRIVEN)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_driven_mechanisms_do_whatever_they_are_asked_for(scheme: str, kind: str) -> None:
    for seed in range(20):
        for step in STEPS[: 3 if scheme == "index 3" else 4]:
            works(driven(kind, seed, SI, ("auto", "all")[seed % 2]), scheme, step)


@pytest.mark.covering
@pytest.mark.parametrize("kind", BALANCED)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_balanced_mechanisms_keep_their_energy(scheme: str, kind: str) -> None:
    seed = len(scheme) + len(kind)
    keeps_energy(balanced(kind, seed, SI, ("auto", "all")[seed % 2]), scheme, steps_of(seed, scheme))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_shafts_of_balanced_wheels_turn_as_a_table_says(scheme: str) -> None:
    """Where forces change at a knot what balances is round-off of nothing, 10⁻¹⁷³ N beside 10⁻³⁰⁰ N."""
    for seed in (3, 4, 5, 7):
        scene, table = shaft(seed, "all")
        run = ran(scene, SCHEMES[scheme], until=0.3, dt=0.015)
        curve = CubicSpline(table.time, table.values, bc_type="clamped")
        wanted = curve(np.minimum(run.time, table.time[-1]))
        np.testing.assert_allclose(run["joint 0.angle"], wanted, rtol=0.0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("kind", BALANCED)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_so_do_many_of_them(scheme: str, kind: str) -> None:
    for seed in range(20):
        for step in STEPS[: 3 if scheme == "index 3" else 4]:
            keeps_energy(balanced(kind, seed, SI, ("auto", "all")[seed % 2]), scheme, step)


def keeps_energy(scene: Scene, scheme: str, step: Any) -> None:
    run = ran(scene, SCHEMES[scheme], until=0.4, **step)
    kinetic = run.energy.kinetic
    bound = 1e-9 if scheme == "RadauIIA" and step.get("dt", 1e-3) <= 1e-3 else 0.05
    assert np.ptp(run.energy.total) <= bound * kinetic[0] + 1e-13 * (1.0 + np.max(kinetic)), (scene.model, step)


@pytest.mark.covering
@pytest.mark.parametrize("scheme", ["HHT", "RadauIIA"])
@pytest.mark.parametrize("units", OTHER_UNITS, ids=repr)
def test_units_do_not_matter(units: Units, scheme: str) -> None:
    for number, kind in enumerate((*DRIVEN, *BALANCED)):
        if (number + len(repr(units))) % 4:
            continue
        make = driven if kind in DRIVEN else balanced
        one, other = (ran(make(kind, 1, each), SCHEMES[scheme], each, until=0.5, dt=2e-3) for each in (SI, units))
        assert one.record.q.shape == other.record.q.shape
        joints = make(kind, 1, SI).model.joints
        for name in (f"{joint.name}.{each.name}" for joint in joints for each in joint.labels if each.unit == "rad"):
            np.testing.assert_allclose(other[name], one[name], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("kind", ["slider-crank", "pendulum"])
def test_what_a_drive_holds_is_the_slope_of_the_potential_energy(kind: str) -> None:
    for seed in range(3):
        scene = driven(kind, seed, SI, ("auto", "all")[seed % 2], "moved and held")
        at = float(np.real(scene.drives["crank.angle"](0.9)))

        def potential(angle: float, scene: Scene = scene) -> float:
            free = mbd.Model("same", gravity=scene.model.gravity, cut=scene.model.cut)
            free.connect(*scene.model.joints)
            state = mbd.assemble(free, position={"crank.angle": angle})
            heavy = [body for body in scene.model.bodies.values() if getattr(body, "mass", 0.0)]
            return sum(9.81 * scene.heavy * float(body.mass) * float(state[f"{body.name}.center.y"]) for body in heavy)

        step = 1e-4
        wanted = (potential(at + step) - potential(at - step)) / (2.0 * step)
        for scheme in ("HHT", "generalized-alpha", "RadauIIA"):
            run = ran(scene, SCHEMES[scheme], until=1.0, dt=1e-3)
            assert abs(float(run["drive.torque"][-1])) == pytest.approx(abs(wanted), abs=1e-5), (scene.model, scheme)


def pushed(seed: int, cut: Any) -> Any:
    """Links at rest without gravity, hung up at frames about which they turn; motors begin with no torque."""
    rng = np.random.default_rng(seed)
    model = mbd.Model("pushed", gravity=(0.0, 0.0, 0.0), cut=cut)
    end = model.ground.point(0.2, -0.6)
    for k in range(int(rng.integers(1, 4))):
        length = rng.uniform(0.3, 1.2)
        link = mbd.Link(f"link {k}", rng.uniform(0.5, 2.0), length, rng.uniform(0.3, 0.8) * length, 0.2)
        joint = mbd.Revolute(f"joint {k}", end, link.start, loss=mbd.Quadratic(rng.uniform(0.0, 0.3)))
        model.connect(joint)
        size = rng.uniform(1.0, 20.0)
        grows, jumps = (lambda t, c=size: c * t), (lambda t, c=size: mbd.where(t < 0.1, 0.0, c))
        model.apply(mbd.Motor(f"motor {k}", joint, torque=(grows, jumps)[k % 2]))
        end = rng.choice([link.end, model.bodies["link 0"].start])
    names = [f"{joint.name}.angle" for joint in model.joints]
    return model, {name: rng.uniform(-1.0, 1.0) for name in names}


@pytest.mark.parametrize("seed", range(2))
def test_motions_begin_from_rest_under_forces_that_begin_with_nothing(seed: int) -> None:
    """With joints cut a scheme errs by no more than a few times of what it errs by without, at the same dt."""
    tree, places = pushed(seed, "auto")
    exact = mbd.simulate(tree, mbd.assemble(tree, places), mbd.RungeKutta853(), dt=1e-3, until=0.3)
    for scheme in (*SCHEMES.values(), mbd.RungeKutta853()):
        whole = mbd.simulate(tree, mbd.assemble(tree, places), scheme, dt=1.5e-2, until=0.3)
        error = max(abs(whole[name][-1] - exact[name][-1]) for name in places)
        for cut in ("joint 0",), "all":
            model, _ = pushed(seed, cut)
            run = mbd.simulate(model, mbd.assemble(model, places), scheme, dt=1.5e-2, until=0.3)
            for name in places:
                assert abs(run[name][-1] - exact[name][-1]) <= 4.0 * error + 1e-6, (cut, scheme, name)
