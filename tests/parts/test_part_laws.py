"""Laws of every part of a leg: it gives no energy, and the same leg in other units makes the same motion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.results.units import unit
from tests.instances import PARTS
from tests.parts.benches import ODD, Part, given_by_all_causes, model_of, run_of

QUICK = ("arc foot", "locking knee", "magnetorheological knee", "powered knee, short-circuited", "bumper ankle")
"""Parts of few contact modes, whose code is soon made; the rest is tried among the long tests."""

quick_parts = pytest.mark.parametrize("part", [part for name, part in PARTS if name in QUICK], ids=QUICK)
every_part = pytest.mark.parametrize("part", [part for _, part in PARTS], ids=[name for name, _ in PARTS])
DRAWS = st.lists(st.floats(0.0, 1.0), min_size=9, max_size=9)


@every_part
def test_a_part_finds_no_fault_with_itself(part: Part) -> None:
    assert model_of(part).check() == []


@quick_parts
@settings(max_examples=3)
@given(draws=DRAWS)
def test_a_passive_part_gives_no_energy(part: Part, draws: list[float]) -> None:
    keeps_its_energy(part, draws)


@pytest.mark.slow
@every_part
@settings(max_examples=20)
@given(draws=DRAWS)
def test_a_passive_part_gives_no_energy_in_any_motion(part: Part, draws: list[float]) -> None:
    keeps_its_energy(part, draws, until=0.4)


def keeps_its_energy(part: Part, draws: list[float], until: float = 0.2) -> None:
    """What causes other than stored energy give is ≤ 0 at every instant, up to where a run may end with an error."""
    try:
        run = run_of(part, draws, until=until)
    except mbd.SimulationError as error:
        run = error.run
    size = max(np.max(run.energy.kinetic), 1.0)
    assert np.all(np.isfinite(run.energy.total))
    assert np.max(given_by_all_causes(run)) <= 1e-6 * size, run.energy


@pytest.mark.slow
@pytest.mark.parametrize("part", [part for _, part in PARTS if not part.unscaled])
@settings(max_examples=3)
@given(draws=DRAWS)
def test_a_part_knows_no_units(part: Part, draws: list[float]) -> None:
    """Lengths, masses and times in other units, and every number of the part with them: the same motion."""
    here, there = run_of(part, draws, until=0.1), run_of(part, draws, ODD, until=0.1)
    np.testing.assert_allclose(there.time / ODD.s, here.time, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(there.energy.kinetic / ODD.Nm, here.energy.kinetic, rtol=1e-4, atol=1e-4)
    has_its_units(here, there)


def has_its_units(here: mbd.Trajectory, there: mbd.Trajectory) -> None:
    """In other units each result is as many times as large as its unit says."""
    size = {"m": ODD.m, "kg": ODD.kg, "s": ODD.s, "rad": 1.0, "N": ODD.N, "J": ODD.Nm, "W": ODD.V, "V": ODD.V, "A": 1.0}
    compared = 0
    for name in here.names:
        x, y, text = here[name][:4], there[name][:4] if name in there else np.zeros(0), unit(name, here.facts)
        place = int(np.argmax(np.abs(x))) if x.dtype.kind == "f" and len(y) else -1
        if place < 0 or not text or abs(x[place]) < 1e-6:
            continue
        over, _, under = text.partition("/")
        factor = math.prod(size[word.rstrip("²³")] ** {"²": 2, "³": 3}.get(word[-1], 1) for word in over.split())
        factor /= math.prod(size[word.rstrip("²³")] ** {"²": 2, "³": 3}.get(word[-1], 1) for word in under.split())
        assert abs(y[place] / x[place] / factor - 1.0) < 1e-3, (name, text)
        compared += 1
    assert compared > 10
