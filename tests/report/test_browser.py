"""What a person does with a report, in a real browser: look, point, type, sort, print. Skipped without Chromium."""

import shutil
from pathlib import Path

import pytest

from mavplan.formats.atomic import atomic_write
from mavplan.report.page import render
from tests.test_gallery import GALLERY

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
QUIET = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
]  # fmt: skip
HYDRANTS = Path(__file__).resolve().parents[3] / "shared/data/cambridge_hydrants.geojson"

pytestmark = pytest.mark.skipif(
    CHROMIUM is None, reason="there is no Chromium here (apt-get install chromium)"
)


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=CHROMIUM, args=QUIET)
        yield chromium
        chromium.close()


@pytest.fixture
def page(browser, valley, tmp_path):
    """The valley's report, opened; whatever it complains of fails the test."""
    path = tmp_path / "valley.html"
    atomic_write(path, render(valley[1]))
    page = browser.new_page(viewport={"width": 1200, "height": 900})
    said = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on(
        "request", lambda request: said.append(request.url) if not request.url.startswith("file:") else None
    )
    page.goto(path.as_uri())
    yield page
    assert said == []
    page.close()


def lit(page, what):
    return page.locator(f"{what}.on").count()


def test_pointing_at_a_stop_shows_whom_it_serves_everywhere(page, valley):
    stop = valley[1].stops[2]
    page.hover('.stop[data-stop="3"]')
    assert page.locator("#panel h3").inner_text() == "Stop 3"
    assert [name.split(":")[0] for name in page.locator("#panel li").all_inner_texts()] == [
        valley[1].users[n].name for n in stop.users
    ]
    assert lit(page, "#users tbody tr") == len(stop.users)
    assert (
        lit(page, "#stops tbody tr")
        == lit(page, ".hold")
        == lit(page, ".stop")
        == lit(page, ".coverage")
        == 1
    )
    assert f"mission item {stop.items}" in page.locator("#panel").inner_text()


def test_pointing_at_a_user_leads_to_its_stop_and_mission_item(page, valley):
    user = next(user for user in valley[1].users if user.d2d)
    page.locator("#users tbody tr", has_text=user.name).first.hover()
    words = page.locator("#panel").inner_text()
    assert words.startswith(user.name)
    assert f"through {user.mate} at stop {user.stop}" in words
    assert f"mission item {valley[1].stops[user.stop - 1].items}" in words


def test_a_click_keeps_a_stop_until_escape(page):
    page.click('.stop[data-stop="1"]')
    page.hover('.stop[data-stop="5"]')
    assert page.locator("#panel h3").inner_text() == "Stop 1"
    page.keyboard.press("Escape")
    assert page.locator("#panel h3").count() == 0
    page.hover('.stop[data-stop="6"]')
    assert page.locator("#panel h3").inner_text() == "Stop 6"


def test_it_works_by_keyboard(page):
    page.focus("#map")
    before = page.get_attribute("#map", "viewBox")
    page.keyboard.press("+")
    page.keyboard.press("ArrowLeft")
    assert page.get_attribute("#map", "viewBox") != before
    page.keyboard.press("0")
    assert page.get_attribute("#map", "viewBox") == before
    page.keyboard.press("Tab")
    assert page.locator("#panel h3").inner_text() == "Stop 1"
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    assert page.locator("#panel h3").inner_text() == "Stop 2"
    page.focus("#users thead button")
    page.keyboard.press("Enter")
    assert page.locator("#users th").first.get_attribute("aria-sort") == "ascending"


def test_a_click_on_a_heading_sorts_up_then_down(page, valley):
    def names():
        return page.locator("#users tbody tr td:first-child").all_inner_texts()

    by_demand = sorted(valley[1].users, key=lambda user: user.demand_mbit)
    heading = page.locator("#users thead button", has_text="Demand")
    heading.click()
    cells = page.locator("#users tbody tr td:nth-child(2)").all_inner_texts()
    assert [float(cell) for cell in cells] == [user.demand_mbit for user in by_demand]
    heading.click()
    assert names()[0] == by_demand[-1].name
    page.locator("#stops thead button", has_text="Hold begins").click()
    assert page.locator("#stops tbody tr td:first-child").all_inner_texts() == [
        str(stop.number) for stop in valley[1].stops
    ]


def test_layers_are_switched_and_the_filter_leaves_what_was_asked_for(page):
    assert page.locator(".coverage").first.is_visible()
    page.uncheck('[data-layer="coverage"]')
    assert not page.locator(".coverage").first.is_visible()
    assert not page.locator(".link").first.is_visible()
    page.check('[data-layer="links"]')
    assert page.locator(".link").first.is_visible()
    page.fill("#filter", "BRIDGE")
    assert page.locator("#users tbody tr:visible").count() == 2
    assert page.locator("#filtered").inner_text() == "2 of 12"


def test_the_wheel_zooms_about_the_pointer_and_a_drag_moves(page):
    box = page.locator("#map").bounding_box()
    page.mouse.move(box["x"] + 300, box["y"] + 200)
    before = [float(part) for part in page.get_attribute("#map", "viewBox").split()]
    page.mouse.wheel(0, -100)
    page.wait_for_function(f"document.getElementById('map').viewBox.baseVal.width < {before[2] * 0.99}")
    zoomed = [float(part) for part in page.get_attribute("#map", "viewBox").split()]
    page.mouse.down()
    page.mouse.move(box["x"] + 350, box["y"] + 260, steps=4)
    page.mouse.up()
    moved = [float(part) for part in page.get_attribute("#map", "viewBox").split()]
    assert moved[0] < zoomed[0]
    assert moved[1] < zoomed[1]
    assert moved[2] == zoomed[2]


def test_it_prints_whole_without_its_controls(page, tmp_path):
    page.emulate_media(media="print")
    assert not page.locator(".controls").first.is_visible()
    assert page.locator("#users tbody tr").last.is_visible()
    paper = page.pdf(path=tmp_path / "valley.pdf", format="A4")
    assert paper.startswith(b"%PDF")
    pages = paper.count(b"/Type /Page") - paper.count(b"/Type /Pages")
    assert 1 <= pages <= 6


def test_it_fits_a_telephone(page):
    page.set_viewport_size({"width": 390, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


@pytest.mark.skipif(not HYDRANTS.is_file(), reason=f"{HYDRANTS} is not here")
def test_two_thousand_users_open_in_a_moment_and_stay_usable(browser, mavplan_report_of_hydrants):
    path = mavplan_report_of_hydrants
    assert path.stat().st_size < 5_000_000
    page = browser.new_page(viewport={"width": 1200, "height": 900})
    page.goto(path.as_uri())
    assert page.locator(".user").count() == 1960
    page.hover('.stop[data-stop="2"]', force=True)
    page.locator("#users thead button").first.click()
    assert page.locator("#panel h3").count() == 1
    page.close()


@pytest.fixture
def mavplan_report_of_hydrants(tmp_path):
    from mavplan.cli import run

    (tmp_path / "scenario.toml").write_text(
        f'users = "{HYDRANTS}"\n[home]\nlat_deg = 42.3736\nlon_deg = -71.1097\nalt_amsl_m = 10.0\n'
        "[radio]\nsnr_threshold_db = 5.3\n[planner]\nclusters = 40\n"
    )
    mission = tmp_path / "hydrants.plan"
    assert run(["plan", str(tmp_path / "scenario.toml"), "-o", str(mission)]) == 0
    assert run(["report", str(mission), "--no-compare"]) == 0
    return tmp_path / "hydrants.html"


@pytest.fixture(scope="module")
def fleet_files(tmp_path_factory):
    """Three vehicles of the valley, on one page."""
    from mavplan.cli import run

    folder = tmp_path_factory.mktemp("fleet")
    scenario = str(GALLERY / "valley/scenario.toml")
    assert run(["plan", scenario, "--vehicles", "3", "-o", str(folder / "fleet.plan")]) == 0
    files = sorted(str(path) for path in folder.glob("fleet-*.plan"))
    assert run(["report", *files]) == 0
    return folder, files


def test_a_fleet_is_on_one_page_with_a_clock_for_all(browser, fleet_files):
    folder, files = fleet_files
    said = []
    page = browser.new_page(viewport={"width": 1200, "height": 900})
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto((folder / "fleet.html").as_uri())
    assert page.locator("h1").inner_text() == "fleet"
    assert page.locator("#flights tbody tr").count() == page.locator(".path").count() == len(files) == 3
    assert page.locator(".user").count() == 12
    page.hover('.stop[data-stop="2.1"]')
    assert page.locator("#panel h3").inner_text() == "Stop 2.1"
    served = page.locator("#users tbody tr.on").all()
    assert served
    assert all(row.get_attribute("data-of") == "2.1" for row in served)
    assert lit(page, ".hold") == lit(page, "#stops tbody tr") == 1
    page.locator("#stops thead button", has_text="Stop").click()
    numbers = page.locator("#stops tbody tr td:first-child").all_inner_texts()
    assert numbers == sorted(numbers)
    page.check('[data-layer="names"]')
    assert page.locator(".name").first.is_visible()
    assert said == []
    page.close()


def test_the_bar_on_paper_is_as_long_as_it_says(page):
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    bar_px = page.evaluate("document.getElementById('bar-line').getBoundingClientRect().width")
    map_px = page.evaluate("document.getElementById('map').getScreenCTM().a")
    words = page.locator("#bar-text").inner_text()
    metres = float(words.split()[0]) * (1000 if words.endswith("km") else 1)
    assert bar_px == pytest.approx(metres * map_px, rel=0.03)
