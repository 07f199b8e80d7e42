"""What a check found: which laws hold, and the first posture at which each of the others is broken."""

from __future__ import annotations

from dataclasses import field
from typing import Any

import numpy as np

from mbd.dataclass import dataclass


class LawBroken(AssertionError):
    """A law of mechanics that a class does not keep; `laws` are the names of all the broken ones."""

    def __init__(self, message: str, laws: tuple[str, ...] = ()) -> None:
        super().__init__(message)
        self.laws = laws

    def __reduce__(self) -> tuple[type[LawBroken], tuple[str, tuple[str, ...]]]:
        return type(self), (str(self), self.laws)


@dataclass(frozen=True)
class Verdict:
    """The laws that hold, each with how often it was tried; `notes` say what could not be tried, and why."""

    subject: str
    laws: dict[str, int]
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        lines = [f"{self.subject}: {len(self.laws)} laws hold"]
        lines += [f"  {law} ({count}×)" for law, count in self.laws.items()]
        return "\n".join(lines + [f"  not tried: {note}" for note in self.notes])


@dataclass
class Findings:
    """Collects comparisons; `verdict` raises if one failed.

    subject : what is checked, as messages call it
    where : the posture tried now, with the seed that makes it
    """

    subject: str
    where: str = ""
    tried: dict[str, int] = field(default_factory=dict)
    broken: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def equal(
        self, law: str, what: str, found: Any, expected: Any, hint: str, tolerance: float = 1e-9, size: Any = 0.0
    ) -> bool:
        """Whether ``|found − expected| ≤ tolerance (1 + |expected| + size)``; size: of the terms that cancel."""
        now, wanted = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
        if now.shape != wanted.shape and wanted.ndim:
            return self.holds(law, False, f"{what}: {wanted.size} numbers expected, {now.size} found", hint)
        wanted = np.broadcast_to(wanted, now.shape)
        limit = tolerance * (1.0 + np.abs(wanted) + np.max(np.abs(size), initial=0.0))
        with np.errstate(invalid="ignore"):
            wrong = ~(np.abs(now - wanted) <= limit)
        if not wrong.any():
            return self.holds(law, True, "", hint)
        with np.errstate(invalid="ignore", divide="ignore"):
            misses = np.where(wrong, np.nan_to_num(np.abs(now - wanted) / limit, nan=np.inf), 0.0)
        place = np.unravel_index(int(np.argmax(misses)), now.shape) if now.ndim else ()
        entry = f" entry {', '.join(str(int(k)) for k in place)}" if now.size > 1 else ""
        sentence = f"{what}{entry}: expected {wanted[place]:.10g}, found {now[place]:.10g}"
        return self.holds(law, False, f"{sentence} (tolerance {limit[place]:.1g})", hint)

    def holds(self, law: str, truth: bool, sentence: str, hint: str) -> bool:
        """Note one trial of a law; the sentence tells what was found where it is broken."""
        self.tried[law] = self.tried.get(law, 0) + 1
        if not truth and law not in self.broken:
            place = f"\n      at {self.where}" if self.where else ""
            self.broken[law] = f"{law}\n      {sentence}{place}\n      {hint}"
        return truth

    def note(self, sentence: str) -> None:
        """Say once what could not be tried."""
        if sentence not in self.notes:
            self.notes.append(sentence)

    def verdict(self) -> Verdict:
        """The laws that hold, or a `LawBroken` that lists every broken one."""
        if self.broken:
            count = len(self.broken)
            head = f"{self.subject} breaks {count} law{'s' if count > 1 else ''} of {len(self.tried)} tried:"
            raise LawBroken("\n".join([head, *(f"  - {text}" for text in self.broken.values())]), tuple(self.broken))
        if not self.tried:
            raise LawBroken(f"{self.subject}: nothing was tried" + "".join(f"; {note}" for note in self.notes))
        return Verdict(self.subject, self.tried, tuple(self.notes))
