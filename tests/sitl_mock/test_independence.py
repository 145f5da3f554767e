"""The mock must be able to disagree with the client: it shares no code with it."""

import subprocess
import sys
from pathlib import Path

import sitl_mock

PACKAGE = Path(sitl_mock.__file__).parent


def test_sitl_mock_imports_nothing_from_mavplan() -> None:
    """Loading every module of the mock loads none of mavplan, nor pymavlink's mavutil."""
    modules = ", ".join(
        ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
        for path in sorted(PACKAGE.rglob("*.py"))
        if path.stem != "__init__"
    )
    code = f"import {modules}, sys; print(sorted(m for m in sys.modules if m.startswith('mavplan') or 'mavutil' in m))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_no_module_of_the_mock_names_mavplan_in_an_import() -> None:
    """Not even inside a function."""
    for path in PACKAGE.rglob("*.py"):
        for line in path.read_text().splitlines():
            assert not line.strip().startswith(("import mavplan", "from mavplan")), f"{path}: {line}"
