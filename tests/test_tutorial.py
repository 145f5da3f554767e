"""The tutorial's commands, run one after another as they stand there."""

import os
import re
import socket
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TUTORIAL = ROOT / "docs/tutorial.md"


def test_every_command_of_the_tutorial_works_in_its_order(tmp_path):
    """In an empty folder, with another port and a faster mock."""
    commands = re.findall(r"```sh\n(.*?)```", TUTORIAL.read_text("utf-8"), re.DOTALL)
    assert len(commands) >= 9
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    script = "\n".join(["set -e", 'trap "kill %1 2>/dev/null || true" EXIT', *commands])
    script = script.replace(":5760", f":{port}").replace("--speed 20", "--speed 60")
    tools = tmp_path / "bin"
    tools.mkdir()
    (tools / "mavplan").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m mavplan "$@"\n')
    (tools / "mavplan").chmod(0o755)
    environment = {**os.environ, "PATH": f"{tools}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    desk = tmp_path / "desk"
    desk.mkdir()
    done = subprocess.run(
        ["bash", "-c", script],
        cwd=desk,
        env=environment,
        capture_output=True,
        text=True,
        timeout=400,
        check=False,
    )
    assert done.returncode == 0, f"{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    made = {path.name for path in (desk / "rescue").iterdir()}
    assert {
        "rescue.plan",
        "rescue.mavplan.json",
        "rescue.png",
        "rescue.html",
        "flight.tlog",
        "proof.png",
    } <= made
    assert "stored and verified" in done.stdout
    assert not (desk / "rescue/rest").exists(), "somebody was left over"
