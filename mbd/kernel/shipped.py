"""The kernel's object code that comes with a wheel: a first run on a machine that it suits builds nothing.

A release writes it for x86-64 processors of level 3 (AVX2 and FMA, since 2013) under Linux, by ``python -m
mbd.kernel.shipped``. It is used if the processor has these features and the sources of the kernel are those that it was
made from. A checkout has none; there, and on other machines, the kernel is built.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

from mbd.compile.host import Host, host
from mbd.errors import CapabilityError
from mbd.kernel import build

__all__ = ["OBJECT", "is_suitable", "load", "write"]

OBJECT = Path(__file__).parent / "objects" / "x86-64-v3-linux.object"
"""Where it lies: the sha256 of the sources' digest and of the code, then the code."""

LEVEL_3 = ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
"""Features of level 3 of x86-64 as LLVM names them (System V ABI, AMD64 supplement, section 3.1.1)."""


def is_suitable(here: Host) -> bool:
    """Whether a machine runs code for x86-64 of level 3 under Linux."""
    features = here.features.split(",")
    has_all = all(f"+{name}" in features and f"-{name}" not in features for name in LEVEL_3)
    return here.triple.startswith("x86_64") and "linux" in here.triple and has_all


def load() -> bytes | None:
    """The object code of the present kernel for this machine; None if there is none that is whole and suitable."""
    try:
        content = OBJECT.read_bytes()
    except OSError:
        return None
    seal, code = content[:32], content[32:]
    return code if is_suitable(host()) and seal == _sealed(code) else None


def write() -> Path:
    """Build it for the wheel.

    Raises
    ------
    CapabilityError
        on other machines than x86-64 under Linux, for whose kernels no place is known.
    """
    here = host()
    if not here.triple.startswith("x86_64") or "linux" not in here.triple:
        raise CapabilityError(f"the kernel of a wheel is built on x86-64 under Linux; this machine is {here.triple}")
    code = build.compiled(build.kernel_text(), replace(here, cpu="x86-64-v3", features=""), 2)
    OBJECT.parent.mkdir(exist_ok=True)
    OBJECT.write_bytes(_sealed(code) + code)
    return OBJECT


def _sealed(code: bytes) -> bytes:
    return sha256(build.source_digest().encode() + code).digest()


if __name__ == "__main__":
    print(write(), file=sys.stderr)
