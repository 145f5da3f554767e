"""The documentation's examples run as they stand."""

import re
import subprocess
import sys

import pytest

from tests.pages import ROOT, commands_of, typed

EXAMPLES = re.findall(r"```python\n(.*?)```", (ROOT / "docs/api.md").read_text("utf-8"), re.DOTALL)


def test_there_are_examples():
    assert EXAMPLES


SAYS = [
    r"\d+ stops, \d+ s\n",
    r"(valley \d: starts \d+ s, \d+ s\n){2}",
    r"stored and verified: \d+ items on ardupilot, system 1\n",
    r"everybody got what they need: True\n",
]
WRITES = ["valley.plan", "fleet.html", None, None]


@pytest.mark.parametrize(("example", "says", "writes"), list(zip(EXAMPLES, SAYS, WRITES, strict=True)))
def test_an_example_in_python_runs_as_it_stands(example, says, writes, tmp_path):
    (tmp_path / "missions").symlink_to(ROOT / "missions")
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", example],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(says, done.stdout)
    if writes:
        assert (tmp_path / writes).stat().st_size > 500


def test_links_of_the_readme_and_the_pages_lead_to_files():
    broken = []
    for page in [
        ROOT / "README.md",
        *sorted((ROOT / "docs").rglob("*.md")),
        *sorted((ROOT / "missions").rglob("*.md")),
    ]:
        for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text("utf-8")):
            if not re.match(r"[a-z]+:|#", target) and not (page.parent / target.partition("#")[0]).exists():
                broken.append(f"{page.relative_to(ROOT)}: {target}")
    assert broken == []


def test_the_examples_of_fleets_and_batteries_print_what_the_page_shows(tmp_path):
    page = (ROOT / "docs/fleet.md").read_text("utf-8")
    desk, tools = tmp_path / "desk", tmp_path / "bin"
    desk.mkdir()
    tools.mkdir()
    (desk / "missions").symlink_to(ROOT / "missions")
    said = typed("\n".join(commands_of(page)), desk, tools)
    tables = re.findall(r"```\n((?:vehicle|sortie) .*?)```", page, re.DOTALL)
    assert len(tables) == 2
    for table in tables:
        assert table in said
