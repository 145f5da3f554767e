"""The mock as a running process, for tests that talk to it over sockets."""

import contextlib
import subprocess
import sys
from collections.abc import Iterator

WAIT_S = 10.0


@contextlib.contextmanager
def mock(
    *arguments: str, lines: int = 1, module: str = "sitl_mock"
) -> Iterator[tuple[subprocess.Popen[str], list[str]]]:
    """A running mock and what it printed of its ends; ended by SIGTERM, which must give exit code 0."""
    command = [sys.executable, "-m", module, *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process, [process.stdout.readline().strip() for _ in range(lines)]
        finally:
            if process.poll() is None:
                process.terminate()
            process.wait(WAIT_S)


def port_of(line: str) -> int:
    return int(line.rpartition(":")[2])
