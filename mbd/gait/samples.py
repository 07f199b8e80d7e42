"""Gaits beside samples that come at instants of their own: period and samples must be commensurate.

The time to the next sample is part of the state. It comes back where the period of the gait is a whole number of sample
periods: the walk falls in with its samples, as an oscillator is entrained by a clock of nearly its own frequency.
"""

from dataclasses import replace
from typing import Any

from mbd.constraints.sampled_law import SampledLaw
from mbd.gait.outcome import Outcome
from mbd.gait.return_map import ReturnMap, Values
from mbd.state import State

MAX_STRIDES, MAX_MISSING = 12, 0.03
"""Strides up to which a whole number of samples is looked for, and the part of one that may be missing [-]."""
COUNTED_RETURNS = 8
"""Returns over which the samples of one are counted [-]."""


def free_samples(model: Any) -> list[SampledLaw]:
    """Sampled laws whose samples no event restarts."""
    machines = getattr(model, "machines", ())
    return [law for law in machines if isinstance(law, SampledLaw) and not law.restart_on]


def explain_samples(outcome: Outcome, map_: ReturnMap, state: State, values: Values) -> Outcome:
    """The outcome of a search that found no gait, with what samples at instants of their own have to do with it."""
    laws = free_samples(map_.model)
    if not laws or outcome.good:
        return outcome
    arrival = map_(state, values, strides=COUNTED_RETURNS)
    if not arrival.outcome.good:
        return outcome
    lasts, texts = arrival.period / COUNTED_RETURNS, []
    for law in laws:
        name = f"{law.name}.period"
        period = float({**getattr(map_.model, "parameters", {}), **map_.plain(values)}.get(name, law.period))
        count = lasts / period
        whole = [n for n in range(1, MAX_STRIDES + 1) if abs(n * count - round(n * count)) <= MAX_MISSING]
        cures = [f"{name!r} = {lasts / max(round(count), 1):.6g} s"]
        cures += [f"strides={whole[0]}"] if whole and whole[0] != map_.strides else []
        texts.append(
            f"samples of {law.name!r} come every {period:.6g} s, {count:.6g} of them in a return of "
            f"{lasts:.6g} s, where a gait needs a whole number; try {' or '.join(cures)}, or restart_on=, the "
            "event with which they begin again"
        )
    return replace(outcome, text="; ".join([outcome.text, *texts]))
