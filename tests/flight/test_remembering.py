"""Which vehicle holds a mission is written as soon as that is verified, not when the flight is over."""

import json
from types import SimpleNamespace

from mavplan.cli.fly import Remembering


def uploaded():
    return SimpleNamespace(autopilot="px4", vehicle=SimpleNamespace(system=7), opaque_id=42)


class Watcher:
    """Hands that note what is written beside the file whenever they are called."""

    def __init__(self, plan):
        self.plan = plan
        self.seen = []

    def see(self, session, now):
        self.seen.append((now, json.loads(self.plan.read_text()).get("vehicle", {}).get("opaque_id")))


def test_the_vehicle_is_written_once_it_is_verified_and_before_anything_is_decided(tmp_path):
    plan = tmp_path / "x.mavplan.json"
    plan.write_text('{"mavplan": 1}')
    watcher = Watcher(plan)
    hands = Remembering(tmp_path / "x.plan", watcher)
    session = SimpleNamespace(uploaded=None)
    hands.see(session, 1.0)
    session.uploaded = uploaded()
    hands.see(session, 2.0)
    assert watcher.seen == [(1.0, None), (2.0, 42)]
    assert hands.problems == ()


def test_it_is_written_only_once_so_that_its_time_is_not_that_of_the_end(tmp_path):
    plan = tmp_path / "x.mavplan.json"
    plan.write_text('{"mavplan": 1}')
    hands = Remembering(tmp_path / "x.plan", Watcher(plan))
    session = SimpleNamespace(uploaded=uploaded())
    hands.see(session, 1.0)
    assert json.loads(plan.read_text())["vehicle"]["verified_at"]
    plan.write_text('{"mavplan": 2}')
    hands.see(session, 2000.0)
    assert json.loads(plan.read_text()) == {"mavplan": 2}
