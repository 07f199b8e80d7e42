"""Object files on disk, so that a model is turned into machine code once per machine.

One file per key in a directory of the user; it starts with the sha256 of the key and the rest, so that an entry that
was damaged, or has got the name of another, counts as absent. Files appear by renaming, so that readers never see half
of one. The directory is ``MBD_CACHE`` if that is set (the word ``off`` means no cache), else the platform's cache
directory.

What is read here is executed. A directory that belongs to another user, or that others may write to, is not used, and a
warning says so; nor is a file of another user, one that others may write to, or anything that is not a regular file.
Nothing here raises: a directory that cannot be used is a cache that remembers nothing.
"""

import contextlib
import os
import stat
import time
from hashlib import sha256
from pathlib import Path

from mbd.dataclass import dataclass
from mbd.notes import PROCESS, doubt

MAX_BYTES = 256 * 2**20
"""Bytes above which the entries that were used longest ago are removed (a model takes 10 to 200 kB)."""

_DIGEST = 32
_SUFFIX, _DRAFT, _LASTING = ".object", ".draft", "kernel-"
_OTHERS = stat.S_IWGRP | stat.S_IWOTH
_AGAIN = "so it is compiled again in every process"


def key_of(*parts: str) -> str:
    """The name of what is made from these texts: sha256 over them, each with its length."""
    digest = sha256()
    for part in parts:
        data = part.encode()
        digest.update(f"{len(data)}:".encode())
        digest.update(data)
    return digest.hexdigest()


def _sealed(key: str, data: bytes) -> bytes:
    """What an entry of this key begins with."""
    return sha256(f"{len(key)}:{key}".encode() + data).digest()


def _foreign(status: os.stat_result) -> str:
    """Whose a directory or file is, if it is not of this user alone; ''."""
    if os.name == "nt":
        return ""
    if status.st_uid != os.geteuid():
        return "belongs to another user"
    return "may be written by others" if status.st_mode & _OTHERS else ""


_written: dict[str, int] = {}
"""Bytes written since a directory was pruned by this process."""


@dataclass(frozen=True)
class ObjectCache:
    """Bytes by key in a directory; `directory` None remembers nothing."""

    directory: Path | None = None

    def load(self, key: str, lasting: bool = False) -> bytes | None:
        """What was stored under the key, or None if there is nothing whole, readable and of this user."""
        if self.directory is None or not self._is_ours():
            return None
        path = self.directory / _name(key, lasting)
        try:
            content = _content_of(path)
            if content is None:
                return None
            data = content[_DIGEST:]
            if not data or _sealed(key, data) != content[:_DIGEST]:
                return None
            if time.time() - path.stat().st_mtime > 60.0:  # a note younger than a minute is kept
                os.utime(path)  # it was used
        except OSError:
            return None
        return data

    def store(self, key: str, data: bytes, lasting: bool = False) -> None:
        """Write an entry at once, or not at all; one that is `lasting` outlives those that are not."""
        if self.directory is None:
            return
        draft = self.directory / f"{key}.{os.getpid()}.{os.urandom(4).hex()}{_DRAFT}"
        try:
            self.directory.mkdir(mode=0o700, parents=True, exist_ok=True)
            if not self._is_ours():
                return
            draft.write_bytes(_sealed(key, data) + data)
            draft.chmod(0o600)
            os.replace(draft, self.directory / _name(key, lasting))
            self._prune_in_time(len(data))
        except OSError:
            with contextlib.suppress(OSError):
                draft.unlink(missing_ok=True)

    def _is_ours(self) -> bool:
        """Whether the directory is of this user alone; says once why not. One that is not there yet is."""
        assert self.directory is not None
        try:
            problem = _foreign(self.directory.stat())
        except OSError:
            return True  # nothing can be read there, and `store` makes it or fails
        if problem:
            doubt(
                f"the code cache '{self.directory}' {problem}, and what is in it is executed: it is not used, and code "
                "is compiled again in every process; name a directory of your own in MBD_CACHE, or take the rights of "
                "others away (chmod go-w)",
                of=PROCESS,
            )
        return not problem

    def _prune_in_time(self, size: int) -> None:
        """Prune at the first entry of a process, then whenever it has written a sixteenth of `MAX_BYTES`.

        Looking through a directory of 10 000 entries takes as long as compiling one.
        """
        place = str(self.directory)
        written = _written.get(place)
        if written is None or written + size > MAX_BYTES // 16:
            _written[place] = 0
            self._prune()
        else:
            _written[place] = written + size

    def _prune(self) -> None:
        """Remove drafts that nobody finished, then the entries used longest ago until `MAX_BYTES` is kept."""
        assert self.directory is not None
        entries = []
        now = time.time()
        for path, status in self._entries(self.directory):
            if path.name.endswith(_DRAFT):
                if now - status.st_mtime > 3600.0:  # before an hour it may still be written
                    with contextlib.suppress(OSError):
                        path.unlink()
                continue
            entries.append((path.name.startswith(_LASTING), status.st_mtime, status.st_size, path))
        excess = sum(size for _, _, size, _ in entries) - MAX_BYTES
        for _, _, size, path in sorted(entries):
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
                if entry.name.endswith((_SUFFIX, _DRAFT)):
                    with contextlib.suppress(OSError):  # removed by another process meanwhile
                        found.append((Path(entry.path), entry.stat(follow_symlinks=False)))
        return found


def _name(key: str, lasting: bool) -> str:
    return f"{_LASTING if lasting else ''}{key}{_SUFFIX}"


def _content_of(path: Path) -> bytes | None:
    """All of a regular file of this user; None of anything else, which might never end or be written by others."""
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    with open(os.open(path, flags), "rb") as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode) or _foreign(status) or status.st_size > MAX_BYTES:
            return None
        return file.read()


def default_cache() -> ObjectCache:
    """The cache that ``MBD_CACHE`` names, or that of the user; one that remembers nothing where there is none."""
    place = os.environ.get("MBD_CACHE", "").strip()
    if place.lower() == "off":
        return ObjectCache()
    try:
        if place:
            return ObjectCache(Path(place).expanduser())
        from platformdirs import user_cache_path

        directory = user_cache_path("mbd", appauthor=False) / "objects"
    except ImportError:
        doubt(
            f"platformdirs is not installed, {_AGAIN}; try pip install 'mbd[fast]', or name a directory in MBD_CACHE",
            of=PROCESS,
        )
        return ObjectCache()
    except (RuntimeError, KeyError, OSError):  # no HOME, and no entry for this user
        directory = Path()
    if directory.is_absolute():
        return ObjectCache(directory)
    doubt(f"there is no home directory to keep compiled code in, {_AGAIN}; name a directory in MBD_CACHE", of=PROCESS)
    return ObjectCache()
