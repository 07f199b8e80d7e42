"""What a state remembers, judged before any of it reaches the kernel, which takes indices as they come.

A memory may have been read from a file, or put together by hand. Its kind and lengths must be those of the run; every
flag and index must lie where the kernel itself puts them; and the seal, a hash of all numbers, tells of any other
change.
"""

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbd.kernel import codes
from mbd.kernel.contact.cones import HOLD_AT_ONSET, HOLD_DIRECTION
from mbd.kernel.records import TABLE, Kernel
from mbd.simulation.run.data import RunData
from mbd.state import Memory, Mode, are_names

NO_LIMIT = 1 << 53
"""Most that is counted of anything [-]."""
ENDLESS = ("sinking", "left")
"""Arrays that may hold infinities where nothing has happened yet."""
OPEN_TIMES = [TABLE.places[name][1] for name in ("last_switch", "singular_time")]
"""Places in `clock` that may be infinite."""
FLAGS = {
    "closed": (0, 1), "armed": (-1, 2), "touched": (0, 1), "dropped": (0, 1), "sticks": (0, 1), "loose": (0, 3),
    "passing": (0, 2),
}  # fmt: skip
"""Least and largest value of each flag that is kept."""


def sealed(memory: Memory) -> Memory:
    """A memory that was just made, from now on with its seal."""
    vars(memory)["seal"] = _seal(memory)
    return memory


def _seal(memory: Memory) -> str:
    """Hash of what the kernel and the clocks of controllers go on from."""
    digest = hashlib.sha256(repr((memory.belongs, memory.digest, memory.time, memory.pending)).encode())
    digest.update(repr(sorted(memory.mode.closed)).encode())
    digest.update(repr((memory.controllers.get("begin"), sorted(dict(memory.controllers["samples"]).items()))).encode())
    for array in (memory.parameters, memory.reals, memory.integers, memory.place, memory.anchors):
        digest.update(array.tobytes())
    return digest.hexdigest()


def damage(memory: Memory) -> str:
    """Why a memory cannot be what a run has written, in a few words; '' if it can."""
    for name, kind in (
        ("parameters", float),
        ("reals", float),
        ("integers", np.int64),
        ("place", float),
        ("anchors", float),
    ):
        array = getattr(memory, name)
        if not isinstance(array, np.ndarray) or array.ndim != 1 or array.dtype != kind:
            return f"its {name} are no array of numbers"
    words = isinstance(memory.belongs, tuple) and all(isinstance(word, str) for word in memory.belongs)
    words = words and isinstance(memory.digest, str) and isinstance(memory.seal, str) and _are_pairs(memory.pending)
    if not words or not isinstance(memory.time, float):
        return "its words are none"
    if not isinstance(memory.mode, Mode) or not are_names(memory.mode.closed):
        return "its closed contacts are no names"
    if not _are_samples(memory.controllers):
        return "what it holds of controllers is nothing that a run has written"
    return "" if memory.seal == _seal(memory) else "it was changed after the run had written it"


def _are_pairs(pending: Any) -> bool:
    """Whether these are (kind, name) pairs."""
    return isinstance(pending, tuple) and all(
        isinstance(pair, tuple) and len(pair) == 2 and all(isinstance(word, str) for word in pair) for pair in pending
    )


def _are_samples(given: Any) -> bool:
    """Whether this is what `Boundaries.remembered` gives: the instant samples count from, their numbers, states."""
    if not isinstance(given, Mapping) or not {"begin", "samples", "states"} <= set(given):
        return False
    samples, states = given["samples"], given["states"]
    counted = isinstance(samples, Mapping) and all(
        isinstance(name, str) and isinstance(count, int) and 0 <= count < NO_LIMIT for name, count in samples.items()
    )
    return (
        counted
        and isinstance(states, Mapping)
        and isinstance(given["begin"], int | float)
        and bool(np.isfinite(given["begin"]))
    )


def out_of_range(run: RunData, memory: Memory) -> str:
    """What of a memory no run of this mechanism could have left, in a few words; '' if nothing.

    `memory` has passed `damage`, and its lengths are asked first; then its numbers lie in the kernel's arrays, where
    they are judged by name.
    """
    stepper, controllers = run.stepper, run.boundaries.controllers
    if len(memory.reals) != len(stepper.reals) or len(memory.integers) != len(stepper.integers):
        return "it has the numbers of another mechanism"
    if len(memory.parameters) != len(run.kernel.params):
        return "it has the parameters of another mechanism"
    sampled = {c.name for c in controllers if c.period is not None}
    if set(memory.controllers["samples"]) != sampled or set(memory.controllers["states"]) != {
        c.name for c in controllers
    }:
        return "it has the samples of other controllers"
    if stepper.compiled and memory.scheme is not None:
        return "it has the memory of another scheme"
    kept = {name: memory.reals[stepper.place_of(name)] for name in TABLE.kept_reals}
    kept |= {name: memory.integers[stepper.place_of(name)] for name in TABLE.kept_integers}
    return _judged(Kernel(**kept), memory, run)


def _judged(kept: Kernel, memory: Memory, run: RunData) -> str:
    """Flags, indices, counts and times of a memory of the right lengths."""
    for name, (least, most) in FLAGS.items():
        if not _within(getattr(kept, name), least, most):
            return f"{name!r} is none of {least} … {most}"
    if not np.all((kept.was == codes.NOT_KNOWN_YET) | ((kept.was >= -1) & (kept.was <= 2))):
        return "'was' is no state of a friction"
    for name in ("slip", "side", "lean"):
        signs = getattr(kept, name)
        if name != "side" and run.kernel.n_cones > 0:  # cosines
            signs = signs[run.kernel.group_size[: run.kernel.n_frictions] == 1]
            if not np.all(np.abs(getattr(kept, name)) <= 1.0):
                return f"{name!r} is no direction"
        if not np.all(np.isin(signs, (-1.0, 0.0, 1.0))):
            return f"{name!r} is no sign"
    if not np.all(np.isin(kept.hold, (0.0, HOLD_AT_ONSET, HOLD_DIRECTION))):
        return "'hold' is nothing that frictions do"
    for name, (least, most) in _of_state(run.kernel).items():
        value = getattr(kept, name)
        if not least <= value <= most:
            return f"{name!r} is {value}, not {least} … {most}"
    return _rows_differ(kept, run) or _times_differ(kept, memory, run.kernel)


def _of_state(v: Kernel) -> dict[str, tuple[int, int]]:
    """Least and largest value of each number in `state`; those of rows and lines of results are set to 0 anyway."""
    # columns of rows come after those of velocities; transitions are numbered as guards are
    indices = v.n + max(v.n_rows, v.n_contacts, v.n_frictions, v.n_guards)
    return {
        "n_active": (0, v.n_rows), "grid_steps": (0, NO_LIMIT), "restart_due": (0, 2), "n_switches": (0, NO_LIMIT),
        "steps_since_row": (0, NO_LIMIT), "failure_index": (-1, indices), "n_dropped": (0, v.n_rows),
        "near_singular": (0, 2), "short_steps": (0, NO_LIMIT), "n_repeats": (0, NO_LIMIT), "plastic_impact": (0, 1),
        "halvings": (0, 16), "halves_left": (0, 1 << 17), "paired_step": (0, 3), "in_substeps": (0, 1),
        "scales_raised": (0, 1), "scales_of_start": (0, 1), "restarted_here": (0, 1), "fallback": (0, 2),
        "estimates_twice": (0, 1),
    }  # fmt: skip


def _rows_differ(kept: Kernel, run: RunData) -> str:
    """Whether the rows of the next step are other than those of the closed contacts and sticking frictions."""
    v, dropped = run.kernel, kept.dropped[: run.kernel.n_rows]
    if int(kept.n_dropped) != int(np.sum(dropped)):
        return "'dropped' does not agree with its count"
    if kept.restart_due != 0:  # they are found again
        return ""
    held = run.manager.active_rows(kept.closed[: v.n_contacts], kept.sticks[: v.n_frictions])
    rows = [row for row in held if not dropped[row]]
    if int(kept.n_active) != len(rows) or not np.array_equal(kept.rows[: len(rows)], rows):
        return "'rows' are not those of the closed contacts"
    return ""


def _times_differ(kept: Kernel, memory: Memory, v: Kernel) -> str:
    """Whether numbers are not finite, or the clock does not agree with the time of the memory."""
    for name in TABLE.kept_reals:
        values = getattr(kept, name)
        finite = np.delete(values, OPEN_TIMES) if name == "clock" else values
        if np.any(np.isnan(values)) or (name not in ENDLESS and not np.all(np.isfinite(finite))):
            return f"{name!r} is not finite"
    step = float(kept.step)
    longest = v.longest if v.adaptive else v.dt
    if not 0.0 < step <= longest * (1.0 + 1e-9):
        return f"its step is {step:.3g} s"
    if abs(kept.time - memory.time) > 1e-6 * step + 1e-12 * abs(memory.time):
        return "its clock is at another time"
    ahead = float(kept.grid_start) + (int(kept.grid_steps) + 1) * step - memory.time
    if kept.paired_step != 2 and kept.restart_due == 0 and not 0.0 < ahead < 2.5 * step:
        return "its grid is elsewhere"
    return ""


def _within(values: Any, least: int, most: int) -> bool:
    return bool(np.all((values >= least) & (values <= most)))
