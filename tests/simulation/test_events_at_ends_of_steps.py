"""An event keeps its instant wherever steps end, also where bodies of little mass make its guard uncertain."""

import pytest
from sympy import cos, sin

import mbd


def walker(light: float) -> mbd.Lagrangian:
    """The simplest walker, whose foot has a mass of `light` times that of the hip, up to its first heel strike."""
    theta, phi = mbd.Coordinate("theta"), mbd.Coordinate("phi")
    x, y = sin(phi.q - theta.q) + sin(theta.q), cos(theta.q) - cos(phi.q - theta.q)
    speeds = (sum(place.diff(c.q) * c.v for c in (theta, phi)) for place in (x, y))
    kinetic = theta.v**2 / 2 + light * sum(speed**2 for speed in speeds) / 2
    potential = cos(theta.q - 0.009) + light * (y * cos(0.009) + x * sin(0.009))
    model = mbd.Lagrangian("walker", [theta, phi], kinetic=kinetic, potential=potential)
    model.constrain(mbd.Event("heel strike", phi.q - 2 * theta.q, direction=+1, terminal=True))
    return model


@pytest.mark.parametrize("light", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(
    ("integrator", "steps", "tolerance"), [(mbd.RungeKutta853(), 80, 1e-12), (mbd.RadauIIA(), 400, 1e-11)]
)
def test_an_event_does_not_move_to_the_end_of_a_step(
    integrator: mbd.RungeKutta853 | mbd.RadauIIA, steps: int, tolerance: float, light: float
) -> None:
    """Steps that end 1e-4 to 1e-12 s after the event, and before it, find it at the same instant."""
    model = walker(light)
    start = mbd.assemble(model, position={"theta": 0.2, "phi": 0.4}, velocity={"theta": -0.1998, "phi": -0.0158})

    def instant(dt: float) -> float:
        run = mbd.simulate(model, start, integrator, dt=dt, until=6.0)
        return run.events[-1].time

    expected = instant(3.8 / (steps - 0.5))
    for lag in (1e-4, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-12):
        for side in (-1.0, 1.0):
            found = instant((expected + side * lag) / steps)
            assert found == pytest.approx(expected, abs=tolerance), (lag, side)
