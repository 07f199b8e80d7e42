"""The kernel's arrays between guard pages: a number read or written beyond one of them ends the process at once.

Every array that the kernel is called with is copied into pages of its own, against their end or their beginning, with
a page that can be neither read nor written on each side; what the kernel has made of it is copied back.

``python -m tests.kernel.guard_pages end "" 7 19`` runs wild scenes of these seeds so; anything but a return code of 0
is a fault.
"""

import ctypes
import faulthandler
import mmap
import sys
import warnings
from contextlib import suppress
from dataclasses import replace

import numpy as np

import mbd
from mbd.kernel.records import TABLE
from mbd.results.trajectory import Trajectory
from mbd.simulation import marching
from mbd.simulation.run import stepper
from mbd.simulation.run.stepper import Stepper
from tests.kernel.test_room_to_log import sliders
from tests.simulation.wild import wild_scene

PAGE = mmap.PAGESIZE
NO_ACCESS = 0


def between_guards(array: np.ndarray, at_end: bool) -> np.ndarray:
    """A copy of an array whose last (or first) number stands beside a page without access."""
    data = -(-max(array.nbytes, 1) // PAGE) * PAGE
    memory = mmap.mmap(-1, data + 2 * PAGE)
    base = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    protect = ctypes.CDLL(None, use_errno=True).mprotect
    for place in (base, base + PAGE + data):
        if protect(ctypes.c_void_p(place), ctypes.c_size_t(PAGE), NO_ACCESS) != 0:
            raise OSError(ctypes.get_errno(), "mprotect")
    first = PAGE + (data - array.nbytes if at_end else 0)
    copy = np.frombuffer(memory, array.dtype, array.size, first)
    copy[:] = array
    return copy


def guard_every_call(at_end: bool, short: str = "") -> None:
    """From now on the compiled kernel works between guard pages; the array `short` has a number too few."""
    advance = Stepper._advance_compiled

    def guarded(self: Stepper) -> int:
        arrays = (*TABLE.real_arrays, *TABLE.integer_arrays)
        own = {name: getattr(self.kernel, name) for name in arrays if name != "shift1"}
        own = {name: array[: array.size - (name == short)] for name, array in own.items()}
        pages = self.__dict__.setdefault("pages", {})
        for name, array in own.items():
            if name not in pages or pages[name].size != array.size:
                pages[name] = between_guards(array, at_end)
            pages[name][:] = array
        pages["shift1"] = pages["block"][self.mechanism.layout.shift :]  # as it is outside
        unguarded = dict(vars(self.kernel))
        vars(self.kernel).update(pages)
        self._table = None
        try:
            return advance(self)
        finally:
            for name, array in own.items():
                array[:] = pages[name]
            vars(self.kernel).update({name: unguarded[name] for name in pages})

    Stepper._advance_compiled = guarded  # type: ignore[method-assign]


def wild(seed: int) -> Trajectory:
    """A wild scene, a third of them with each of the schemes of several stages."""
    scene = wild_scene(seed, interpreted=())
    scheme = {0: mbd.RadauIIA(), 1: mbd.RungeKutta853()}.get(seed % 3, scene.integrator)
    return replace(scene, integrator=scheme).run()


def driven_sliders() -> Trajectory:
    """Twenty frictions that stick and slip at the same instants."""
    model = sliders(20)
    return mbd.simulate(model, mbd.assemble(model), mbd.GeneralizedAlpha(0.9), dt=1e-3, until=0.3)


if __name__ == "__main__":
    faulthandler.enable()
    warnings.simplefilter("ignore")
    place, shortened, *seeds = sys.argv[1:]
    guard_every_call(place == "end", shortened)
    stepper.EVENT_CAPACITY, marching.Run.rows_at_once = 1, 8  # a log and a store that are just large enough
    print(len(driven_sliders().events))
    for seed in seeds:
        print(seed, flush=True)
        with suppress(mbd.MbdError):
            wild(int(seed))
    print("done")
