"""Files appear whole or not at all."""

import errno
import os
import stat
from pathlib import Path

import pytest

from mavplan.errors import InputError
from mavplan.formats import atomic_write, write_all


def test_text_arrives_byte_for_byte(tmp_path: Path) -> None:
    """Line ends and non-ASCII letters are written as they are, as UTF-8."""
    atomic_write(tmp_path / "a.plan", "é\r\nb\n")
    assert (tmp_path / "a.plan").read_bytes() == "é\r\nb\n".encode()
    assert [p.name for p in tmp_path.iterdir()] == ["a.plan"]


def test_a_new_file_gets_the_mode_of_any_new_file(tmp_path: Path) -> None:
    """Others may read it as the umask says, not only its owner."""
    (tmp_path / "plain").write_text("")
    atomic_write(tmp_path / "new.plan", "x")
    assert stat.S_IMODE((tmp_path / "new.plan").stat().st_mode) == stat.S_IMODE(
        (tmp_path / "plain").stat().st_mode
    )


def test_an_existing_file_keeps_its_mode(tmp_path: Path) -> None:
    """A file that was closed to others stays closed."""
    path = tmp_path / "m.plan"
    path.write_text("old")
    path.chmod(0o600)
    atomic_write(path, "new")
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    """The file that a link points to is written, the link is not replaced by a file."""
    (tmp_path / "real.plan").write_text("old")
    link = tmp_path / "link.plan"
    link.symlink_to("real.plan")
    atomic_write(link, "new")
    assert link.is_symlink()
    assert (tmp_path / "real.plan").read_text() == "new"


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("missing/m.plan", "the folder .*missing does not exist"),
        ("file/m.plan", "file is not a folder"),
        ("folder", "a folder of this name is in the way"),
        ("pipe", "not an ordinary file"),
        ("x" * 300, "cannot be written"),
        ("circle", "links that lead in a circle|symbolic links"),
    ],
)
def test_what_cannot_be_written_is_told_in_one_sentence(tmp_path: Path, path: str, said: str) -> None:
    """The message names the path and what is in the way."""
    (tmp_path / "file").write_text("")
    (tmp_path / "folder").mkdir()
    (tmp_path / "circle").symlink_to("circle")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match=said) as caught:
        atomic_write(tmp_path / path, "x")
    assert len(caught.value.problems) == 1
    assert path[:40] in str(caught.value)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_is_closed_is_told(tmp_path: Path) -> None:
    """No permission is a sentence, not a traceback."""
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="not allowed to write"):
        atomic_write(tmp_path / "m.plan", "x")


def test_all_or_none_of_several_files(tmp_path: Path) -> None:
    """One file that cannot be written leaves the others as they were, and every such file is told."""
    (tmp_path / "a.plan").write_text("old")
    pairs = [(tmp_path / "a.plan", "new"), (tmp_path / "no/b.plan", "x"), (tmp_path / "no/c.plan", "x")]
    with pytest.raises(InputError) as caught:
        write_all(pairs)
    assert len(caught.value.problems) == 2
    assert (tmp_path / "a.plan").read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.plan"]


def test_the_same_file_twice_is_refused(tmp_path: Path) -> None:
    """Two texts for one file cannot both be meant, whatever the spelling of the path."""
    with pytest.raises(InputError, match="twice"):
        write_all([(tmp_path / "a.plan", "1"), (tmp_path / "." / "a.plan", "2")])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("step", ["fsync", "fchmod", "fdopen"])
def test_a_full_disk_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    """Wherever the system gives up on the way, the old content stays and no leftovers lie about."""
    (tmp_path / "a.plan").write_text("old")

    def fail(descriptor: int, *_: object) -> None:
        if step == "fdopen":
            os.close(descriptor)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, step, fail)
        with pytest.raises(InputError, match="No space left"):
            atomic_write(tmp_path / "a.plan", "new")
    assert (tmp_path / "a.plan").read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.plan"]


def test_an_interruption_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C before the rename changes nothing."""
    (tmp_path / "a.plan").write_text("old")

    def interrupt(_: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        atomic_write(tmp_path / "a.plan", "new")
    assert [p.name for p in tmp_path.iterdir()] == ["a.plan"]
    assert (tmp_path / "a.plan").read_text() == "old"
