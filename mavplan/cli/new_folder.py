"""A folder for files that are made anew: nothing that is there already is overwritten."""

from collections.abc import Iterable
from pathlib import Path

from mavplan.errors import InputError, Problem


def make_folder(folder: Path, names: Iterable[str]) -> list[Path]:
    """Make a folder where there is none and return where files of these names go in it; none of them is there.

    Raises
    ------
    InputError
        Something is in the way.
    """
    targets = [folder / name for name in names]
    in_the_way = [
        Problem(str(path), "is there already and is not overwritten; name another folder", "exists")
        for path in targets
        if path.exists() or path.is_symlink()
    ]
    if in_the_way:
        raise InputError(in_the_way)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        message = f"the folder cannot be made: {error.strerror or error}"
        raise InputError([Problem(str(folder), message, "no-folder")]) from error
    return targets
