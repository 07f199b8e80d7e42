"""The compiled kernel neither reads nor writes beyond any of its arrays, whatever the scene."""

import signal
import subprocess
import sys

import pytest

from mbd.kernel.records import TABLE

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pages are protected with mprotect")
QUICK = [shape + 120 * k for k, shape in enumerate(range(0, 120, 20))]
"""One scene of fifteen shapes."""


def between_pages(place: str, short: str, seeds) -> subprocess.CompletedProcess:
    words = [sys.executable, "-m", "tests.kernel.guard_pages", place, short, *map(str, seeds)]
    return subprocess.run(words, capture_output=True, text=True, timeout=1200, check=False)


@pytest.mark.parametrize("place", ["beginning", "end"])
def test_no_array_of_the_kernel_is_left(place):
    ended = between_pages(place, "", QUICK)
    assert ended.returncode == 0 and ended.stdout.endswith("done\n"), ended.stdout[-200:] + ended.stderr[-2000:]


@pytest.mark.slow
@pytest.mark.parametrize("place", ["beginning", "end"])
@pytest.mark.parametrize("part", range(10))
def test_no_array_of_the_kernel_is_left_in_many_scenes(place, part):
    ended = between_pages(place, "", range(part, 1200, 10))
    assert ended.returncode == 0 and ended.stdout.endswith("done\n"), ended.stdout[-200:] + ended.stderr[-2000:]


@pytest.mark.parametrize("short", ["rhs", "sticks"])
def test_an_index_one_too_far_is_caught(short):
    assert short in (*TABLE.real_arrays, *TABLE.integer_arrays)
    assert between_pages("end", short, []).returncode == -signal.SIGSEGV
