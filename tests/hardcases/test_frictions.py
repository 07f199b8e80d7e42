"""The hard cases of dry friction hold, and their judges notice where they do not."""

from __future__ import annotations

import pytest

import mbd
from mbd.hardcases import frictions

SCHEMES = {
    "HHT": mbd.HHT(0.05), "HHT-index3": mbd.HHT(0.05, formulation="index3"),
    "generalized-alpha": mbd.GeneralizedAlpha(0.8),
    "generalized-alpha-index3": mbd.GeneralizedAlpha(0.8, formulation="index3"), "Newmark": mbd.Newmark(),
    "RadauIIA": mbd.RadauIIA(), "RungeKutta853": mbd.RungeKutta853(),
}  # fmt: skip


@pytest.mark.covering
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("case", frictions.CASES, ids=lambda case: case.id)
def test_every_case_holds(case, scheme):
    assert scheme in case.schemes
    outcome = case.judge(SCHEMES[scheme])
    assert outcome.passed, [figure for figure in outcome.figures if not figure.passed]


@pytest.mark.parametrize(
    ("number", "wrong", "noticed"),
    [
        (0, {"Coulomb": lambda torque, known=mbd.Coulomb: known(1.001 * torque)}, "order"),
        (1, {"PinFriction": lambda mu, radius, known=mbd.PinFriction: known(1.002 * mu, radius)}, "order"),
        (2, {"numbers": lambda id, known=frictions.numbers: known(id) | {"mu": 1.2}}, "no impulse stops"),
    ],
)
def test_a_judge_notices_another_law(number, wrong, noticed, monkeypatch):
    """A torque or coefficient off by a part in a thousand, a rod that does not jam."""
    for name, replacement in wrong.items():
        monkeypatch.setattr(frictions if hasattr(frictions, name) else mbd, name, replacement)
    frictions.pendulum.cache_clear()
    outcome = frictions.CASES[number].judge(SCHEMES["HHT"])
    frictions.pendulum.cache_clear()
    assert any(noticed in figure.what for figure in outcome.figures if not figure.passed)
