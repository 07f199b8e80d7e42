"""Case k5: a compass walker on level ground, whose trailing foot pushes off in the reset of the heel strike."""

import numpy as np

import mbd
from tests.problems import case

REFERENCE = "k5-compass-pushoff-level"


def pushing() -> mbd.Lagrangian:
    """Two straight legs about the stance foot; at the strike of the other foot the old stance leg pushes off.

    The plastic impact keeps the momenta about the new stance foot and that of the old leg about the hip, to which the
    push of impulse P along the old stance leg adds its moment about the new foot, P L sin(stance − swing).
    """
    from sympy import cos, sin, symbols

    sizes = case(REFERENCE).definition
    L, b = sizes["a1"] + sizes["b1"] + sizes["a2"] + sizes["b2"], sizes["b2"]
    stance, swing = mbd.Coordinate("stance"), mbd.Coordinate("swing")
    m, M, push = symbols("leg_mass hip_mass push")
    c, s = cos(stance.q - swing.q), sin(stance.q - swing.q)
    v, w = stance.v, swing.v
    kinetic = (M * L**2 + m * (L - b) ** 2 + m * L**2) / 2 * v**2 + m * b**2 / 2 * w**2 - m * L * b * c * v * w
    potential = sizes["g"] * ((M * L + m * (L - b) + m * L) * cos(stance.q) - m * b * cos(swing.q))
    model = mbd.Lagrangian(
        "pushing walker", [stance, swing], kinetic=kinetic, potential=potential,
        parameters={m: sizes["mt"], M: sizes["mh"], push: sizes["P"]},
    )  # fmt: skip
    old = -m * b * (L - b) * v
    new = (m * (L - b) * L + m * (L - b) * L + M * L**2) * c * v - m * (L - b) * b * w + push * L * s
    one, both, other = m * b**2, -m * b * L * c, (M + m) * L**2 + m * (L - b) ** 2
    whole = one * other - both**2
    after = {v: (one * new - both * old) / whole, w: (other * old - both * new) / whole}
    reset = {stance.q: swing.q, swing.q: stance.q, **after}
    model.constrain(mbd.Event("heel strike", stance.q + swing.q, direction=-1, reset=reset))
    return model


def test_the_gait_that_a_push_off_drives_on_level_ground_is_that_of_the_case():
    reference, model = case(REFERENCE), pushing()
    expected = reference["state just after heel strike"].value
    angle, stance, swing = np.round(expected, 3)
    start = mbd.assemble(model, {"stance": angle, "swing": -angle}, {"stance": stance, "swing": swing})
    gait = mbd.limit_cycle(model, start, section="heel strike")
    found = [gait.state[name] for name in ("stance", "stance.rate", "swing.rate")]
    assert np.max(np.abs(found - expected)) < 1e-9
    assert abs(gait.period - reference["phase durations"].value[0]) < 1e-10
    real, imaginary = reference["Floquet"].value
    theirs = real + 1j * imaginary
    assert max(np.min(np.abs(theirs - value)) for value in gait.multipliers) < 2e-9
    for parameter, name in (("push-off impulse P", "push"), ("hip mass", "hip_mass")):
        by = reference[f"d(period, step length, speed, largest |multiplier|) / d({parameter})"].value
        assert abs(gait.derivatives["period", name] - by[0]) < 1e-9
        assert abs(gait.derivatives["largest multiplier", name] - by[3]) < 1e-7
