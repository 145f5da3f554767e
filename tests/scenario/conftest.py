"""A fixture that writes a scenario with its users and reads it."""

from pathlib import Path

import pytest

from mavplan.errors import InputError
from mavplan.scenario import load_scenario

HOME = "[home]\nlat_deg = 46.5\nlon_deg = 7.5\nalt_amsl_m = 600\n"
USERS = "name,lat_deg,lon_deg\nAnna,46.501,7.501\nBen,46.502,7.502\n"


class Desk:
    """A folder in which scenarios are written and read."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def write(self, users=USERS, toml="", home=HOME, name="users.csv"):
        """Write both files; ``toml`` stands before ``home``'s table where it has top-level keys only."""
        if users is not None:
            data = users if isinstance(users, bytes) else users.encode()
            (self.folder / name).write_bytes(data)
        path = self.folder / "scenario.toml"
        text = toml if isinstance(toml, bytes) else f'users = "{name}"\n{home}\n{toml}'.encode()
        path.write_bytes(text)
        return path

    def load(self, *args, **kwargs):
        """Write both files and read them."""
        return load_scenario(self.write(*args, **kwargs))

    def problems(self, *args, **kwargs):
        """Write both files and return the problems of the error that reading them raises, as (code, text)."""
        with pytest.raises(InputError) as caught:
            self.load(*args, **kwargs)
        assert all(problem.severity == "error" for problem in caught.value.problems)
        folder = f"{self.folder}/"
        return [(problem.code, str(problem).replace(folder, "")) for problem in caught.value.problems]

    def only_problem(self, *args, **kwargs):
        """Return the one problem that there must be, as (code, text)."""
        found = self.problems(*args, **kwargs)
        assert len(found) == 1, found
        return found[0]


@pytest.fixture
def desk(tmp_path):
    return Desk(tmp_path)
