"""The tutorial's commands, run one after another as they stand there."""

import re
import socket

from tests.pages import ROOT, commands_of, typed

TUTORIAL = ROOT / "docs/tutorial.md"


def run_all(page, ports, folder):
    """Run the commands of a page in an empty folder, with other ports and faster mocks."""
    commands = commands_of(page.read_text("utf-8"))
    assert len(commands) >= 7
    script = "\n".join(['trap "kill %1 %2 2>/dev/null || true" EXIT', *commands])
    for port in ports:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            script = script.replace(f":{port}", f":{free.getsockname()[1]}")
    script = script.replace("--speed 20", "--speed 60")
    tools, desk = folder / "bin", folder / "desk"
    tools.mkdir()
    desk.mkdir()
    return typed(script, desk, tools), desk / "rescue"


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
