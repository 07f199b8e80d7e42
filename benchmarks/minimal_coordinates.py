"""``python -m benchmarks.minimal_coordinates``: a loop closed by rows beside the same mechanism in one coordinate.

A slider-crank whose crank, rod and slider are joined by two constraint rows, against its Lagrange equation in the crank
angle alone, where sine and cosine of the rod follow from the crank in closed form: what no automatic choice of minimal
coordinates could do better, for it would have to close the loop by iterations.
"""

from __future__ import annotations

import math
from typing import Any

import mbd
from benchmarks.stopwatch import kernel_watched

CRANK, ROD, MASSES = 0.3, 0.8, (1.0, 2.0, 1.5)
SCHEMES = (
    (mbd.Newmark(), 1e-3),
    (mbd.HHT(), 1e-3),
    (mbd.HHT(formulation="index3"), 1e-3),
    (mbd.GeneralizedAlpha(rho_inf=0.8), 1e-3),
    (mbd.RadauIIA(), 5e-3),
    (mbd.RungeKutta853(), 5e-3),
)
UNTIL, REPEATS = 20.0, 15


def with_rows() -> tuple[mbd.Model, mbd.State]:
    """Crank angle, rod angle and slider, and the two rows of the wrist."""
    m_crank, m_rod, m_slider = MASSES
    model = mbd.Model("slider-crank")
    crank = mbd.Link("crank", mass=m_crank, length=CRANK, center=CRANK / 2, inertia=m_crank * CRANK**2 / 12)
    rod = mbd.Link("rod", mass=m_rod, length=ROD, center=ROD / 2, inertia=m_rod * ROD**2 / 12)
    slider = mbd.PointMass("slider", mass=m_slider)
    model.connect(
        mbd.Revolute("pin", model.ground.origin, crank.start),
        mbd.Revolute("knuckle", crank.end, rod.start),
        mbd.Prismatic("guide", model.ground.origin, slider.origin),
        mbd.Revolute("wrist", rod.end, slider.origin),
    )
    place = CRANK * math.sin(1.0) + math.sqrt(ROD**2 - (CRANK * math.cos(1.0)) ** 2)
    position = {"pin.angle": 1.0, "guide.displacement": place}
    return model, mbd.assemble(model, position=position, velocity={"pin.angle": 3.0})


def minimal() -> tuple[mbd.Lagrangian, mbd.State]:
    """The crank angle θ alone: the slider stands at r sin θ + √(L² − r² cos² θ)."""
    import sympy

    m_crank, m_rod, m_slider = MASSES
    theta = mbd.Coordinate("theta")
    y = -CRANK * sympy.cos(theta.q)
    x = CRANK * sympy.sin(theta.q)
    slider = x + sympy.sqrt(ROD**2 - y**2)
    rates = [sympy.diff(e, theta.q) * theta.v for e in ((x + slider) / 2, y / 2, sympy.asin(y / ROD), slider)]
    inertias = (m_rod, m_rod, m_rod * ROD**2 / 12, m_slider)
    kinetic = (
        m_crank * CRANK**2 / 3 * theta.v**2 + sum(m * rate**2 for m, rate in zip(inertias, rates, strict=True))
    ) / 2
    mechanism = mbd.Lagrangian("slider-crank", [theta], kinetic, 9.81 * y * (m_crank + m_rod) / 2)
    return mechanism, mbd.assemble(mechanism, position={"theta": 1.0}, velocity={"theta": 3.0})


def microseconds(model: Any, start: mbd.State, integrator: Any, dt: float) -> float:
    """Of processor time in the kernel for one step."""
    with kernel_watched() as watch:
        mbd.simulate(model, start, integrator, dt=dt, until=UNTIL, store=100_000)
    return 1e6 * watch.seconds * dt / UNTIL


def main() -> None:
    """Measure by turns and print."""
    both = with_rows(), minimal()
    rows, single = ({scheme: [] for scheme in SCHEMES} for _ in both)  # type: dict[Any, list[float]]
    for _ in range(REPEATS):
        for table, (model, start) in zip((rows, single), both, strict=True):
            for scheme in SCHEMES:
                table[scheme].append(microseconds(model, start, *scheme))
    print("operations of a Newton step:", *(model.cost().newton for model, _ in both))
    for scheme in SCHEMES:
        a, b = min(rows[scheme]), min(single[scheme])
        print(f"{scheme[0]!r}: {a:.3f} us with rows, {b:.3f} us in one coordinate, ratio {a / b:.2f}")


if __name__ == "__main__":
    main()
