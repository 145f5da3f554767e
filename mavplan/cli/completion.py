"""``mavplan completion``: what makes a shell complete commands, options, names and files.

Click finds what could stand at a place; here is how bash, zsh and fish are told which of it are files, so that they
quote names, go on into folders, and offer those endings only that a command takes.
"""

from typing import Any

import click
from click.shell_completion import (
    BashComplete,
    CompletionItem,
    FishComplete,
    ShellComplete,
    ZshComplete,
    add_completion_class,
)

from mavplan.cli.kinds import PATH

VARIABLE = "_MAVPLAN_COMPLETE"
"""Click answers a shell that asks with this variable."""


class Bash(BashComplete):
    """Bash: names of files are left to ``compopt -o filenames``."""

    source_template = BashComplete.source_template.replace(
        "elif [[ $type == 'plain' ]]",
        f"elif [[ $type == '{PATH}' ]]; then\n            compopt -o filenames\n            COMPREPLY+=(\"$value\")\n"
        "        elif [[ $type == 'plain' ]]",
    )

    def source(self) -> str:
        """Return the script; whether this machine's bash is new enough is the reader's affair."""
        return self.source_template % self.source_vars()


class Zsh(ZshComplete):
    """Zsh: names of files are added as such, so that a folder gets its slash and no space."""

    source_template = ZshComplete.source_template.replace(
        'elif [[ "$type" == "dir" ]]',
        f'elif [[ "$type" == "{PATH}" ]]; then\n            compadd -U -f -- "$key"\n'
        '        elif [[ "$type" == "dir" ]]',
    )


class Fish(FishComplete):
    """Fish: a folder ends in a slash, after which fish puts no space."""

    def format_completion(self, item: "CompletionItem[Any]") -> str:
        """Return the line for fish."""
        if item.type != PATH:
            return super().format_completion(item)
        from pathlib import Path

        return f"plain,{item.value}{'/' if Path(item.value).expanduser().is_dir() else ''}"


SHELLS: dict[str, type[ShellComplete]] = {"bash": Bash, "zsh": Zsh, "fish": Fish}


def register() -> None:
    """Put these in the place of click's own."""
    for shell, kind in SHELLS.items():
        add_completion_class(kind, shell)


@click.command("completion", short_help="Print what makes a shell complete mavplan's commands.")
@click.argument("shell", type=click.Choice(list(SHELLS)))
def completion_command(shell: str) -> None:
    """Print the script that makes SHELL complete commands, options, planners and file names.

    \b
    mavplan completion bash
    echo 'eval "$(mavplan completion bash)"' >> ~/.bashrc
    echo 'eval "$(mavplan completion zsh)"' >> ~/.zshrc
    mavplan completion fish > ~/.config/fish/completions/mavplan.fish
    """
    from mavplan.cli import cli
    from mavplan.cli.console import answer, mode

    script = SHELLS[shell](cli, {}, "mavplan", VARIABLE).source()
    answer({"shell": shell, "script": script})
    if not mode().as_json:
        click.echo(script)
