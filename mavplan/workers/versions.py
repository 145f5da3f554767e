"""What numbers depend on, so that they are the same wherever they are worked out."""

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

import mavplan

COUNTING_CODE = ("planners/*.py", "radio.py", "hppp.py", "study/cases.py", "study/regime.py")
"""Modules whose change can change a number; the radio's defaults are among `stand_ins`."""


ALL_CODE = ("**/*.py",)


@cache
def versions(code: tuple[str, ...] = COUNTING_CODE) -> dict[str, str]:
    """Return the versions of what numbers depend on; of mavplan also a digest of the code that counts.

    Two states of the code can bear one version number, on a developer's machine or on a worker of a cluster.
    """
    package = Path(mavplan.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(path for pattern in code for path in package.glob(pattern)):
        digest.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    found = {name: version(name) for name in ("mavplan", "numpy", "scipy", "scikit-learn")}
    return found | {"code": digest.hexdigest()[:16]}
