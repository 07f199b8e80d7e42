"""This run beside a stored one."""

from __future__ import annotations

from benchmarks.figures import NOISY, Figure
from benchmarks.run import Record

WORSE = 1.15
"""A figure that has grown by more than this is flagged."""


def _change(now: Figure, then: Figure) -> float:
    """Growth of a figure in units of its yardstick, of its value where it has none."""
    if now.ratio is not None and then.ratio is not None:
        return now.ratio / then.ratio
    return now.value / then.value if then.value else 1.0


def regressions(now: Record, then: Record) -> list[str]:
    """Names of the figures that are more than 15 % worse."""
    old = {figure.name: figure for figure in then.figures}
    return [figure.name for figure in now.figures if figure.name in old and _change(figure, old[figure.name]) > WORSE]


def comparison(now: Record, then: Record) -> str:
    """The two side by side."""
    old = {figure.name: figure for figure in then.figures}
    worse = set(regressions(now, then))
    width = max(len(figure.name) for figure in now.figures)
    lines = [f"{'':<{width}}  {'baseline':>16}  {'now':>16}  change"]
    for figure in now.figures:
        before = old.get(figure.name)
        value = f"{figure.value:.4g} {figure.unit}"
        if before is None:
            lines.append(f"{figure.name:<{width}}  {'':>16}  {value:>16}  new")
            continue
        change = _change(figure, before)
        was = f"{before.value:.4g} {before.unit}"
        of = f" of the ratio to {figure.yardstick}" if figure.ratio and before.ratio else ""
        mark = "  WORSE" if figure.name in worse else ""
        noise = ", noisy" if mark and figure.spread > NOISY else ""
        lines.append(f"{figure.name:<{width}}  {was:>16}  {value:>16}  {change - 1.0:+7.1%}{of}{mark}{noise}")
    gone = set(old) - {figure.name for figure in now.figures}
    if gone:
        lines.append(f"{len(gone)} figures of the baseline were not measured now")
    if now.machine != then.machine:
        keys = [key for key in then.machine if not key.startswith("load") and now.machine.get(key) != then.machine[key]]
        lines += [f"{key}: {then.machine[key]} then, {now.machine.get(key)} now" for key in keys]
    return "\n".join(lines)
