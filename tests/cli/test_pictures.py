"""Pictures from the command line: names that no font has are one warning, whatever draws them."""

import pytest

from mavplan.stored_plan import read_plan
from tests.proof.plans import flight_of
from tests.track.logs import to_tlog

pytest.importorskip("matplotlib", reason="pictures need matplotlib (extra 'figures')")

SAID = "the fonts here cannot draw 救援隊第一: the picture has numbers in their place"


@pytest.fixture
def rescue(mavplan, tmp_path, monkeypatch):
    """The template with a Chinese name, where there are matplotlib's own fonts only."""
    from mavplan.figures import fonts

    monkeypatch.setattr(fonts, "FALLBACKS", ())
    monkeypatch.setattr(fonts, "OTHERS", ())
    fonts.families.cache_clear()
    assert mavplan("init", ".").code == 0
    users = tmp_path / "users.csv"
    users.write_text(
        users.read_text(encoding="utf-8").replace("Rottal lodge", "救援隊第一"), encoding="utf-8"
    )
    yield tmp_path
    fonts.families.cache_clear()


def test_names_that_cannot_be_drawn_are_told_once_by_plan_and_prove(mavplan, rescue):
    ran = mavplan("plan", "scenario.toml", "-o", "r.plan", "-o", "r.png", "-o", "r.svg")
    assert (ran.code, ran.err.count(SAID), "UserWarning" in ran.err) == (0, 1, False)
    (rescue / "r.tlog").write_bytes(to_tlog(flight_of(read_plan(rescue / "r.mavplan.json"), hz=2.0)))
    ran = mavplan("prove", "r.tlog", "--plan", "r.plan", "-o", "proof.png")
    assert (ran.code, ran.err.count(SAID), "UserWarning" in ran.err) == (0, 1, False)
    assert SAID not in mavplan("prove", "r.tlog", "--plan", "r.plan").err


def test_names_that_cannot_be_drawn_are_told_once_by_compare_and_for_a_fleet(mavplan, rescue):
    ran = mavplan("compare", "scenario.toml", "-o", "c.png")
    assert (ran.code, ran.err.count(SAID), "UserWarning" in ran.err) == (0, 1, False)
    ran = mavplan("plan", "scenario.toml", "--vehicles", "2", "-o", "f.plan", "-o", "f.png")
    assert (ran.code, ran.err.count(SAID)) == (0, 1)
    assert SAID not in mavplan("plan", "scenario.toml", "-o", "r.plan").err
