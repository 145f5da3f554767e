"""Draw the sixty users of this example: pairs of a homogeneous Poisson point process, written as users.csv.

Run from anywhere: ``python missions/hppp60/draw.py``. The same seed writes the same file.
"""

from pathlib import Path

from mavplan.geo import LocalPlane
from mavplan.hppp import draw_pairs

HERE = Path(__file__).parent
HOME_LAT_DEG, HOME_LON_DEG = 47.58, 21.12
MEAN_USERS = 60.0
SIDE_M = 3000.0
SEED = 1
DEMAND_MBIT = 10


def users_csv() -> str:
    """Return the users file as text; home is the south-western corner of the square."""
    xy_m, _ = draw_pairs(MEAN_USERS, SIDE_M, seed=SEED)
    lat_deg, lon_deg = LocalPlane(HOME_LAT_DEG, HOME_LON_DEG).to_lat_lon_deg(xy_m)
    lines = ["name,lat_deg,lon_deg,demand_mbit,pair"]
    for i, (lat, lon) in enumerate(zip(lat_deg, lon_deg, strict=True)):
        lines.append(f"u{i + 1:02d},{lat:.7f},{lon:.7f},{DEMAND_MBIT},{i // 2 + 1}")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    (HERE / "users.csv").write_text(users_csv(), encoding="utf-8")
