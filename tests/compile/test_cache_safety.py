"""What the cache hands over is executed: only what was made for the very key, by this user, is."""

import os
import random
import subprocess
import sys
import time
import warnings
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from mbd import notes
from mbd.compile import cache as caching, llvm
from mbd.compile.cache import ObjectCache, default_cache
from tests.compile.chains import chain, compile_functions
from tests.compile.test_llvm import results

pytestmark = pytest.mark.skipif(os.name == "nt", reason="rights are of another kind there")
CHAINS = [chain(links) for links in (1, 2, 3)]


def build(cache, which=1):
    library = compile_functions({"r": CHAINS[which].outputs}, CHAINS[which].layout, cache=cache)
    return library.builds[0].cached, results(library["r"], CHAINS[which])


@pytest.fixture(autouse=True)
def told(monkeypatch):
    monkeypatch.setattr(notes, "_TOLD", type(notes._TOLD)())


def test_entries_under_each_others_names_are_not_executed(tmp_path):
    cache, expected, files = ObjectCache(tmp_path), [], []
    for which in range(3):
        expected.append(build(cache, which)[1])
        files.append(next(file for file in tmp_path.iterdir() if file not in files))
    contents = [file.read_bytes() for file in files]
    for order in list(permutations(range(3)))[1:]:
        for file, place in zip(files, order, strict=True):
            file.write_bytes(contents[place])
        for which in range(3):
            cached, found = build(cache, which)
            assert cached == (order[which] == which)
            assert np.array_equal(found, expected[which])


def test_no_change_of_an_entry_is_loaded(tmp_path):
    rng, cache, data = random.Random(5), ObjectCache(tmp_path), bytes(range(256)) * 3
    cache.store("key", data)
    path = tmp_path / "key.object"
    whole = path.read_bytes()
    for _ in range(300):
        changed = bytearray(whole)
        changed[rng.randrange(len(whole))] ^= 1 << rng.randrange(8)
        path.write_bytes(rng.choice((bytes(changed), whole[: rng.randrange(len(whole))], whole + bytes([7]))))
        assert cache.load("key") is None
    path.write_bytes(whole)
    assert cache.load("key") == data and cache.load("yek") is None


def test_only_regular_files_of_this_user_are_read(tmp_path):
    cache = ObjectCache(tmp_path)
    cache.store("key", b"code")
    path, elsewhere = tmp_path / "key.object", tmp_path / "elsewhere"
    path.rename(elsewhere)
    path.symlink_to(elsewhere)
    assert cache.load("key") is None
    path.unlink()
    os.mkfifo(path)
    assert cache.load("key") is None
    path.unlink()
    elsewhere.rename(path)
    assert cache.load("key") == b"code"
    path.chmod(0o662)
    assert cache.load("key") is None
    if os.geteuid() == 0:
        path.chmod(0o600)
        os.chown(path, 12345, 12345)
        assert cache.load("key") is None


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o722])
def test_a_directory_that_others_may_write_to_is_told_and_not_used(tmp_path, mode):
    folder = tmp_path / "objects"
    cache = ObjectCache(folder)
    cache.store("key", b"code")
    folder.chmod(mode)
    with pytest.warns(UserWarning, match=r"objects' may be written by others.*MBD_CACHE"):
        assert cache.load("key") is None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cache.store("other", b"code")  # told once
    assert [path.name for path in folder.iterdir()] == ["key.object"]
    folder.chmod(0o700)
    assert cache.load("key") == b"code"


@pytest.mark.skipif(os.name == "nt" or os.geteuid() != 0, reason="only root gives things away")
def test_a_directory_of_another_user_is_told_and_not_used(tmp_path):
    cache = ObjectCache(tmp_path / "objects")
    cache.store("key", b"code")
    os.chown(tmp_path / "objects", 12345, 12345)
    with pytest.warns(UserWarning, match="belongs to another user"):
        assert cache.load("key") is None


def test_whatever_is_usual_for_new_files_the_entries_are_of_this_user_alone(tmp_path):
    before = os.umask(0o002)
    try:
        cache = ObjectCache(tmp_path / "objects")
        cache.store("key", b"code")
        assert cache.load("key") == b"code"
    finally:
        os.umask(before)


def test_passes_and_versions_are_part_of_the_key(monkeypatch):
    keys = {llvm.tag_key("tag")}
    for place, name, value in (
        (llvm.PASSES, "speed_level", 2), (llvm.PASSES, "slp_vectorization", False), (llvm.PASSES, "from level", 4),
    ):  # fmt: skip
        with monkeypatch.context() as patch:
            patch.setitem(place, name, value)
            keys.add(llvm.tag_key("tag"))
    monkeypatch.setattr(llvm.llvmlite, "__version__", "0.0")
    keys.add(llvm.tag_key("tag"))
    assert len(keys) == 5


def test_what_was_used_last_stays_and_the_kernel_longest(tmp_path, monkeypatch):
    cache = ObjectCache(tmp_path)
    monkeypatch.setattr(caching, "MAX_BYTES", 3000)
    cache.store("kernel", bytes(900), lasting=True)
    for key in ("used", "unused"):
        cache.store(key, bytes(900))
    for number, path in enumerate(sorted(tmp_path.iterdir(), reverse=True)):  # 'used' was written first
        os.utime(path, (1e9 + number, 1e9 + number))
    assert cache.load("used") == bytes(900)
    cache.store("new", bytes(900))
    assert cache.load("unused") is None
    assert cache.load("used") == cache.load("new") == cache.load("kernel", lasting=True) == bytes(900)


def test_drafts_that_nobody_finished_are_removed(tmp_path):
    cache = ObjectCache(tmp_path)
    stale, fresh = tmp_path / "a.1.x.draft", tmp_path / "b.1.x.draft"
    for draft in (stale, fresh):
        draft.write_bytes(b"half")
    os.utime(stale, (time.time() - 1e5,) * 2)
    cache.store("other", b"code")
    assert not stale.exists() and fresh.exists()


def test_without_a_home_the_cache_remembers_nothing_and_says_so(monkeypatch):
    for name in ("HOME", "XDG_CACHE_HOME", "MBD_CACHE"):
        monkeypatch.delenv(name, raising=False)
    import pwd

    def nobody(*_):
        raise KeyError("getpwuid(): uid not found")

    monkeypatch.setattr(pwd, "getpwuid", nobody)
    with pytest.warns(UserWarning, match=r"no home directory.*MBD_CACHE"):
        assert default_cache() == ObjectCache()
    monkeypatch.setenv("MBD_CACHE", "~nobody at all/objects")
    assert default_cache() == ObjectCache()


def test_without_platformdirs_the_cache_remembers_nothing_and_says_what_to_install(monkeypatch):
    monkeypatch.delenv("MBD_CACHE", raising=False)
    monkeypatch.setitem(sys.modules, "platformdirs", None)
    with pytest.warns(UserWarning, match=r"platformdirs is not installed.*mbd\[fast\].*MBD_CACHE"):
        assert default_cache() == ObjectCache()


FORKS = """
import os, signal, threading, time
from mbd.compile.cache import ObjectCache
from mbd.compile.llvm import Library
from tests.compile.chains import chain

def compile(links):
    library = Library(links.layout, cache=ObjectCache())
    library.add({"r": links.outputs})

def work():
    while not over:
        compile(large)

large, small, over, hung = chain(6), chain(2), False, 0
threads = [threading.Thread(target=work) for _ in range(2)]
for thread in threads:
    thread.start()
for turn in range(6):
    time.sleep(0.011 * turn)
    child = os.fork()
    if child == 0:
        signal.alarm(20)
        compile(small)
        os._exit(0)
    hung += os.waitpid(child, 0)[1] != 0
over = True
for thread in threads:
    thread.join()
print(hung)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are not forked here")
def test_a_process_forked_beside_a_thread_that_compiles_can_compile():
    words = [sys.executable, "-W", "ignore", "-c", FORKS]
    ended = subprocess.run(
        words, cwd=Path(__file__).parents[2], capture_output=True, text=True, timeout=300, check=False
    )
    assert (ended.stdout, ended.returncode) == ("0\n", 0), ended.stderr
