"""What is shipped: both packages and the template in the wheel, and a locked version of everything asked for."""

import itertools
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_the_wheel_holds_both_packages_their_types_and_the_template(tmp_path):
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True, timeout=60)
    (wheel,) = tmp_path.glob("mavplan-*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {
        *("mavplan/py.typed", "sitl_mock/py.typed", "sitl_mock/__main__.py"),
        *("mavplan/template/scenario.toml", "mavplan/template/users.csv"),
    } <= names
    assert not [name for name in names if name.startswith(("tests", "benchmarks", "missions"))]


def test_every_dependency_is_locked_with_hashes():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    asked = [*project["dependencies"], *itertools.chain(*project["optional-dependencies"].values())]
    lock = (ROOT / "requirements.lock").read_text()
    for requirement in asked:
        name = re.match(r"[\w.-]+", requirement)[0].lower().replace("_", "-")
        assert re.search(rf"^{re.escape(name)}==[^\n]*\\\n\s+--hash=sha256:", lock, re.MULTILINE), name


def test_every_command_and_document_that_the_readme_names_is_there():
    from mavplan.cli import COMMANDS

    readme = (ROOT / "README.md").read_text()
    for link in re.findall(r"\]\(((?!https?:)[^)#]+)\)", readme):
        assert (ROOT / link).exists(), link
    for command in COMMANDS:
        assert f"`mavplan {command}`" in readme or f"`{command}`" in readme, command
