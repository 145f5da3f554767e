"""Commands run as a person runs them, with output, errors and exit code apart."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


class Ran:
    """What a command left behind."""

    def __init__(self, code, out, err):
        self.code, self.out, self.err = code, out, err


@pytest.fixture
def mavplan(capfd, monkeypatch, tmp_path):
    """Run a command in this process, in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*args):
        from mavplan.cli import run as run_command

        code = run_command([str(arg) for arg in args])
        captured = capfd.readouterr()
        return Ran(code, captured.out, captured.err)

    return run


@pytest.fixture
def mavplan_process(tmp_path):
    """Run a command as a process of its own, in an empty folder."""

    def run(*args, **options):
        command = [sys.executable, "-m", "mavplan", *(str(arg) for arg in args)]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, **options)
        return Ran(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture
def gallery():
    """The folder of the examples."""
    return ROOT / "missions"
