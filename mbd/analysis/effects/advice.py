"""Which effects may be left out, in plain words."""

from __future__ import annotations

from collections.abc import Sequence

from mbd.analysis.effects.contribution import Contribution, Together

__all__ = ["advice"]


def advice(
    contributions: Sequence[Contribution], together: Together | None, tolerance: float, operations: int
) -> list[str]:
    """Sentences: what may go alone, what together, what came nearest; what ends the run otherwise.

    operations : of a Newton iteration of the whole scene
    """
    alone = [each for each in contributions if each.change.within(tolerance)]
    if alone:
        sentences = [_alone(alone, tolerance), *(_together(together, operations) if together is not None else ())]
    else:
        sentences = [_none(contributions, tolerance)]
    idle = [each.name for each in alone if each.change.identical]
    if idle:
        sentences.append(f"{_listed(idle)} {'does' if len(idle) == 1 else 'do'} nothing in this run, to the bit.")
    vital = [each for each in contributions if each.change.ends or each.change.failure]
    if vital:
        sentences.append(f"Without {_listed([each.name for each in vital], 'or')} the run ends otherwise.")
    return sentences


def _none(contributions: Sequence[Contribution], tolerance: float) -> str:
    """Why nothing may go."""
    limit = f"{tolerance:g} of its range"
    text = f"No effect may be left out: each changes an output by more than {limit}, or the events and their times"
    able = [each for each in contributions if each.change.telling and each.change.outputs]
    if able:
        best = min(able, key=lambda each: each.change.largest)
        return f"{text}; least, by {best.change.largest:.2g}, {best.name!r}."
    longest = max(contributions, key=lambda each: each.change.until)
    return f"{text}. Removing {longest.name!r} changes the events last, at {longest.change.until:.4g} s."


def _alone(alone: Sequence[Contribution], tolerance: float) -> str:
    names = _listed([f"{each.name!r} ({each.change.largest:.1g})" for each in alone], quote=False)
    return f"Alone, within {tolerance:g} of the range of every output, may be left out: {names}."


def _together(whole: Together, operations: int) -> list[str]:
    """The set that a run has shown to hold."""
    if len(whole.names) == 1:
        sentences = [f"Leave out {whole.names[0]!r}"]
    else:
        sentences = [f"Leave out {_listed(whole.names)} together: a run without them changes outputs by "
                f"{whole.change.largest:.1g}"]  # fmt: skip
    less = operations - whole.operations
    sentences[0] += f"; {less} of {operations} operations of a Newton iteration go"
    sentences[0] += " (contacts that are open take none anyway)." if less == 0 else "."
    if whole.back:
        sentences.append(f"{_listed(whole.back)} had to stay: beside the others the change was more than allowed.")
    return sentences


def _listed(names: Sequence[str], word: str = "and", quote: bool = True) -> str:
    """'a', 'b' and 'c'."""
    shown = [repr(name) if quote else name for name in names]
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} {word} {shown[-1]}"
