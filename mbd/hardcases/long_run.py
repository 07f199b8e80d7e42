"""A pendulum over very many periods: j12."""

import math
from functools import partial
from typing import Any

import numpy as np

import mbd
from mbd.analysis.spectrum import spectrum
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.convergence import EPS
from mbd.hardcases.crossings import falls
from mbd.hardcases.references import quantity, size
from mbd.hardcases.schemes import is_undamped

J12, QUICK = "j12-long-time-1e5-periods", "j12-long-time-1e3-periods"
STEPS_PER_PERIOD = 100
"""Steps in a period [-]."""
FIRST, TIMES = 10, 5.0
"""Energy may differ at the end by so many times what it does within the first periods [-]."""
PHASE_FACTOR = 0.05
"""How far the phase may be from periods × relative error of one × 2π [-]."""
SMALL, SMALL_RATE, RATE = 0.05, 0.01, 0.05
"""A small amplitude over that of the case; how far its decay, and that of the case, may be from the one predicted by
the algorithmic damping of linear oscillators [-]."""
HIGH_ORDER_PHASE_FACTOR = 0.01
"""Phase error of a scheme of order p > 2, over periods × (ω dt)^p × 2π; that of order 8 needs a fifth of it [-]."""
MIN_LOSS_OVER_ROUND_OFF = 1e3
"""Loss of energy over its round-off above which the rate of decay is judged [-]."""
BLOCKS = 20
"""Parts of the run whose mean energies must fall."""


def long_pendulum(share: float = 1.0, case: str = J12) -> tuple[mbd.Model, mbd.State]:
    """A point mass on a massless rod, released at a share of its amplitude."""
    numbers, begin = definition(case)["definition"], definition(case)["initial_conditions"]
    model = mbd.Model("pendulum", gravity=(0.0, -numbers["g"], 0.0))
    rod = mbd.Link("rod", numbers["m"], numbers["L"], numbers["L"])
    model.connect(mbd.Revolute("pivot", model.ground.origin, rod.start))
    return model, mbd.assemble(model, position={"pivot.angle": share * begin["theta0"]})


def judge_long_run(case: str, integrator: Any) -> Outcome:
    """Undamped: energy bounded and a phase error that only adds up. Damped: energy falls at the predicted rate.

    With an order above 2 energy is lost at that rate too, or kept to round-off where this is less than can be seen.
    """
    numbers = definition(case)["definition"]
    count = int(numbers["n_periods"])
    until = float(quantity(case, "end time").value)
    dt = until / count / STEPS_PER_PERIOD
    model, start = long_pendulum(case=case)
    begin = mbd.simulate(model, start, integrator, dt=dt, until=FIRST * STEPS_PER_PERIOD * dt)
    bottom = numbers["m"] * numbers["g"] * numbers["L"]
    energy = quantity(case, "energy above")
    total = begin.energy.total + bottom
    figures = [Figure("error of the energy at the start [J]", abs(total[0] - energy.value), 10.0 * energy.accuracy)]
    higher = integrator.order() > 2
    if is_undamped(integrator):
        run = mbd.simulate(model, start, integrator, dt=dt, until=until, store=STEPS_PER_PERIOD)
        figures += _kept(run, bottom, size(total / total[0] - 1.0))
        figures += _phase(case, run, begin, count)
    else:
        run = mbd.simulate(model, start, integrator, dt=dt, until=until, store=_stride(count))
        figures += _higher(case, integrator, run, count, bottom) if higher else _falling(run, bottom)
        if not higher:
            figures.append(_rate(case, integrator, dt, 1.0, run, RATE))
        few = min(count, 1000) * STEPS_PER_PERIOD * dt
        model, start = long_pendulum(SMALL, case)
        small = mbd.simulate(model, start, integrator, dt=dt, until=few, store=_stride(min(count, 1000)))
        if _loss(case, integrator, dt, small) > MIN_LOSS_OVER_ROUND_OFF * _round_off(case, small):
            figures.append(_rate(case, integrator, dt, SMALL, small, SMALL_RATE))
    return Outcome(figures, [Curve("energy [J]", run.time, run.energy.total + bottom, y_label="energy [J]")])


def _round_off(case: str, run: Any) -> float:
    """Relative error of the energy that round-off may make in a run of n steps: 10 √n ε, and n ε ω dt [-].

    The second is that of the rounded coefficients of a scheme, which is the same in every step.
    """
    numbers, steps = definition(case)["definition"], run.stats["steps"]
    turn = math.sqrt(numbers["g"] / numbers["L"]) * run.settings["dt"]
    return float(EPS * (10.0 * math.sqrt(steps) + steps * turn))


def _loss(case: str, integrator: Any, dt: float, run: Any) -> float:
    """Part of the energy that a small oscillation loses by the algorithmic damping [-]."""
    numbers = definition(case)["definition"]
    turn = math.sqrt(numbers["g"] / numbers["L"]) * dt
    return float(2.0 * spectrum(integrator, turn).damping * turn / dt * (run.time[-1] - run.time[0]))


def _higher(case: str, integrator: Any, run: Any, count: int, bottom: float) -> list[Figure]:
    """Of an order above 2: energy is not gained, lost as the order says, and the phase is that of the order.

    What the pendulum gains in phase because it swings less is no error of the phase.
    """
    from scipy.special import ellipk

    numbers, order = definition(case)["definition"], integrator.order()
    frequency, total = math.sqrt(numbers["g"] / numbers["L"]), run.energy.total + bottom
    turn, off = frequency * run.settings["dt"], total / total[0] - 1.0
    rate = 0.5 * math.pi * frequency / ellipk(total / (2.0 * bottom))  # of the phase, at the energy of each row
    gained = float(np.trapezoid(rate - rate[0], run.time))
    lag = math.remainder(_lag(case, run) + gained, 2.0 * math.pi)
    allowed = 2.0 * math.pi * count * turn**order
    return [
        Figure("energy gained, relative [-]", float(np.max(off)), _round_off(case, run)),
        Figure("energy lost, relative, over periods × (ω dt)^p × 2π [-]", float(np.max(-off)) / allowed, 1.0),
        Figure("phase error over periods × (ω dt)^p × 2π [-]", abs(lag) / allowed, HIGH_ORDER_PHASE_FACTOR),
    ]


def _stride(count: int) -> int:
    """Steps between rows: no divisor of a period, so that rows meet every phase of it."""
    return 101 if count > 10_000 else 7


def _kept(run: Any, bottom: float, usual: float) -> list[Figure]:
    """Energy at the end and on the way against what it does in the first periods."""
    total = run.energy.total + bottom
    off = total / total[0] - 1.0
    return [
        Figure("energy error at the end over the largest of the first periods [-]", abs(off[-1]) / usual, TIMES),
        Figure("largest energy error over the largest of the first periods [-]", np.max(np.abs(off)) / usual, TIMES),
    ]


def _phase(case: str, run: Any, begin: Any, count: int) -> list[Figure]:
    """Phase error at the end against that of one period, found from zero crossings of the first few."""
    numbers = definition(case)["definition"]
    lag, frequency = _lag(case, run), math.sqrt(numbers["g"] / numbers["L"])
    period = run.time[-1] / count
    found = falls(begin, "pivot.angle")
    one = (found[-1] - found[0]) / (len(found) - 1) / period - 1.0
    expected = 2.0 * math.pi * count * one
    return [
        Figure("phase error over periods × error of one × 2π, less 1 [-]", abs(lag / expected - 1.0), PHASE_FACTOR),
        Figure("relative error of the period over (ω dt)²/12, less 1 [-]",
               abs(one / ((frequency * period / STEPS_PER_PERIOD) ** 2 / 12.0) - 1.0), 0.5),
    ]  # fmt: skip


def _lag(case: str, run: Any) -> float:
    """Phase that the last row is behind the reference, a quarter of a period being π/2 [rad]."""
    from scipy.special import ellipk, ellipkinc

    numbers, top = definition(case)["definition"], definition(case)["initial_conditions"]["theta0"]
    k, frequency = math.sin(0.5 * top), math.sqrt(numbers["g"] / numbers["L"])
    # θ/2 = asin(k sin φ), and time runs as F(φ | k²)/ω: a phase that is uniform in time
    phi = np.unwrap(np.arctan2(np.sin(0.5 * run["pivot.angle"]) / k, run["pivot.angle.rate"] / (2.0 * k * frequency)))
    phase = 0.5 * math.pi * ellipkinc(phi, k * k) / ellipk(k * k)
    exact = math.sin(0.5 * float(quantity(case, "theta(").value)) / k  # sin φ after whole periods
    due = 0.5 * math.pi * ellipkinc(math.asin(exact), k * k) / ellipk(k * k) if abs(exact) <= 1.0 else math.nan
    return float(due - phase[-1])


def _falling(run: Any, bottom: float) -> list[Figure]:
    """Mean energies of the parts of the run; it wavers within a period, by what no scheme is to blame for."""
    parts = [float(np.mean(part)) for part in np.array_split(run.energy.total + bottom, BLOCKS)]
    return [Figure("parts of the run with more energy than the part before", int(np.sum(np.diff(parts) >= 0.0)), 0)]


def _rate(case: str, integrator: Any, dt: float, share: float, run: Any, limit: float) -> Figure:
    """Decay of the energy against exp(−4π ξ N), from the mean logarithms of the first and last part of the run.

    ξ is that of a linear oscillator as fast as the pendulum is at the energy of each part.
    """
    from scipy.special import ellipk

    numbers = definition(case)["definition"]
    bottom, frequency = numbers["m"] * numbers["g"] * numbers["L"], math.sqrt(numbers["g"] / numbers["L"])
    parts = np.array_split(np.arange(len(run)), BLOCKS)
    total = run.energy.total + bottom
    level = [float(np.mean(np.log(total[part]))) for part in parts]
    middle = [float(np.mean(run.time[part])) for part in parts]
    rates = []
    for each in level:
        square = math.exp(each) / (2.0 * bottom)  # k² = sin²(θ₀/2) = E/(2 m g L)
        found = spectrum(integrator, 0.5 * math.pi * frequency / ellipk(square) * dt)
        rates.append(2.0 * found.damping * math.atan2(found.principal.imag, found.principal.real) / dt)
    expected = float(np.trapezoid(rates, middle))
    what = "its amplitude" if share == 1.0 else f"{share:g} of its amplitude"
    return Figure(f"rate of decay from {what} over that of the algorithmic damping, less 1 [-]",
                  abs((level[0] - level[-1]) / expected - 1.0), limit)  # fmt: skip


REQUIREMENT = (
    "Undamped: energy bounded, phase error adds up; damped: energy falls at the rate of the algorithmic damping."
)

CASES = tuple(
    HardCase(
        id,
        REQUIREMENT,
        partial(judge_long_run, id),
        ("Newmark", "HHT", "generalized-alpha", "RadauIIA", "RungeKutta853"),
        slow,
        {"index 3": "not judged: there are no rows"},
        label=id.replace("-long-time", "").removesuffix("-periods"),
    )
    for id, slow in ((QUICK, False), (J12, True))
)
