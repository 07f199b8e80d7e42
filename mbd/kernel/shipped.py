"""The kernel's object code that comes with a wheel: a first run on a machine that it suits builds nothing.

A release writes it by ``python -m mbd.kernel.shipped`` for Linux on x86-64 processors of level 3 (AVX2 and FMA, since
2013) and on all arm64 processors; LLVM makes both on any machine. It is used if the processor has these features
and the sources of the kernel are those that it was made from. A checkout has none; there, and on other machines, the
kernel is built.
"""

import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

from mbd.compile.host import Host, host
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError
from mbd.kernel import build

FOLDER = Path(__file__).parent / "objects"
"""Where they lie: of each the sha256 of the sources' digest and of the code, then the code."""

LEVEL_3 = ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
"""Features of level 3 of x86-64 as LLVM names them (System V ABI, AMD64 supplement, section 3.1.1)."""


@dataclass(frozen=True)
class Target:
    """A kind of machine that the wheel has a kernel for.

    name : that of its file
    architecture : of its triple under Linux
    cpu : what LLVM calls the least of its processors
    features : what a processor must have
    """

    name: str
    architecture: str
    cpu: str
    features: tuple[str, ...] = ()

    @property
    def path(self) -> Path:
        """Its file."""
        return FOLDER / f"{self.name}.object"

    def suits(self, here: Host) -> bool:
        """Whether a machine runs its code."""
        features = here.features.split(",")
        has_all = all(f"+{name}" in features and f"-{name}" not in features for name in self.features)
        return here.triple.startswith(self.architecture) and "linux" in here.triple and has_all


TARGETS = (Target("x86-64-v3-linux", "x86_64", "x86-64-v3", LEVEL_3), Target("arm64-linux", "aarch64", "generic"))
"""All of them."""


def load() -> bytes | None:
    """The object code of the present kernel for this machine; None if there is none that is whole and suitable."""
    target = next((target for target in TARGETS if target.suits(host())), None)
    try:
        content = b"" if target is None else target.path.read_bytes()
    except OSError:
        return None
    seal, code = content[:32], content[32:]
    return code if code and seal == _sealed(code) else None


def write() -> Iterator[Path]:
    """Build them for the wheel.

    Raises
    ------
    CapabilityError
        where this LLVM does not make code for one of them.
    """
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    text = build.kernel_text()
    FOLDER.mkdir(exist_ok=True)
    for target in TARGETS:
        machine = Host(f"{target.architecture}-unknown-linux-gnu", target.cpu, "", "", True)
        try:
            code = build.compiled(text, machine, 2)
        except RuntimeError as error:
            raise CapabilityError(f"LLVM makes no code for {target.name} here: {error}") from error
        target.path.write_bytes(_sealed(code) + code)
        yield target.path


def _sealed(code: bytes) -> bytes:
    return sha256(build.source_digest().encode() + code).digest()


if __name__ == "__main__":
    for written in write():
        print(written, file=sys.stderr)
