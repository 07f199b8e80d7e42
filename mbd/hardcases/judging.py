"""Cases chosen by name, judged with their schemes, timed; an error of a judge is a verdict too."""

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import field

from mbd.dataclass import dataclass
from mbd.errors import ModelError, UnknownNameError, nearest
from mbd.hardcases.case import Figure, HardCase, Outcome
from mbd.hardcases.known import reason
from mbd.hardcases.schemes import SCHEMES, scheme
from mbd.notebook import paragraphs, table


@dataclass(frozen=True)
class Judged:
    """What one judge found with one scheme.

    reason : why it is known not to hold, '' where it should
    error : what stopped the judge, '' where it came to its end; seconds : of wall time
    """

    scheme: str
    outcome: Outcome
    seconds: float
    error: str = ""
    reason: str = ""

    @property
    def passed(self) -> bool:
        return not self.error and self.outcome.passed

    @property
    def worst(self) -> Figure | None:
        """The figure that comes nearest to its limit, or passes it the farthest."""
        return max(self.outcome.figures, key=ratio, default=None)


@dataclass(frozen=True)
class Verdict:
    """A case with all its schemes."""

    case: HardCase
    parts: Sequence[Judged] = field(default_factory=list)

    def _repr_html_(self) -> str:
        from mbd.hardcases.table import figure_text

        rows = [
            (
                part.scheme, part.error or (figure_text(part.worst) if part.worst is not None else "no figures"),
                "holds" if part.passed else "does not hold", f"{part.seconds:.2f}",
            )
            for part in self.parts
        ]  # fmt: skip
        title = f"{self.case.id}: {self.case.must}"
        return table(title, ("scheme", "nearest to its limit", "verdict", "time [s]"), rows) + paragraphs(self.reasons)

    @property
    def passed(self) -> bool:
        return bool(self.parts) and all(part.passed for part in self.parts)

    @property
    def seconds(self) -> float:
        return sum(part.seconds for part in self.parts)

    @property
    def worst(self) -> Judged:
        """The part that was stopped by an error, else the one with the worst figure."""
        stopped = [part for part in self.parts if part.error]
        return stopped[0] if stopped else max(self.parts, key=lambda part: ratio(part.worst))

    @property
    def word(self) -> str:
        """'holds', or 'does not hold' with the schemes, where not all are meant; `reasons` tells why.

        A scheme that holds although it is listed as one that does not is reported too.
        """
        failing = [part.scheme for part in self.parts if not part.passed]
        mended = [part.scheme for part in self.parts if part.passed and part.reason]
        texts = []
        if failing:
            texts.append("does not hold" + (f" with {', '.join(failing)}" if len(failing) < len(self.parts) else ""))
        if mended:
            texts.append(f"holds now with {', '.join(mended)}: take it from the list of what does not")
        return "; ".join(texts) or "holds"

    @property
    def reasons(self) -> list[str]:
        """Why it is known not to hold, each reason once."""
        return list(dict.fromkeys(part.reason for part in self.parts if part.reason and not part.passed))


def ratio(figure: Figure | None) -> float:
    """Value over limit: above 1 it fails; infinite where it is not a number or the limit is 0, −1 without a limit."""
    if figure is None or math.isnan(figure.value):
        return math.inf
    if not figure.is_judged:
        return -1.0
    if figure.limit > 0.0:
        return max(figure.value / figure.limit, 0.0)
    return 0.0 if figure.passed else math.inf


def short(case: HardCase) -> str:
    """'g1' of 'g1-bouncing-ball', or the label of a case that shares its beginning with another."""
    return case.label or case.id.partition("-")[0]


def chosen(cases: Sequence[HardCase], names: Sequence[str], slow: bool) -> list[HardCase]:
    """The cases that names stand for, in the order of the registry; without names all but the slow ones.

    A name is an id, its beginning ('g1'), a group ('g'), or any part of ids ('pendulum').
    """
    if not names:
        return [case for case in cases if slow or not case.slow]
    found: list[HardCase] = []
    faults = []
    for name in names:
        word = name.lower()
        exact = [case for case in cases if word in (case.id.lower(), short(case).lower(), case.id.partition("-")[0])]
        part = [case for case in cases if (case.id.startswith(word) if len(word) == 1 else word in case.id.lower())]
        found += exact or part
        if not exact and not part:
            faults.append(nearest(name, [short(case) for case in cases], "hard case", "There are"))
    if faults:
        raise UnknownNameError(faults)
    return [case for case in cases if case in found]


def named_schemes(names: Iterable[str] | None) -> tuple[str, ...] | None:
    """Schemes as the list spells them, or an error that offers the nearest; None for all that a case asks for."""
    if not names:
        return None
    for name in names:
        scheme(name)
    spelled = {name.lower(): name for name in SCHEMES}
    return tuple(spelled[name.lower()] for name in names)


def with_schemes(case: HardCase, only: Sequence[str] | None) -> list[str]:
    """The schemes to judge a case with."""
    return [name for name in case.schemes if only is None or name in only]


def judged(case: HardCase, only: Sequence[str] | None = None, between: Callable[[], bool] | None = None) -> Verdict:
    """The verdict on a case; before each scheme `between` says whether to stop there."""
    names = with_schemes(case, only)
    if not names:
        raise ModelError(
            f"'{case.id}' is not judged with {', '.join(only or ())}; it is with {', '.join(case.schemes)}"
        )
    parts = []
    for name in names:
        if between is not None and between():
            break
        began = time.perf_counter()
        outcome, error = Outcome([]), ""
        try:
            outcome = case.judge(scheme(name))
        except Exception as problem:  # whatever stops a judge is what the table must say
            error = f"{type(problem).__name__}: {problem}"
        parts.append(Judged(name, outcome, time.perf_counter() - began, error, reason(case.id, name)))
    return Verdict(case, parts)
