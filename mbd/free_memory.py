"""How much memory this process may still take, and when it is not searched for what nobody needs."""

import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ASSUMED_BYTES = 4.0e9
"""Taken for the free memory where the system does not tell it [bytes]."""
PROC, CGROUPS = Path("/proc"), Path("/sys/fs/cgroup")
"""Where Linux tells what it has, and what it allows to groups of processes."""


def available() -> float:
    """Free memory [bytes]: what the system has, and no more than limits of control groups and of the process leave."""
    return max(min(_of_system(), _of_groups(), _of_process()), 0.0)


@contextmanager
def no_collection() -> Iterator[None]:
    """Without the search for cycles of objects, which takes up to a third of the time of making many that have none."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


def size_in_words(size: float) -> str:
    """'3.2 GB' or '45 MB'."""
    return f"{size / 1e9:.2g} GB" if size >= 1e9 else f"{max(size / 1e6, 1.0):.0f} MB"


def _of_system() -> float:
    """Free memory with what the system would give back at once."""
    try:
        for line in (PROC / "meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * float(line.split()[1])
        return float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (OSError, ValueError, AttributeError):
        return ASSUMED_BYTES


def _of_groups() -> float:
    """What the control groups of this process, and those around them, have left."""
    left = float("inf")
    try:
        groups = (PROC / "self" / "cgroup").read_text().splitlines()
    except OSError:
        return left
    for line in groups:
        _, controllers, place = (*line.split(":", 2), "", "")[:3]
        if controllers == "":
            base, limit, usage, cached = CGROUPS, "memory.max", "memory.current", "inactive_file"
        elif "memory" in controllers.split(","):
            base, limit, usage, cached = (
                CGROUPS / "memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file",
            )  # fmt: skip
        else:
            continue
        parts = [part for part in place.split("/") if part not in ("", "..")]
        for depth in range(len(parts), -1, -1):  # a container sees its own group as the root
            left = min(left, _left_in(base.joinpath(*parts[:depth]), limit, usage, cached))
    return left


def _left_in(group: Path, limit: str, usage: str, cached: str) -> float:
    """What one group has left, with pages of files that the system would give back."""
    try:
        most = (group / limit).read_text().strip()
        if most == "max" or int(most) >= (1 << 60):  # limits above are none
            return float("inf")
        used = int((group / usage).read_text())
    except (OSError, ValueError):
        return float("inf")
    try:
        lines = (group / "memory.stat").read_text().splitlines()
        used -= sum(int(line.split()[1]) for line in lines if line.split()[:1] == [cached])
    except (OSError, ValueError, IndexError):
        pass
    return float(int(most) - used)


def _of_process() -> float:
    """What the limits on the address space and the data of the process leave."""
    left = float("inf")
    try:
        import resource

        pages = (PROC / "self" / "statm").read_text().split()
    except (ImportError, OSError):
        return left
    page = os.sysconf("SC_PAGE_SIZE")
    for kind, place in ((resource.RLIMIT_AS, 0), (resource.RLIMIT_DATA, 5)):
        most, _ = resource.getrlimit(kind)
        if most != resource.RLIM_INFINITY:
            left = min(left, float(most) - page * float(pages[place]))
    return left
