"""Forces of users that grow, overflow or have poles: rows that are kept are those of the motion."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd
from tests.helpers import one_body

FAMILY = [
    mbd.Newmark(), mbd.HHT(0.05), mbd.HHT(0.1, formulation="index3"), mbd.GeneralizedAlpha(0.9),
    mbd.GeneralizedAlpha(0.5), mbd.GeneralizedAlpha(0.0),
]  # fmt: skip
SCHEMES = [*FAMILY, mbd.RadauIIA(), mbd.RungeKutta853()]
STEPS = (0.3, 0.1, 0.03, 0.01)


def particle(law: Any, of: str = "x.rate", mass: float = 1.0, place: float = 0.0, speed: float = 1.0) -> Any:
    """A particle under a force along x that follows its place or its speed."""
    model, body = one_body(mbd.PointMass("particle", mass), mbd.Translation, "p", gravity=(0.0, 0.0, 0.0), axes="x")
    push = mbd.Applied("push", body.origin, force=lambda s: (law(s), 0.0), arguments=(f"p.{of}",))
    model.apply(push)
    return model, mbd.assemble(model, position={"p.x": place}, velocity={"p.x": speed})


def motion(law: Any, of: str, mass: float, place: float, speed: float, until: float) -> Any:
    """Place and speed by scipy, up to a pole."""

    def slope(t: float, y: Any) -> list[float]:
        return [y[1], float(np.real(law(y[0] if of == "x" else y[1]))) / mass]

    def far(t: float, y: Any) -> float:
        return float(np.max(np.abs(y)) - 1e8)

    far.terminal = True  # type: ignore[attr-defined]
    with np.errstate(all="ignore"):
        return solve_ivp(slope, (0.0, until), [place, speed], "DOP853", rtol=1e-10, atol=1e-12, events=far,
                         dense_output=True)  # fmt: skip


GROWING = {
    "square of the speed": ("x.rate", lambda c: lambda v: c * v * v),
    "cube of the speed": ("x.rate", lambda c: lambda v: c * v * v * v),
    "exponential of the speed": ("x.rate", lambda c: lambda v: c * mbd.exp(v)),
    "fifth power of the place": ("x", lambda c: lambda x: c * x**5),
    "square of the place": ("x", lambda c: lambda x: c * x * x),
    "exponential of the place": ("x", lambda c: lambda x: c * mbd.exp(3.0 * x)),
    "speed": ("x.rate", lambda c: lambda v: c * v),
}


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", GROWING)
def test_a_motion_that_runs_away_is_followed_or_refused_before_its_rows_are_wrong(name: str) -> None:
    of, family = GROWING[name]
    rng = np.random.default_rng(len(name))
    for mass, c, speed in zip(
        rng.uniform(0.3, 3.0, 2), rng.uniform(0.5, 2.0, 2), rng.uniform(0.5, 2.0, 2), strict=True
    ):
        law, until = family(c), 2.0
        true = motion(law, of, mass, 0.2, speed, until)
        model, start = particle(law, of, mass, 0.2, speed)
        for scheme in SCHEMES:
            for dt in STEPS:
                run = mbd.simulate(model, start, scheme, dt=dt, until=until, on_failure="return")
                told = (name, scheme, dt, mass, c, speed, run.message)
                assert run.time[-1] <= true.t[-1] + 1e-9, told
                v = true.sol(run.time)[1]
                off = np.abs(run["p.x.rate"] - v) / np.maximum.accumulate(np.abs(v))
                bound = 1.0 if scheme in FAMILY else 0.1  # the last row before a pole errs most
                assert np.max(off) < bound and np.median(off) < 0.5 * bound, told
                assert run.success or "try a smaller dt" in run.message or "not finite" in run.message, told
                assert not run.success or true.t[-1] == until, told


def wall(x: Any) -> Any:
    """A wall at 1 m that no number holds 4 m behind it."""
    return -mbd.exp(200.0 * (x - 1.0))


def hardening(x: Any) -> Any:
    return mbd.exp(-30.0 * x) - mbd.exp(30.0 * x)


@pytest.mark.covering
@pytest.mark.parametrize("law", [wall, hardening])
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_every_row_is_balanced_and_none_is_faster_than_the_forces_allow(law: Any, scheme: Any) -> None:
    """A trial step meets forces that overflow: they must excuse no residual afterwards."""
    rng = np.random.default_rng(7)
    for dt in (0.3, 0.1, 0.05, 0.02):
        speed = float(rng.uniform(0.7, 2.0))
        model, start = particle(law, "x", 1.0, 0.0, speed)
        run = mbd.simulate(model, start, scheme, dt=dt, until=2.0, on_failure="return")
        force = np.array([float(np.real(law(float(x)))) for x in run["p.x"]])
        size = 1e-6 * np.maximum.accumulate(np.maximum(np.abs(force), 1e-3))
        assert np.all(np.abs(run["p.x.acceleration"] - force) <= size), (scheme, dt, run.message)
        assert np.max(np.abs(run["p.x.rate"])) < 4.0 * speed, (scheme, dt, run.message)


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_forces_that_begin_at_once_are_no_runaway(scheme: Any) -> None:
    """From rest all of the change is unforeseen: but it does not feed itself."""
    model, body = one_body(mbd.PointMass("particle", 1.3), mbd.Translation, "p", gravity=(0.0, 0.0, 0.0), axes="x")
    model.apply(
        mbd.Applied("push", body.origin, force=lambda t: (mbd.where(t < 0.111, 0.0, 5.0), 0.0), arguments=("t",))
    )
    for dt in (0.1, 0.04, 0.007):
        run = mbd.simulate(model, mbd.assemble(model), scheme, dt=dt, until=1.0)
        assert run["p.x.rate"][-1] == pytest.approx(5.0 / 1.3 * 0.889, abs=5.0 / 1.3 * dt)


@pytest.mark.parametrize("scheme", FAMILY, ids=repr)
@pytest.mark.parametrize(("stiffness", "damping"), [(1e8, 0.0), (1e8, 3e3), (0.0, 1e6)])
def test_stiff_forces_are_none_either(scheme: Any, stiffness: float, damping: float) -> None:
    """ω dt and c dt/m of a thousand and more: coarse, but neither growth nor speed from nowhere."""
    model, start = particle(lambda v: -damping * v, speed=0.3, place=0.01)
    model.apply(mbd.Potential("spring", lambda x: 0.5 * stiffness * x * x, arguments=("p.x",)))
    run = mbd.simulate(model, start, scheme, dt=0.1, until=3.0, on_failure="return")
    assert "forces that grow" not in run.message and "more than the forces" not in run.message


# poles in space -------------------------------------------------------------------------------------------------------
PULLS = {
    "1/x": lambda x: -0.7 / x, "1/x²": lambda x: -0.7 / x**2, "1/x³": lambda x: -0.7 / x**3,
    "1/x |x|": lambda x: -0.7 / (x * mbd.sqrt(x * x)), "softened": lambda x: -0.7 * x / mbd.sqrt(x * x + 0.01) ** 3,
}  # fmt: skip


@cache
def falling(law):
    """A point that is pulled towards the origin of a rail."""
    model, _ = one_body(mbd.PointMass("point", mass=1.0), mbd.Prismatic, "rail", title="fall", gravity=(0.0, 0.0, 0.0))
    rail = model.joints[0]
    model.apply(mbd.Motor("pull", rail, lambda t, x: PULLS[law](x), arguments=("t", "rail.displacement")))
    return model


@pytest.mark.covering
@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.Newmark(), mbd.GeneralizedAlpha(0.8), mbd.RadauIIA()], ids=repr)
@pytest.mark.parametrize("law", [law for law in PULLS if law != "softened"])
def test_no_step_leaps_over_the_pole_of_a_force(law, scheme):
    """Both ends of such a step may look alike, or go on as the slope of accelerations predicted."""
    rng = np.random.default_rng(5)
    for _ in range(15):
        start = mbd.assemble(falling(law), {"rail.displacement": rng.uniform(0.05, 0.4)})
        dt = 10.0 ** rng.uniform(-4.0, -1.5)
        run = mbd.simulate(falling(law), start, scheme, dt=dt, until=1.0, on_failure="return")
        assert not run.success and (run["rail.displacement"] > 0.0).all(), (dt, run.message)
        assert "dt" in run.message, run.message


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
def test_a_steep_place_that_steps_resolve_is_passed(scheme):
    for place in np.random.default_rng(6).uniform(0.2, 0.6, 4):
        start = mbd.assemble(falling("softened"), {"rail.displacement": place})
        run = mbd.simulate(falling("softened"), start, scheme, dt=1e-3, until=1.0)
        x, v = run["rail.displacement"], run["rail.displacement.rate"]
        energy = 0.5 * v**2 - 0.7 / np.sqrt(x**2 + 0.01)
        assert np.ptp(energy) < 0.03 and x.min() < 0.0


@cache
def drifting(power: int) -> mbd.Model:
    """A body that floats, whose steps have a chart, pulled towards x = 0 by 0.7/|x|^(power + 1)."""
    model = mbd.Model("drift", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("body", 1.0, (0.1, 0.2, 0.3))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    model.apply(mbd.Potential("well", lambda x: -0.7 / power * mbd.sqrt(x * x) ** -power, "float.x"))
    return model


@pytest.mark.parametrize("power", [1, 2, 3])
def test_a_floating_body_leaps_over_no_pole_in_silence(power: int) -> None:
    """However the stages of the steps lie around it."""
    rng = np.random.default_rng(power)
    for _ in range(6):
        dt, speed, away = 10 ** rng.uniform(-2.5, -0.5), 10 ** rng.uniform(-0.5, 0.5), rng.uniform(0.05, 1.0)
        start = mbd.assemble(
            drifting(power), {"float.x": -away}, {"float.x": speed, "float.angular_velocity": (0, 1, 2)}
        )
        until = 2.0 * away / speed + 2.0 * dt
        run = mbd.simulate(drifting(power), start, mbd.RungeKutta853(), dt=dt, until=until, on_failure="return")
        assert not run.success, (dt, speed, away)
