"""Case c2: the slider-crank with an elastic connecting rod of the IVP test set, by its energies."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

import mbd

NAMES = ("crank", "rod", "slider", "bend", "wave", "middle", "end")
"""φ₁, φ₂, x₃; two lateral sine modes, longitudinal displacements of the rod's middle and end node."""


def flexible_slider_crank(p: Mapping[str, Any], first: Any) -> tuple[mbd.Lagrangian, mbd.State]:
    """The model and its start, whose nine printed digits are projected onto the rows.

    T = ½ J₁₁ φ₁˙² + M₁₂ φ₁˙φ₂˙ + ½ M₂₂ φ₂˙² + ½ M₃ x₃˙² + φ₁˙ m₁·q˙ + φ₂˙ m₂·q˙ + ½ q˙·M_q q˙,  V = ½ q·K q,
    the terms as `definition` of the case has them (Simeon 1996; Mazzia & Magherini 2008, test set for IVP solvers).
    """
    pi, rho, L1, L2 = p["PI"], p["RHO"], p["L1"], p["L2"]
    area, slim = p["BB"] * p["HH"], (p["HH"] / p["L2"]) ** 2
    fm, fk, fb = rho * area * L2, p["EE"] * area / L2, area * L2
    third = 8.0 / pi**3 - 1.0 / pi

    def mass(a: Any, b: Any) -> Any:
        """a · M_q b."""
        return fm * (
            0.5 * a[0] * b[0] + 0.5 * a[1] * b[1] + 8 * a[2] * b[2] + a[2] * b[3] + a[3] * b[2] + 2 * a[3] * b[3]
        )

    def kinetic(
        crank,
        rod,
        bend,
        wave,
        middle,
        end,
        crank_rate,
        rod_rate,
        slider_rate,
        bend_rate,
        wave_rate,
        middle_rate,
        end_rate,
    ):  # type: ignore[no-untyped-def]
        q, u = (bend, wave, middle, end), (bend_rate, wave_rate, middle_rate, end_rate)
        C, S = mbd.cos(crank - rod), mbd.sin(crank - rod)
        c1q, c2q = fb * (2 * q[2] + q[3] / 2) / 3, fb * 2 / pi * q[0]
        c1u, c2u = fb * (2 * u[2] + u[3] / 2) / 3, fb * 2 / pi * u[0]
        c12q = L2 * fb * (q[2] / 3 + q[3] / 6)
        c21u = L2 * fb * (u[0] / pi - u[1] / (2 * pi))
        turned = fb * (
            q[0] * (-16 / pi**3 * u[2] + third * u[3]) + q[1] * u[3] / (2 * pi)
            + q[2] * 16 / pi**3 * u[0] - q[3] * (third * u[0] + u[1] / (2 * pi))
        )  # fmt: skip
        both = L1 * L2 * p["M2"] * C / 2 + rho * L1 * (S * c2q + C * c1q)
        second = p["J2"] + mass(q, q) + 2 * rho * c12q
        return (
            (p["J1"] + p["M2"] * L1**2) * crank_rate**2 / 2 + both * crank_rate * rod_rate + second * rod_rate**2 / 2
            + p["M3"] * slider_rate**2 / 2 + crank_rate * rho * L1 * (C * c2u - S * c1u)
            + rod_rate * rho * (c21u + turned) + mass(u, u) / 2
        )  # fmt: skip

    def potential(bend, wave, middle, end):  # type: ignore[no-untyped-def]
        lateral = pi**4 / 24 * slim * bend**2 + 2 * pi**4 / 3 * slim * wave**2
        return fk / 2 * (lateral + 16 / 3 * middle**2 - 16 / 3 * middle * end + 7 / 3 * end**2)

    model = mbd.Lagrangian(
        "flexible slider-crank", list(NAMES), kinetic=kinetic, potential=potential,
        constraints={
            "height": lambda crank, rod, end: L1 * mbd.sin(crank) + (L2 + end) * mbd.sin(rod),
            "length": lambda crank, rod, slider, end: slider - L1 * mbd.cos(crank) - (L2 + end) * mbd.cos(rod),
            "drive": lambda crank, t: crank - p["OMEGA"] * t,
        },
    )  # fmt: skip
    places, rates = np.split(np.asarray(first, dtype=float), 2)
    assert len(places) == len(NAMES) and math.isclose(rates[0], p["OMEGA"])
    start = mbd.assemble(
        model, position=dict(zip(NAMES, map(float, places), strict=True)),
        velocity={f"{name}.rate": float(rate) for name, rate in zip(NAMES, rates, strict=True)}, project=True,
    )  # fmt: skip
    return model, start
