"""MAVProxy as a running program, for whoever wants it as a foreign ground station."""

import subprocess
import time
from pathlib import Path

ENVIRONMENT = Path(__file__).resolve().parents[2] / ".venv-mavproxy"
MAVPROXY = ENVIRONMENT / "bin/mavproxy.py"
WAIT_S = 30.0


class MavProxy:
    """MAVProxy with its standard input and what it has printed."""

    def __init__(self, master: str, folder: Path, modules: str = "wp,cmdlong,misc") -> None:
        self.log = folder / "mavproxy.txt"
        command = [str(ENVIRONMENT / "bin/python"), str(MAVPROXY), f"--master={master}", "--no-state"]
        self._out = self.log.open("wb")
        self.process = subprocess.Popen(
            [*command, f"--default-modules={modules}"],
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=self._out,
            stderr=subprocess.STDOUT,
        )

    def type(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n".encode())
        self.process.stdin.flush()

    def wait_for(self, text: str) -> str:
        """Return all that was printed once `text` is in it; its exit code says nothing, so the output must."""
        until = time.monotonic() + WAIT_S
        while time.monotonic() < until:
            printed = self.log.read_text(errors="replace")
            if text in printed:
                return printed
            time.sleep(0.1)
        raise AssertionError(
            f"MAVProxy did not print {text!r} within {WAIT_S} s:\n{self.log.read_text(errors='replace')}"
        )

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self._out.close()
