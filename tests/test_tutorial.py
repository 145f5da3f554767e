"""The tutorial's commands, run one after another as they stand there."""

import os
import re
import socket
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TUTORIAL = ROOT / "docs/tutorial.md"


def run_all(page, ports, folder):
    """Run the commands of a page in an empty folder, with other ports and faster mocks."""
    commands = re.findall(r"```sh\n(.*?)```", page.read_text("utf-8"), re.DOTALL)
    assert len(commands) >= 7
    script = "\n".join(["set -e", 'trap "kill %1 %2 2>/dev/null || true" EXIT', *commands])
    for port in ports:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            script = script.replace(f":{port}", f":{free.getsockname()[1]}")
    script = script.replace("--speed 20", "--speed 60")
    tools = folder / "bin"
    tools.mkdir()
    (tools / "mavplan").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m mavplan "$@"\n')
    (tools / "mavplan").chmod(0o755)
    environment = {**os.environ, "PATH": f"{tools}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    desk = folder / "desk"
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
    return done.stdout, desk / "rescue"


def test_every_command_of_the_tutorial_works_in_its_order(tmp_path):
    said, rescue = run_all(TUTORIAL, (5760,), tmp_path)
    made = {path.name for path in rescue.iterdir()}
    assert {
        "rescue.plan",
        "rescue.mavplan.json",
        "rescue.png",
        "rescue.html",
        "flight.tlog",
        "proof.png",
    } <= made
    assert "stored and verified" in said
    assert not (rescue / "rest").exists(), "somebody was left over"


def test_every_command_of_the_fleets_page_works_in_its_order(tmp_path):
    said, rescue = run_all(ROOT / "docs/howto/fleet.md", (5760, 5770), tmp_path)
    assert said.count("stored and verified") == 2
    assert {"fleet.html", "flight-1.tlog", "flight-2.tlog"} <= {path.name for path in rescue.iterdir()}
    sample = re.search(
        r"```text\n(vehicle  starts.*?)\n\n", (ROOT / "docs/howto/fleet.md").read_text("utf-8"), re.DOTALL
    )
    assert sample
    assert sample[1] in said
