"""Object files on disk, so that a model is turned into machine code once per machine.

One file per key in a directory of the user; it starts with the sha256 of the rest, and an entry that does not fit
it counts as absent. Files appear by renaming, so that readers never see half of one. The directory is
``MBD_CACHE`` if that is set (the word ``off`` means no cache), else the platform's cache directory.
Nothing here raises: a directory that cannot be used is a cache that remembers nothing.
"""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

__all__ = ["LIMIT", "ObjectCache", "default_cache", "key_of"]

LIMIT = 256 * 2**20
"""Bytes above which the entries that were written longest ago are removed (a model takes 10 to 200 kB)."""

_DIGEST = 32
_SUFFIX = ".object"


def key_of(*parts: str) -> str:
    """The name of what is made from these texts: sha256 over them, each with its length."""
    digest = sha256()
    for part in parts:
        data = part.encode()
        digest.update(f"{len(data)}:".encode())
        digest.update(data)
    return digest.hexdigest()


@dataclass(frozen=True)
class ObjectCache:
    """Bytes by key in a directory; `directory` None remembers nothing."""

    directory: Path | None = None

    def load(self, key: str) -> bytes | None:
        """What was stored under the key, or None if there is nothing whole and readable."""
        if self.directory is None:
            return None
        try:
            content = (self.directory / (key + _SUFFIX)).read_bytes()
        except OSError:
            return None
        data = content[_DIGEST:]
        return data if data and sha256(data).digest() == content[:_DIGEST] else None

    def store(self, key: str, data: bytes) -> None:
        """Write an entry at once, or not at all."""
        if self.directory is None:
            return
        draft = self.directory / f"{key}.{os.getpid()}.{os.urandom(4).hex()}.draft"
        try:
            self.directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            draft.write_bytes(sha256(data).digest() + data)
            os.replace(draft, self.directory / (key + _SUFFIX))
            self._prune()
        except OSError:
            with contextlib.suppress(OSError):
                draft.unlink(missing_ok=True)

    def _prune(self) -> None:
        """Remove the oldest entries until `LIMIT` is kept."""
        assert self.directory is not None
        entries = [(status.st_mtime, status.st_size, path) for path, status in self._entries(self.directory)]
        excess = sum(size for _, size, _ in entries) - LIMIT
        for _, size, path in sorted(entries):
            if excess <= 0:
                return
            with contextlib.suppress(OSError):
                path.unlink()
            excess -= size

    @staticmethod
    def _entries(directory: Path) -> list[tuple[Path, os.stat_result]]:
        found = []
        with os.scandir(directory) as scan:
            for entry in scan:
                if entry.name.endswith((_SUFFIX, ".draft")):
                    with contextlib.suppress(OSError):  # removed by another process meanwhile
                        found.append((Path(entry.path), entry.stat()))
        return found


def default_cache() -> ObjectCache:
    """The cache that ``MBD_CACHE`` names, or that of the user."""
    place = os.environ.get("MBD_CACHE", "").strip()
    if place.lower() == "off":
        return ObjectCache()
    if place:
        return ObjectCache(Path(place).expanduser())
    from platformdirs import user_cache_path

    return ObjectCache(user_cache_path("mbd", appauthor=False) / "objects")
