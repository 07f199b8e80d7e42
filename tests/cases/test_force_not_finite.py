"""Forces of users that are no numbers, beside the hard case j16: outside of their domain, among others, at once."""

import math
from collections.abc import Callable
from typing import Any

import pytest

import mbd


def particle(push: Any, arguments: tuple[str, ...] = ("t",), mass: float = 1.0) -> mbd.Model:
    """A free particle under a force along x."""
    model = mbd.Model("particle", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("particle", mass)
    model.connect(mbd.Translation("place", model.ground.origin, body.origin))
    model.apply(mbd.Applied("push", body.origin, force=push, arguments=arguments))
    return model


def cliff(x: float) -> tuple[float, float]:
    """Real only up to x = 0.3."""
    return 2.0 + 1e-300 * mbd.sqrt(0.3 - x), 0.0


def quotient(t: float) -> tuple[float, float]:
    """2 N, with a pole of no strength at every step of 0.01 from 0.4 on that hits it."""
    return 2.0 + mbd.where(t < 0.395, 0.0, 1.0) / mbd.where(t < 0.395, 1.0, 0.0), 0.0


@pytest.mark.parametrize("backend", ["auto", "python"])
@pytest.mark.parametrize(("push", "arguments"), [(cliff, ("place.x",)), (quotient, ("t",))], ids=["root", "pole"])
def test_a_force_that_leaves_its_domain_is_named_too(push: Callable[..., Any], arguments: Any, backend: str) -> None:
    """Another force, mass and start: a square root of a negative place, and infinity."""
    model = particle(push, arguments, mass=1.6)
    start = mbd.assemble(model, velocity={"place.x": 0.1}, backend=backend)
    with pytest.raises(mbd.SimulationError, match=r"force of 'push' on 'particle\.origin'") as failure:
        mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), dt=0.01, until=2.0, backend=backend)
    run = failure.value.run
    assert len(run) > 25
    assert run["place.x"] == pytest.approx(0.1 * run.time + run.time**2 / 1.6, abs=1e-12)


def test_the_force_at_fault_is_named_among_several() -> None:
    model = particle(lambda t: (mbd.where(t < 0.5, 1.0, math.nan), 0.0))
    other = mbd.PointMass("other", 2.0)
    model.connect(mbd.Translation("other place", model.ground.origin, other.origin))
    model.apply(
        mbd.Applied("pull", other.origin, force=lambda t: (mbd.where(t < 0.3, 1.0, math.inf), 0.0)),
        mbd.Applied("steady", other.origin, force=(1.0, 0.0, 0.0)),
    )
    run = mbd.simulate(model, mbd.assemble(model), mbd.HHT(), dt=0.01, until=1.0, on_failure="return")
    assert run.message.startswith("t = 0.3 s")
    assert "'pull' on 'other.origin'" in run.message
    assert "'push'" not in run.message


def test_a_force_that_is_not_finite_at_the_start_is_refused_before_the_run() -> None:
    model = particle(lambda t: (mbd.where(t < 0.0, 1.0, math.nan), 0.0))
    with pytest.raises(mbd.AssemblyError, match=r"the force of 'push' is not finite at the start"):
        mbd.assemble(model)
