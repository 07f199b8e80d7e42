"""Errors: what was expected, what came, where in the user's words, and what to try."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any


class MbdError(Exception):
    """Base of every error that `mbd` raises on purpose."""


class MbdWarning(UserWarning):
    """What is possible but was hardly meant, or costs more than expected; `warnings.filterwarnings` silences it."""


class TraceError(MbdError, TypeError):
    """A traced function did something that cannot be recorded (a Python ``if`` on a traced value, …)."""


class ModelError(MbdError, ValueError):
    """A model that cannot be simulated; `faults` lists every problem found, one sentence each."""

    def __init__(self, faults: str | Sequence[str]) -> None:
        self.faults: tuple[str, ...] = (faults,) if isinstance(faults, str) else tuple(faults)
        count = len(self.faults)
        every = "\n".join(f"  - {fault}" for fault in self.faults)
        super().__init__(self.faults[0] if count == 1 else f"{count} faults:\n{every}")

    def __reduce__(self) -> tuple[type[ModelError], tuple[tuple[str, ...]]]:
        return type(self), (self.faults,)


class UnknownNameError(ModelError):
    """A name that the model does not have; the message offers the nearest valid ones."""


class AssemblyError(ModelError):
    """Initial values that no motion of the mechanism satisfies."""


class CapabilityError(ModelError):
    """A combination of integrator, formulation and constraint that cannot be honoured.

    Attributes
    ----------
    run : the run whose derivatives, asked for by wrt=, are not known; else None
    """

    run: Any = None


class OneSidedError(CapabilityError):
    """A run that has derivatives on one side only.

    Attributes
    ----------
    sides : {(of, wrt): (below, above)}: both one-sided values by runs on that side alone, NaN where none can be made;
        of a result that jumps those of its two parts
    """

    sides: Mapping[tuple[str, str], tuple[float, float]] = {}


class SimulationError(MbdError, RuntimeError):
    """A run that could not go on; `run` keeps everything computed until then."""

    def __init__(self, message: str, run: Any = None) -> None:
        super().__init__(message)
        self.run = run


class MemoryLimitError(SimulationError):
    """A run whose rows would not fit into memory; `run` has those computed until then."""


class GaitError(MbdError, RuntimeError):
    """A walk that does not repeat itself: it falls, scuffs, misses its event, or no search converged.

    `gait` keeps what was computed: the last state, the outcome of every attempt, a run that shows it.
    """

    def __init__(self, message: str, gait: Any = None) -> None:
        super().__init__(message)
        self.gait = gait


class TrajectoryError(MbdError, ValueError):
    """A question that a run cannot answer: a time outside it, a file that is none."""


MEANT = {
    "position place location": ("", "x", "origin", "displacement", "angle"),
    "velocity speed": ("vx", "x.rate", "rate", "displacement.rate", "origin.vx", "angular_velocity"),
    "acceleration": ("ax", "x.acceleration", "angle.acceleration", "displacement.acceleration"),
    "rotation quaternion attitude pose": ("orientation", "orientation.w", "rotation_vector", "angle"),
    "omega spin rate": ("angular_velocity", "angular_velocity.x"),
    "angle angles euler": ("flexion", "dorsiflexion", "first", "euler.zxy.1", "rotation_vector", "orientation"),
    "flexion extension rotation_angle": ("angle", "euler.zxy.1"),
    "abduction": ("adduction",),
    "com cog cm mass_center": ("center",),
    "moment torque": ("torque", " loss.torque", " spring.torque", "net_moment", "reaction_torque"),
    "force load": (" loss.force", " spring.force", "reaction_force", "tension", "torque", "multiplier"),
    "gap": ("residual",),
    "loss damping": (
        " loss.coefficient", " loss.torque", " loss.viscous.coefficient", " loss.coulomb.torque", "friction",
    ),
    "stiffness spring": (" spring.stiffness", " spring.torque"),
    "reaction": ("reaction_force",),
    "world global": ("ground", "ground.x"),
    "x": ("origin.x", "displacement"), "y": ("origin.y", "displacement"), "z": ("origin.z", "displacement"),
}  # fmt: skip
"""What is meant by the last word of a name that there is not: last words of names that there may be, or their ends."""

COMPONENT = re.compile(r"(.*)\.[wxyz123](\..*)?")
"""The components of what may be one name too, and what they have."""

SHOWN = 12
"""Names that are listed of many."""


def quoted(names: Iterable[str], most: int = 6) -> str:
    """Some names for a message, each once, and how many more there are.

    >>> quoted(["hip", "knee", "hip", "ankle"], 2)
    "'hip', 'knee' and 1 more"
    """
    once = list(dict.fromkeys(names))
    return ", ".join(map(repr, once[:most])) + (f" and {len(once) - most} more" if once[most:] else "")


def nearest(
    name: str, valid: Iterable[str], kind: str = "name", known: str = "The model has", beside: Iterable[str] = ()
) -> str:
    """The sentence that offers valid names for a wrong one; `known` introduces the list of them.

    beside : names that are offered where they are near, and not listed

    >>> nearest("left hop", ["left hip", "left knee"], "joint")
    "no joint named 'left hop'; did you mean 'left hip'? The model has 'left hip', 'left knee'"
    >>> nearest("hip.angle", ["left hip.angle", "right hip.angle"], "result", "The run has").split("; ")[1]
    "did you mean 'left hip.angle' or 'right hip.angle'? The run has 'left hip.angle', 'right hip.angle'"
    """
    names, text = sorted(set(valid)), str(name)
    parts = [each for each in names if each.startswith(f"{text}.")]
    if parts:
        return f"no {kind} named {name!r}; it has {_listed(parts)}"
    close = _guesses(text, sorted({*names, *beside}))
    owners = {f"{each.rpartition('.')[0]}." for each in (text, *close)} - {"."}
    if len(names) > SHOWN:
        names = [each for each in names if each.startswith(tuple(owners))] or names
    guess = f"; did you mean {' or '.join(map(repr, close))}?" if close else ";"
    known = known if close else known[0].lower() + known[1:]
    has = f" {known} {_listed(names)}" if names else f" {known} none"
    return f"no {kind} named {name!r}{guess}{has}"


def _guesses(text: str, names: Sequence[str]) -> list[str]:
    """What a wrong name may stand for: another spelling, a side left out, another word for it, a slip."""
    plain = text.casefold().replace("_", " ")
    found = [each for each in names if each.casefold().replace("_", " ") == plain]
    found = found or [each for each in names if each.endswith(f" {text}")][:4]
    owner, _, last = text.rpartition(".")
    if not found and owner:
        for words, others in MEANT.items():
            if last.casefold() in words.split():
                meant = (f"{owner}{'' if other[:1] in ('', ' ') else '.'}{other}" for other in others)
                found += [each for each in meant if each in names][:3]
    if found:
        return found
    from difflib import get_close_matches  # for errors alone

    own = [each for each in names if each.startswith(f"{owner}.")] if owner else []
    return get_close_matches(text, own, n=1, cutoff=0.8) or get_close_matches(text, names, n=1, cutoff=0.6)


def _listed(names: Sequence[str]) -> str:
    """The first names of a list, vectors for their components, and how many there are; of many those before dots."""
    known = set(names)
    short = [each for each in names if not ((part := COMPONENT.fullmatch(each)) and part[1] in known)]
    owners = list(dict.fromkeys(each.partition(".")[0] + "." * ("." in each) for each in short))
    if len(short) > 8 * SHOWN and 1 < len(owners) < len(short) // 4:
        few = [repr(each.replace(".", ".…")) for each in owners[: 2 * SHOWN]]
        return f"{', '.join(few)}{', …' * (len(owners) > 2 * SHOWN)} ({len(names)} names in all)"
    return ", ".join(map(repr, short[:SHOWN])) + (f", … ({len(names)} in all)" if len(short) > SHOWN else "")
