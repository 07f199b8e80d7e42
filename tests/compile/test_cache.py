"""Object files on disk: found again, verified, whole or absent, and never in the way."""

import os
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mbd.compile import cache as caching, llvm
from mbd.compile.cache import ObjectCache, default_cache, key_of
from mbd.compile.host import host
from mbd.compile.llvm import Library
from tests.compile.chains import chain, compile_functions
from tests.compile.test_llvm import results

LINKS = chain(2)


def build(cache, level=2):
    library = compile_functions({"r": LINKS.outputs}, LINKS.layout, level, cache)
    return library.builds[0].cached, results(library["r"], LINKS)


def entries(folder):
    return sorted(Path(folder).iterdir())


def test_the_second_build_comes_from_the_cache_without_generating_code(tmp_path, monkeypatch):
    cache = ObjectCache(tmp_path)
    cached, first = build(cache)
    assert not cached
    monkeypatch.setattr(llvm, "emit_object", lambda *_: pytest.fail("code was generated again"))
    cached, second = build(cache)
    assert cached
    assert np.array_equal(first, second)
    assert len(entries(tmp_path)) == 1


def test_another_level_or_processor_or_version_is_another_entry(tmp_path, monkeypatch):
    cache = ObjectCache(tmp_path)
    build(cache)
    assert not build(cache, level=1)[0]
    this = host()
    for change in ({"cpu": "generic"}, {"features": this.features + ",-xop"}, {"llvm": "99.0.0"}):
        other = replace(this, **change)
        with monkeypatch.context() as patch:
            patch.setattr(llvm, "host", lambda other=other: other)
            assert llvm.cached_object("tag", lambda: b"theirs", cache) == b"theirs"
    assert llvm.cached_object("tag", lambda: b"ours", cache) == b"ours"
    assert llvm.cached_object("tag", lambda: b"again", cache) == b"ours"


DAMAGES = {
    "empty": lambda data: b"",
    "cut": lambda data: data[: len(data) // 2],
    "no body": lambda data: data[:32],
    "one bit": lambda data: data[:100] + bytes([data[100] ^ 4]) + data[101:],
    "digest": lambda data: bytes([data[0] ^ 1]) + data[1:],
    "longer": lambda data: data + b"\0",
    "text": lambda data: b"not an object file at all, but long enough to have a digest",
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_entry_is_made_again_silently(damage, tmp_path):
    cache = ObjectCache(tmp_path)
    _, expected = build(cache)
    (entry,) = entries(tmp_path)
    whole = entry.read_bytes()
    entry.write_bytes(damage(whole))
    cached, again = build(cache)
    assert not cached
    assert np.array_equal(again, expected)
    assert entry.read_bytes() == whole
    assert build(cache)[0]


def test_an_entry_that_cannot_be_read_is_made_again(tmp_path):
    cache = ObjectCache(tmp_path)
    build(cache)
    (entry,) = entries(tmp_path)
    entry.unlink()
    entry.mkdir()
    assert not build(cache)[0]


def test_a_directory_that_cannot_be_made_is_no_cache(tmp_path):
    (tmp_path / "file").write_text("in the way")
    cache = ObjectCache(tmp_path / "file" / "objects")
    for _ in range(2):
        assert not build(cache)[0]


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="permissions do not bind this user")
def test_a_directory_that_cannot_be_written_is_no_cache(tmp_path):
    tmp_path.chmod(0o500)
    assert not build(ObjectCache(tmp_path))[0]


def test_a_disk_that_fails_leaves_nothing_behind(tmp_path, monkeypatch):
    cache = ObjectCache(tmp_path)

    def full(self, data):
        with open(self, "wb") as file:
            file.write(data[:10])
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", full)
        assert not build(cache)[0]
    assert entries(tmp_path) == []

    def refuse(*_):
        raise PermissionError("in use by another process")

    with monkeypatch.context() as patch:
        patch.setattr(caching.os, "replace", refuse)
        assert not build(cache)[0]
    assert entries(tmp_path) == []


def test_a_reader_sees_an_entry_whole_or_not_at_all(tmp_path):
    cache, bad = ObjectCache(tmp_path), []
    contents = [bytes([letter]) * 200_000 for letter in b"abc"]

    def write(data):
        for _ in range(30):
            cache.store("key", data)

    def read():
        while any(writer.is_alive() for writer in writers):
            path = tmp_path / "key.object"
            if path.exists() and path.stat().st_size != 200_032:
                bad.append("size")
            found = cache.load("key")
            if found is not None and found not in contents:
                bad.append(found[:1])

    writers = [threading.Thread(target=write, args=(data,)) for data in contents]
    for writer in writers:
        writer.start()
    read()
    for writer in writers:
        writer.join()
    assert not bad
    assert cache.load("key") in contents
    assert len(entries(tmp_path)) == 1


def test_the_oldest_entries_go_when_there_are_too_many(tmp_path, monkeypatch):
    cache = ObjectCache(tmp_path)
    monkeypatch.setattr(caching, "MAX_BYTES", 3000)
    for age, key in enumerate(("new", "middle", "old")):
        cache.store(key, bytes(900))
        os.utime(tmp_path / f"{key}.object", (1e9 - age, 1e9 - age))
    assert len(entries(tmp_path)) == 3
    cache.store("newest", bytes(900))
    assert [path.stem for path in entries(tmp_path)] == ["middle", "new", "newest"]


def test_the_environment_names_the_directory(tmp_path, monkeypatch):
    monkeypatch.setenv("MBD_CACHE", str(tmp_path / "here"))
    assert default_cache().directory == tmp_path / "here"
    library = Library(LINKS.layout)
    library.add({"r": LINKS.outputs})
    assert len(entries(tmp_path / "here")) == 1
    monkeypatch.setenv("MBD_CACHE", "off")
    assert default_cache() == ObjectCache()
    monkeypatch.delenv("MBD_CACHE")
    directory = default_cache().directory
    assert directory is not None
    assert directory.parts[-2:] == ("mbd", "objects")


def test_another_process_finds_the_code(tmp_path):
    program = """
from mbd.compile.llvm import Library
from tests.compile.chains import chain
links = chain(3)
library = Library(links.layout)
library.add({"r": links.outputs})
print(library.builds[0].cached)
"""
    runs = [
        subprocess.run(
            [sys.executable, "-c", program],
            env=os.environ | {"MBD_CACHE": str(tmp_path)},
            cwd=Path(__file__).parents[2],
            capture_output=True,
            text=True,
            check=True,
            timeout=300,
        ).stdout.strip()
        for _ in range(2)
    ]
    assert runs == ["False", "True"]


def test_keys_tell_texts_apart_however_they_are_split():
    assert key_of("ab", "c") != key_of("a", "bc") != key_of("abc")
    assert len(key_of()) == 64
