"""How fast the report of 1,960 users opens and answers in Chromium: ``python -m benchmarks.report``."""

import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.timing import best_s, show

HYDRANTS = Path(__file__).resolve().parents[2] / "shared/data/cambridge_hydrants.geojson"
SCENARIO = f"""users = "{HYDRANTS}"
[home]
lat_deg = 42.3736
lon_deg = -71.1097
alt_amsl_m = 10.0
[radio]
snr_threshold_db = 5.3047  # R 300 m at 100 m
[planner]
clusters = 40
"""


def mavplan(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "mavplan", *words], check=True, capture_output=True)


def main() -> int:
    chromium = shutil.which("chromium")
    if chromium is None or not HYDRANTS.is_file():
        print(f"needs Chromium (apt-get install chromium) and {HYDRANTS}")
        return 2
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as started:
        (Path(folder) / "scenario.toml").write_text(SCENARIO)
        mission = Path(folder) / "hydrants.plan"
        mavplan("plan", f"{folder}/scenario.toml", "-o", str(mission))
        begin = time.perf_counter()
        mavplan("report", str(mission), "--no-compare")
        written_s = time.perf_counter() - begin
        report = mission.with_suffix(".html")
        browser = started.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": 1200, "height": 900})
        opened_s = best_s(lambda: page.goto(report.as_uri()), repeats=3)
        page.hover('.stop[data-stop="2"]', force=True)
        heading = page.locator("#users thead button").first
        sorted_s = best_s(heading.click, repeats=3)
        size = report.stat().st_size
        browser.close()
    show(
        "report of 1,960 users",
        [
            ("mavplan report --no-compare", f"{written_s:.2f} s", ""),
            ("the page opens", f"{opened_s:.2f} s", "wanted: under 3 s"),
            ("its table of users sorts", f"{sorted_s:.2f} s", ""),
            ("size", f"{size / 1e6:.2f} MB", "wanted: under 5 MB"),
        ],
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
