"""GPX 1.1, for hand-held receivers (https://www.topografix.com/GPX/1/1/): users as waypoints, the flight as a route."""

from xml.etree.ElementTree import Element

from mavplan.maps.content import PlanMap
from mavplan.maps.xml_writing import add, document

_NAMESPACE = "http://www.topografix.com/GPX/1/1"


def to_gpx(content: PlanMap) -> str:
    """Return the map as GPX; the heights of the route are above mean sea level."""
    root = Element("gpx", xmlns=_NAMESPACE, version="1.1", creator="mavplan")
    add(add(root, "metadata"), "name", content.title)
    for user in content.users:
        point = add(root, "wpt", lat=f"{user.lat_deg:.7f}", lon=f"{user.lon_deg:.7f}")
        add(point, "name", user.name)
        via = f"through {user.mate}" if user.d2d else "from the air"
        add(point, "desc", f"{user.demand_mbit:g} Mbit, {via} at stop {user.stop}")
    home = add(root, "wpt", lat=f"{content.home.lat_deg:.7f}", lon=f"{content.home.lon_deg:.7f}")
    add(home, "ele", f"{content.home.alt_amsl_m:.2f}")
    add(home, "name", "Home")
    route = add(root, "rte")
    add(route, "name", content.title)
    for stop in content.stops:
        point = add(route, "rtept", lat=f"{stop.place.lat_deg:.7f}", lon=f"{stop.place.lon_deg:.7f}")
        add(point, "ele", f"{stop.place.alt_amsl_m:.2f}")
        add(point, "name", stop.title)
        add(point, "desc", f"hold {stop.hold_s:g} s")
    return document(root)
