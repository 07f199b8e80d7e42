"""Machine code or plain Python: the one place that decides."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from importlib.util import find_spec
from typing import Protocol

from mbd.arrays import Vector
from mbd.compile.cache import ObjectCache
from mbd.compile.functions import ByName
from mbd.compile.layout import Layout
from mbd.compile.python import ScalarFunction
from mbd.dataclass import dataclass
from mbd.errors import CapabilityError, UnknownNameError, nearest
from mbd.tape.node import Node

LEVEL = "MBD_OPTIMIZATION_LEVEL"
"""Environment variable: optimization level of machine code, '0' where programs are many and runs are short."""


class Function(Protocol):
    """A program that can be called.

    address : of its machine code, 0 if it is plain Python
    size : number of outputs
    provisional : whether faster machine code with the same results is being made and will change the address
    """

    @property
    def name(self) -> str: ...
    @property
    def address(self) -> int: ...
    @property
    def size(self) -> int: ...
    @property
    def provisional(self) -> bool: ...
    def __call__(self, block: Vector, parameters: Vector, out: Vector) -> None: ...


class Functions(Protocol):
    """The functions of a model by name; more may be added at any time. They live as long as this does.

    Those that a run calls `rarely` may be slow if they are made the sooner for it, and those that are wanted `soon` at
    first.
    """

    def add(self, programs: Mapping[str, Sequence[Node]], rarely: bool = False, soon: bool = False) -> None: ...
    def __getitem__(self, name: str) -> Function: ...
    def __contains__(self, name: object) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...
    def __len__(self) -> int: ...


class Twins(ByName[ScalarFunction]):
    """`Functions` in plain Python."""

    def __init__(self, layout: Layout) -> None:
        super().__init__()
        self.layout = layout

    def add(self, programs: Mapping[str, Sequence[Node]], rarely: bool = False, soon: bool = False) -> None:
        for name, outputs in programs.items():
            self._functions[name] = ScalarFunction(name, outputs, self.layout)


@dataclass(frozen=True)
class Backend:
    """A way of running programs.

    name : 'llvm' or 'python'
    note : why it was chosen, if that needs saying
    """

    name: str
    note: str = ""
    _create: Callable[[Layout], Functions] = field(default=Twins, repr=False)

    def functions(self, layout: Layout) -> Functions:
        """An empty collection of functions with this layout."""
        return self._create(layout)


def backend(kind: str = "auto", level: int | None = None, cache: ObjectCache | None = None) -> Backend:
    """The backend called 'llvm' or 'python'; 'auto' is machine code where llvmlite is installed.

    Parameters
    ----------
    level : optimization level of the machine code, see `mbd.compile.llvm`; by default that of the environment variable
        `LEVEL`, or else 2, for which large programs do not wait
    cache : where object files are kept; that of the user by default

    Raises
    ------
    CapabilityError
        for machine code that this computer cannot make, and a level in the environment that there is not.
    """
    if kind == "python":
        return Backend("python")
    if kind not in ("llvm", "auto"):
        raise UnknownNameError(nearest(kind, ("llvm", "python", "auto"), "backend", "There are"))
    if find_spec("llvmlite") is None:
        if kind == "llvm":
            raise CapabilityError("backend 'llvm' needs the package llvmlite: pip install llvmlite, or use 'python'")
        return Backend(
            "python",
            "llvmlite is not installed: plain Python runs instead, 100 to 300 times slower than machine code: "
            "pip install 'mbd[fast]'",
        )
    try:
        from mbd.compile import llvm
    except (ImportError, OSError) as error:
        if kind == "llvm":
            raise CapabilityError(f"llvmlite is installed but does not load ({error}); use backend 'python'") from error
        return Backend(
            "python",
            f"llvmlite is installed but does not load ({error}): plain Python runs instead, 100 to 300 times slower",
        )
    level = _level_of_environment() if level is None else level
    chosen, hasty = (llvm.LEVEL, llvm.MAX_QUICK_LINES) if level is None else (level, None)
    return Backend("llvm", "", lambda layout: llvm.Library(layout, chosen, cache, hasty))


def _level_of_environment() -> int | None:
    """The optimization level that the environment asks for, if any."""
    level = os.environ.get(LEVEL, "").strip()
    if level not in ("", "0", "1", "2", "3"):
        raise CapabilityError(f"{LEVEL} is the optimization level of machine code, 0, 1, 2 or 3; {level!r} came")
    return int(level) if level else None
