"""Files that a forked process writes are those that one process writes, and no error is lost between the two."""

import os

import pytest

import mbd
from mbd.errors import MbdError
from mbd.view import beside as module
from mbd.view.beside import beside
from mbd.view.report import draw


def pendulum():
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", length=1.0, **mbd.rod(mass=2.0, length=1.0).link)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))
    return mbd.simulate(model, mbd.assemble(model, position={"pin.angle": 1.0}), dt=1e-2, until=0.2)


def test_plots_of_a_copy_are_those_of_one_process_to_the_byte(tmp_path, monkeypatch):
    run = pendulum()
    paths = draw(run, tmp_path / "copy")
    monkeypatch.setattr(module.sys, "platform", "another")
    assert [path.name for path in draw(run, tmp_path / "alone")] == [path.name for path in paths]
    for path in paths[1:]:
        assert path.read_bytes() == (tmp_path / "alone" / path.name).read_bytes(), path.name


@pytest.mark.parametrize("platform", ["linux", "another"])
def test_an_error_reaches_the_caller_after_the_body(platform, monkeypatch):
    monkeypatch.setattr(module.sys, "platform", platform)
    done = []

    def fail():
        raise MbdError("no room")

    with pytest.raises(MbdError, match="no room"), beside(fail):
        done.append("body")
    assert done == ["body"]


def test_a_copy_that_cannot_be_made_or_dies_is_replaced_by_its_original(tmp_path, monkeypatch):
    me = os.getpid()

    def die_in_the_copy():
        if os.getpid() != me:
            os.kill(os.getpid(), 9)
        (tmp_path / "file").write_text("done")

    with beside(die_in_the_copy):
        pass
    assert (tmp_path / "file").read_text() == "done"
    (tmp_path / "file").unlink()
    monkeypatch.setattr("os.fork", lambda: (_ for _ in ()).throw(OSError("no process left")))
    with beside(die_in_the_copy):
        pass
    assert (tmp_path / "file").read_text() == "done"
