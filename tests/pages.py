"""The commands of a documentation page, run in a shell as somebody types them."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def commands_of(page):
    """The blocks of shell commands of a page's text."""
    return re.findall(r"```sh\n(.*?)```", page, re.DOTALL)


def typed(script, desk, tools):
    """What a script prints in a folder, ``mavplan`` being this one; ``tools`` is an empty folder for that command."""
    (tools / "mavplan").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m mavplan "$@"\n')
    (tools / "mavplan").chmod(0o755)
    environment = {**os.environ, "PATH": f"{tools}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        ["bash", "-c", f"set -e\n{script}"],
        cwd=desk,
        env=environment,
        capture_output=True,
        text=True,
        timeout=400,
        check=False,
    )
    assert done.returncode == 0, f"{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout
