"""What arguments and options are, where shells can complete them: files of certain endings, planners."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

PLANNER_NAMES = ("tloaik", "stoaik", "boaik", "length", "time", "sbw")
"""Of `mavplan.planners.PLANNERS`, which take their time to load."""
PATH = "path"
"""What a completion is that names a file or a folder."""


class Files(click.Path):
    """A file; shells complete names with these endings, and folders.

    Parameters
    ----------
    suffixes
        In lower case; none: every file.
    dash
        ``-`` is taken too.
    """

    def __init__(self, *suffixes: str, dash: bool = False) -> None:
        super().__init__(path_type=Path)
        self.suffixes = suffixes
        self.dash = dash

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path."""
        if str(value) == "-" and not self.dash:
            self.fail("'-' is taken for scenarios only; name a file", param, ctx)
        if "\0" in str(value):
            self.fail(f"{str(value)!r} is no name that a file can have", param, ctx)
        return super().convert(value, param, ctx)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> "list[CompletionItem[Any]]":
        """Return the folders and the files with these endings that begin so."""
        from click.shell_completion import CompletionItem

        folder, slash, begun = incomplete.rpartition("/")
        found = []
        try:
            for entry in sorted(Path(folder + slash).expanduser().iterdir()):
                fits = entry.is_dir() or not self.suffixes or entry.name.lower().endswith(self.suffixes)
                hidden = entry.name.startswith(".") and not begun.startswith(".")
                if fits and not hidden and entry.name.startswith(begun):
                    found.append(CompletionItem(f"{folder}{slash}{entry.name}", type=PATH))
        except OSError:
            pass
        return found


class Planner(click.ParamType[str]):
    """The name of a planner."""

    name = "NAME"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the name, if there is such a planner."""
        name = str(value)
        if name not in PLANNER_NAMES:
            from mavplan.scenario.report import nearest

            near = nearest(name, PLANNER_NAMES)
            like = f"did you mean {near}?" if near else f"known are {', '.join(PLANNER_NAMES)}"
            self.fail(f"there is no planner {name!r}: {like}", param, ctx)
        return name

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> "list[CompletionItem[Any]]":
        """Return the names that begin so, without loading a planner."""
        from click.shell_completion import CompletionItem

        return [CompletionItem(name) for name in PLANNER_NAMES if name.startswith(incomplete)]
