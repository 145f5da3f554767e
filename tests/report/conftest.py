"""A planned valley and what a report shows of it."""

import pytest

from mavplan.comparison import compare
from mavplan.plan import make_plan
from mavplan.plan_file import dumps
from mavplan.report.content import report_content
from mavplan.scenario import load_scenario
from mavplan.stored_plan import parse_plan
from tests.test_gallery import GALLERY


@pytest.fixture(scope="session")
def valley():
    """The plan and its report, beside the other planners."""
    scenario = load_scenario(GALLERY / "valley/scenario.toml")
    plan = make_plan(scenario)
    stored = parse_plan(dumps(plan), "valley")
    return plan, report_content(plan.built.mission, stored, "valley", compare(scenario))
