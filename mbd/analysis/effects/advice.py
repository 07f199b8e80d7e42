"""Which effects may be left out, in plain words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mbd.analysis.effects.contribution import Contribution
    from mbd.analysis.effects.result import Effects

__all__ = ["advice"]


def advice(found: Effects) -> list[str]:
    """Sentences: what may go alone, what together, what came nearest; what ends the run otherwise."""
    if not found.complete:
        return ["The study was interrupted, so nothing is recommended."]
    alone = [each for each in found.contributions if each.change.within(found.tolerance)]
    said = _none(found) if not alone else [_alone(alone, found.tolerance), *_together(found, len(alone))]
    idle = [each.name for each in alone if each.change.identical]
    if idle:
        said.append(f"{_listed(idle)} {'does' if len(idle) == 1 else 'do'} nothing in this run, to the bit.")
    vital = [each for each in found.contributions if each.change.ends or each.change.failure]
    if vital:
        said.append(f"Without {_listed([each.name for each in vital], 'or')} the run ends otherwise.")
    return said


def _none(found: Effects) -> list[str]:
    """Why nothing may go."""
    limit = f"{found.tolerance:g} of its range"
    told = f"No effect may be left out: each changes an output by more than {limit}, or the events and their times"
    able = [each for each in found.contributions if each.change.telling and each.change.outputs]
    if able:
        best = min(able, key=lambda each: each.change.largest)
        return [f"{told}; least, by {best.change.largest:.2g}, {best.name!r}."]
    longest = max(found.contributions, key=lambda each: each.change.until)
    return [f"{told}. The events stay the same longest, until {longest.change.until:.4g} s, without {longest.name!r}."]


def _alone(alone: Sequence[Contribution], tolerance: float) -> str:
    names = _listed([f"{each.name!r} ({each.change.largest:.1g})" for each in alone], quote=False)
    return f"Alone, within {tolerance:g} of the range of every output, may be left out: {names}."


def _together(found: Effects, alone: int) -> list[str]:
    """The set that a run has shown to hold."""
    whole = found.together
    if whole is None:
        return []
    if len(whole.names) == 1:
        said = [f"Leave out {whole.names[0]!r}"]
    else:
        said = [f"Leave out {_listed(whole.names)} together: a run without them changes outputs by "
                f"{whole.change.largest:.1g}"]  # fmt: skip
    less = found.operations - whole.operations
    said[0] += f"; {less} of {found.operations} operations of a Newton iteration go"
    said[0] += " (contacts that are open take none anyway)." if less == 0 else "."
    if whole.back:
        said.append(f"{_listed(whole.back)} had to stay: beside the others the change was more than allowed.")
    return said


def _listed(names: Sequence[str], word: str = "and", quote: bool = True) -> str:
    """'a', 'b' and 'c'."""
    shown = [repr(name) if quote else name for name in names]
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} {word} {shown[-1]}"
