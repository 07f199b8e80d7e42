"""The processor that machine code is made for."""

import os
from collections.abc import Mapping
from functools import cache

import llvmlite.binding as llvm

from mbd.dataclass import dataclass
from mbd.errors import CapabilityError

TURNED_OFF = "MBD_CPU_FEATURES"
"""Environment variable: features of the processor that machine code is to do without, '-fma,-avx512f'."""


@dataclass(frozen=True)
class Host:
    """What the code is made for; part of the key of every object file.

    fused : whether there is a fused multiply-add instruction
    """

    triple: str
    cpu: str
    features: str
    llvm: str
    fused: bool


@cache
def host() -> Host:
    """This machine, without the features that `TURNED_OFF` names.

    Raises
    ------
    CapabilityError
        for a feature that is none of this processor, or one that is not to be turned off.
    """
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    try:
        features = llvm.get_host_cpu_features()
    except RuntimeError:  # LLVM does not know how to ask this processor
        features = llvm.FeatureMap()
    triple = llvm.get_process_triple()
    off = _turned_off(features)
    fused = (bool(features.get("fma")) and "fma" not in off) or triple.startswith(("aarch64", "arm64"))
    version = ".".join(map(str, llvm.llvm_version_info))
    flat = ",".join([features.flatten(), *(f"-{name}" for name in off)])  # the last word on a feature counts
    return Host(triple, llvm.get_host_cpu_name(), flat, version, fused)


def _turned_off(features: Mapping[str, bool]) -> list[str]:
    """Names of the features that the environment asks to do without."""
    asked = [word.strip() for word in os.environ.get(TURNED_OFF, "").split(",") if word.strip()]
    for word in asked:
        if not word.startswith("-") or word[1:] not in features:
            from difflib import get_close_matches  # for errors alone

            near = get_close_matches(word.lstrip("+-"), features, 3)
            hint = f"; did you mean {' or '.join(f'-{name}' for name in near)}?" if near else ""
            raise CapabilityError(
                f"{TURNED_OFF} lists features of this processor ({llvm.get_host_cpu_name()}) to do without, each with "
                f"a minus, such as '-fma'; it says {word!r}{hint}"
            )
    return [word[1:] for word in asked]
