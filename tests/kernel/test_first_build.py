"""The first run on a machine begins with a kernel without optimization; the optimized one comes from beside it."""

import os
import subprocess
import sys
import threading
import time

import pytest

from mbd.compile.cache import default_cache
from mbd.compile.host import Host
from mbd.compile.llvm import tag_key
from mbd.kernel import build, first_build, shipped
from mbd.sensitivity.tangent import build as tangent

SCRIPT = """
import time, mbd
model = mbd.Model("pendulum")
model.connect(mbd.Revolute("hinge", model.ground.origin, mbd.Link("rod", mass=1.0, length=1.0, center=0.5).start))
start = mbd.assemble(model, position={"hinge.angle": 0.5})
ends = [float(mbd.simulate(model, start, dt=1e-3, until=2.0)["hinge.angle"][-1])]
from mbd.kernel.entry import entry
quick, limit = entry(), time.monotonic() + 300.0
while entry() is quick and time.monotonic() < limit:
    time.sleep(0.1)
ends.append(float(mbd.simulate(model, start, dt=1e-3, until=2.0)["hinge.angle"][-1]))
print(ends[0] == ends[1], entry() is not quick)
"""


@pytest.mark.slow
def test_a_first_run_goes_over_to_the_optimized_kernel_with_the_same_bits(tmp_path):
    environment = {name: value for name, value in os.environ.items() if name != "MBD_OPTIMIZATION_LEVEL"}
    environment |= {"MBD_CACHE": str(tmp_path), "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    told = subprocess.run([sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, timeout=600)
    assert told.stdout == "True True\n", told.stderr
    assert "a faster one follows in the background" in told.stderr
    assert not list(tmp_path.glob("*.building"))


def test_a_level_that_was_asked_for_and_a_cache_that_keeps_nothing_have_the_kernel_at_once(monkeypatch, tmp_path):
    monkeypatch.setenv("MBD_CACHE", str(tmp_path))
    assert not first_build.is_allowed(), "the tests ask for a level"
    monkeypatch.delenv("MBD_OPTIMIZATION_LEVEL")
    assert first_build.is_allowed()
    monkeypatch.setenv("MBD_CACHE", "off")
    assert not first_build.is_allowed()


def test_two_processes_build_the_kernel_once(monkeypatch, tmp_path):
    monkeypatch.setenv("MBD_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(first_build, "POLL_SECONDS", 0.01)
    monkeypatch.setattr(os, "nice", lambda steps: 0, raising=False)
    monkeypatch.setattr(build, "kernel_text", lambda: "text")
    made: list[str] = []

    def slowly(text: str) -> bytes:
        made.append(text)
        time.sleep(0.1)
        return b"machine code"

    monkeypatch.setattr(build, "object_of", slowly)
    threads = [threading.Thread(target=first_build.build) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(10.0)
    assert made == ["text"] and default_cache().load(tag_key(build.tag()), lasting=True) == b"machine code"
    assert not list((tmp_path / "cache").glob("*.building"))


def test_a_kernel_whose_sources_change_as_it_is_built_is_not_kept(monkeypatch, tmp_path):
    """Steps of one version were taken for those of another, where a branch was changed during a build."""
    monkeypatch.setenv("MBD_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(os, "nice", lambda steps: 0, raising=False)
    source = ["one"]
    first_build.keep(lambda: source[0], lambda: source.insert(0, "another") or b"of both")
    assert not list((tmp_path / "cache").iterdir())


def test_the_kernel_of_derivatives_is_kept_like_the_other(monkeypatch, tmp_path):
    monkeypatch.setenv("MBD_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(os, "nice", lambda steps: 0, raising=False)
    monkeypatch.setattr(tangent, "text", lambda: "text")
    monkeypatch.setattr(build, "object_of", lambda text, level: f"{text} at level {level}".encode())
    tangent.keep_optimized()
    assert [path.read_bytes().endswith(b"text at level 2") for path in (tmp_path / "cache").glob("kernel-*")] == [True]


V3 = ",".join(f"+{name}" for name in shipped.LEVEL_3)


@pytest.mark.parametrize(
    ("triple", "features", "suits"),
    [
        ("x86_64-unknown-linux-gnu", V3, "x86-64-v3"),
        ("x86_64-unknown-linux-gnu", f"{V3},-fma", None),
        ("x86_64-unknown-linux-gnu", V3.replace("+avx2,", ""), None),
        ("x86_64-pc-windows-msvc", V3, None),
        ("aarch64-unknown-linux-gnu", "-sve", "generic"),
        ("arm64-apple-darwin", "", None),
    ],
)
def test_a_kernel_of_a_wheel_is_used_where_its_sources_and_the_processor_are_those(
    monkeypatch, tmp_path, triple, features, suits
):
    monkeypatch.setattr(shipped, "FOLDER", tmp_path / "objects")
    monkeypatch.setattr(shipped, "host", lambda: Host(triple, "", features, "", True))
    assert shipped.load() is None, "there is none yet"
    monkeypatch.setattr(build, "kernel_text", lambda: "text")
    monkeypatch.setattr(build, "compiled", lambda text, here, level: f"{text} for {here.cpu}".encode())
    assert [path.name for path in shipped.write()] == ["x86-64-v3-linux.object", "arm64-linux.object"]
    assert shipped.load() == (None if suits is None else f"text for {suits}".encode())
    monkeypatch.setattr(build, "source_digest", lambda: "of other sources")
    assert shipped.load() is None


def test_a_kernel_for_arm64_is_made_on_any_machine():
    """Its bits were those of x86-64 under an emulator; here it is only made, of one small function."""
    import llvmlite.binding as llvm

    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    text = "define double @twice(double %x) {\n  %y = fadd double %x, %x\n  ret double %y\n}"
    code = build.compiled(text, Host("aarch64-unknown-linux-gnu", "generic", "", "", True), 2)
    assert code[:4] == b"\x7fELF" and int.from_bytes(code[18:20], "little") == 183  # EM_AARCH64
