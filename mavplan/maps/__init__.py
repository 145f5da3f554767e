"""A plan for other people's map programs: KML and KMZ, GPX, GeoJSON, a CSV table. Text out; writing files is not here.

All of them are written from one `mavplan.maps.content.PlanMap`, made from a mission and, where there is one, its plan.
"""

from collections.abc import Callable

from mavplan.maps.content import PlanMap, plan_map
from mavplan.maps.csv_table import users_csv
from mavplan.maps.geojson import to_geojson
from mavplan.maps.gpx import to_gpx
from mavplan.maps.kml import to_kml, to_kmz

__all__ = ["MAPS", "PlanMap", "plan_map"]

MAPS: dict[str, Callable[[PlanMap], str | bytes]] = {
    ".kml": to_kml,
    ".kmz": to_kmz,
    ".gpx": to_gpx,
    ".geojson": to_geojson,
    ".csv": users_csv,
}
"""How each kind of map file is written, by the ending of its name."""
