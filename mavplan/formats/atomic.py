"""Files that appear whole or not at all: written beside their place, flushed to disk, then renamed.

Nothing here knows what is in a file.
"""

import contextlib
import os
import secrets
import stat
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from mavplan.errors import InputError, Problem


@dataclass(frozen=True, slots=True)
class _Prepared:
    """A whole file that waits beside its place."""

    temporary: Path
    target: Path
    asked: Path


def atomic_write(path: Path | str, content: str | bytes) -> None:
    """Write a file so that a reader finds the old content or the new, never a part.

    Parameters
    ----------
    path
        Where the file goes. A link is followed, the mode of an existing file is kept.
    content
        Bytes, or text that is written as UTF-8 with its line ends as they are.

    Raises
    ------
    InputError
        The folder is missing or cannot be written, or something that is no file is in the way; then nothing has
        changed.
    """
    write_all([(path, content)])


def write_all(pairs: Iterable[tuple[Path | str, str | bytes]]) -> None:
    """Write several files; all are on disk beside their places before the first one is replaced.

    Parameters
    ----------
    pairs
        Path and content of each file.

    Raises
    ------
    InputError
        Some files cannot be written: one problem for each, and none has changed.
    """
    prepared: list[_Prepared] = []
    problems: list[Problem] = []
    seen: set[Path] = set()
    try:
        for path, content in pairs:
            asked = Path(path)
            try:
                target = asked.resolve()
                if target in seen:
                    problems.append(
                        Problem(str(asked), "the same file is to be written twice", "duplicate-file")
                    )
                    continue
                seen.add(target)
                prepared.append(
                    _prepare(asked, target, content.encode("utf-8") if isinstance(content, str) else content)
                )
            except OSError as error:
                problems.append(_problem(asked, error))
            except RuntimeError:  # how Python up to 3.12 says it
                problems.append(Problem(str(asked), "links that lead in a circle", "not-writable"))
        if problems:
            raise InputError(problems)
        for file in prepared:
            try:
                file.temporary.replace(file.target)
            except OSError as error:
                raise InputError([_problem(file.asked, error)]) from error
        for folder in {file.target.parent for file in prepared}:
            _flush_folder(folder)
    finally:
        for file in prepared:
            file.temporary.unlink(missing_ok=True)


def _prepare(asked: Path, target: Path, content: bytes) -> _Prepared:
    mode = None
    if target.exists():
        info = target.stat()
        if stat.S_ISDIR(info.st_mode):
            raise IsADirectoryError
        if not stat.S_ISREG(info.st_mode):
            raise OSError(0, "something that is not an ordinary file is in the way")
        if not os.access(target, os.W_OK):
            raise PermissionError
        mode = stat.S_IMODE(info.st_mode)
    temporary = target.with_name(f".{target.name[:100]}.{secrets.token_hex(6)}.tmp")
    # The operating system applies the umask to 0666, as for any new file; mkstemp's 0600 would hide it from others.
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(content)
            stream.flush()
            if mode is not None:
                os.fchmod(stream.fileno(), mode)
            os.fsync(stream.fileno())
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return _Prepared(temporary, target, asked)


def _flush_folder(folder: Path) -> None:
    """Make the new names last; some file systems cannot flush a folder, and then the names last a little later."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def no_folder(path: Path) -> Problem:
    """Return what is wrong with a file whose folder is not there."""
    return Problem(str(path), f"the folder {path.parent} does not exist: make it first", "no-folder")


def _problem(path: Path, error: OSError) -> Problem:
    where = str(path)
    match error:
        case FileNotFoundError():
            return no_folder(path)
        case NotADirectoryError():
            return Problem(where, f"{path.parent} is not a folder", "no-folder")
        case IsADirectoryError():
            return Problem(where, "a folder of this name is in the way: give a file name", "not-a-file")
        case PermissionError():
            return Problem(
                where, "not allowed to write here: check who owns the folder and the file", "not-writable"
            )
    return Problem(where, f"cannot be written: {error.strerror or error}", "not-writable")
