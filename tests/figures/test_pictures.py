"""Pictures of plans, comparisons and proofs: what is on them, that nothing covers anything, and that maps keep size."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from matplotlib.colors import to_hex
from matplotlib.text import Annotation

from mavplan.comparison import compare
from mavplan.figures.files import comparison_figure, draw_plan, plan_figure, proof_figure
from mavplan.figures.map import way_home_m
from mavplan.figures.proof_map import planned_ways_m
from mavplan.figures.surroundings import ZONE, surroundings
from mavplan.mission.geofence import Fence, RallyPoint
from mavplan.plan import make_plan
from mavplan.plan_file import dumps
from mavplan.proof.prove import prove
from mavplan.stored_plan import parse_plan
from mavplan.track.read import parse_track
from tests.figures.conftest import LONG, circle, named, polygon
from tests.proof.plans import flight_of
from tests.support import make_scenario
from tests.track.logs import to_tlog

AROUND = {"no-fly zone", "fence: stay in", "fence: stay out", "rally point", "pinned stop"}


def legend_of(figure):
    """The texts of the legend."""
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


def artist(ax, label):
    """The artist with a label."""
    return next(child for child in ax.get_children() if child.get_label() == label)


def labels_of(ax):
    """The labels beside places, and the stop numbers."""
    notes = [child for child in ax.get_children() if isinstance(child, Annotation)]
    return [note for note in notes if note.get_bbox_patch() is None], [
        note for note in notes if note.get_bbox_patch() is not None
    ]


def box_of(note):
    """What a label takes, in pixels."""
    patch = note.get_bbox_patch()
    return (note if patch is None else patch).get_window_extent()


def overlap(one, other):
    """Whether two boxes have an area in common."""
    return one.x0 < other.x1 and other.x0 < one.x1 and one.y0 < other.y1 and other.y0 < one.y1


def assert_no_label_covers_anything(ax):
    """Labels lie within the axes, and neither on one another nor on a stop's number."""
    labels, numbers = labels_of(ax)
    frame = ax.get_window_extent()
    for label in labels:
        box = box_of(label)
        assert frame.x0 <= box.x0 < box.x1 <= frame.x1
        assert frame.y0 <= box.y0 < box.y1 <= frame.y1
        assert not any(overlap(box, box_of(number)) for number in numbers), label.get_text()
    for one, other in itertools.combinations(labels, 2):
        assert not overlap(box_of(one), box_of(other)), (one.get_text(), other.get_text())


def stored(scenario):
    """The plan of a scenario as its file holds it; the users' degrees are where their metres are."""
    from tests.figures.conftest import PLANE

    lat_deg, lon_deg = PLANE.to_lat_lon_deg(scenario.users.xy_m)
    scenario = replace(scenario, users=replace(scenario.users, lat_deg=lat_deg, lon_deg=lon_deg))
    plan = make_plan(scenario)
    return plan, parse_plan(dumps(plan), "x.mavplan.json")


def test_a_plan_shows_zones_fence_rally_points_pinned_stops_and_the_way_home(surrounded):
    plan = make_plan(surrounded)
    figure = plan_figure(plan)
    (ax,) = figure.axes
    assert {*AROUND, "way home", "path", "home"} <= set(legend_of(figure))
    assert len(set(legend_of(figure))) == len(legend_of(figure))
    zone = artist(ax, "no-fly zone")
    assert to_hex(zone.get_edgecolor()).upper() == ZONE
    assert zone.get_hatch()
    assert shapely.Polygon(zone.get_xy()).area == pytest.approx(800 * 600, rel=1e-3)
    assert len(artist(ax, "rally point").get_offsets()) == 1
    squares = [
        number for number in labels_of(ax)[1] if "Square" in str(number.get_bbox_patch().get_boxstyle())
    ]
    assert len(squares) == 1
    assert any(label.get_text() == "marker, 5 s" for label in labels_of(ax)[0])


def test_the_way_home_is_the_missions_and_leads_round_the_zone(surrounded):
    plan = make_plan(surrounded)
    way_m = way_home_m(plan)
    line = artist(plan_figure(plan).axes[0], "way home")
    assert np.array_equal(line.get_xydata(), way_m)
    assert line.get_linestyle() == ":"
    assert np.array_equal(way_m[0], plan.trajectory.stops_m[-1])
    assert np.array_equal(way_m[-1], [0, 0])
    assert len(way_m) > 2
    zone = shapely.Polygon(surroundings(surrounded).zones_m[0])
    assert not zone.intersects(shapely.LineString(way_m))
    assert zone.intersects(shapely.LineString(way_m[[0, -1]]))


@pytest.mark.parametrize("end", ["land", "stay"])
def test_a_mission_that_does_not_return_has_no_way_home(end):
    figure = plan_figure(make_plan(make_scenario([(500, 0), (0, 900)], end=end)))
    assert "way home" not in legend_of(figure)
    assert not AROUND & set(legend_of(figure))


def test_what_lies_far_from_the_flight_is_left_out_and_makes_the_map_no_smaller():
    scenario = make_scenario([(500, 0), (0, 900)])
    plan = make_plan(scenario)
    far = replace(
        scenario,
        no_fly=Fence((), (circle(90_000, 0, 50),)),
        fence=Fence((polygon(True, (-5e4, -5e4), (5e4, -5e4), (5e4, 5e4), (-5e4, 5e4)),)),
        rally=(RallyPoint(470_000_000, 75_000_000, 30.0),),
    )
    (ax,), (ax_far,) = plan_figure(plan).axes, plan_figure(replace(plan, scenario=far)).axes
    assert (ax_far.get_xlim(), ax_far.get_ylim()) == (ax.get_xlim(), ax.get_ylim())
    assert not AROUND & set(ax_far.get_legend_handles_labels()[1])


def test_a_zone_that_holds_the_whole_map_is_drawn_and_named():
    scenario = make_scenario([(500, 0), (0, 900)])
    plan = make_plan(scenario)
    zone = Fence((polygon(False, (-5e4, -5e4), (5e4, -5e4), (5e4, 5e4), (-5e4, 5e4)),))
    figure = plan_figure(replace(plan, scenario=replace(scenario, no_fly=zone)))
    assert "no-fly zone" in legend_of(figure)


def test_no_label_covers_another_or_a_stops_number_or_leaves_the_map(crowd):
    figure = plan_figure(make_plan(crowd))
    (ax,) = figure.axes
    assert_no_label_covers_anything(ax)
    texts = {label.get_text() for label in labels_of(ax)[0]}
    assert len(texts & {"Pfarrhaus Öttl", "Rettung $1_x^2$", *crowd.users.names[3:]}) >= 20
    assert LONG not in texts


def test_a_name_beneath_a_stops_number_is_written_beside_the_number():
    plan = make_plan(make_scenario([(1500, 900)]))
    plan = replace(plan, scenario=named(plan.scenario, "Pfarrhaus Öttl"))
    assert np.linalg.norm(plan.trajectory.stops_m[0] - plan.scenario.users.xy_m[0]) < 1.0
    (ax,) = plan_figure(plan).axes
    assert "Pfarrhaus Öttl" in {label.get_text() for label in labels_of(ax)[0]}
    assert_no_label_covers_anything(ax)


def test_long_names_change_neither_a_maps_size_nor_its_place(crowd):
    plan = make_plan(crowd)
    count = len(crowd.users)
    longer = replace(plan, scenario=named(crowd, *(f"{LONG} {number}" for number in range(count))))
    short, long = plan_figure(plan), plan_figure(longer)
    assert np.allclose(short.axes[0].get_position().extents, long.axes[0].get_position().extents)
    width, _ = long.get_size_inches() * long.dpi
    assert long.axes[0].get_window_extent().width > 0.75 * width


def test_every_name_stands_nearest_to_its_own_user(crowd):
    (ax,) = plan_figure(make_plan(crowd)).axes
    dots = ax.transData.transform(crowd.users.xy_m)
    named_here = 0
    for label in labels_of(ax)[0]:
        if label.get_text() not in crowd.users.names:
            continue
        own = crowd.users.names.index(label.get_text())
        (x0, y0), (x1, y1) = box_of(label).get_points()
        away = np.hypot(*(dots - np.clip(dots, (x0, y0), (x1, y1))).T)
        assert away[own] <= away.min() + 2.0, label.get_text()
        named_here += 1
    assert named_here >= 18


def test_many_users_are_not_named():
    xy_m = np.random.default_rng(1).uniform(-900, 900, (60, 2))
    (ax,) = plan_figure(make_plan(make_scenario(xy_m, clusters=4))).axes
    assert not any(label.get_text().startswith("u") for label in labels_of(ax)[0])


def test_the_maps_of_a_comparison_fill_its_page_whatever_the_names(surrounded):
    scenario = named(surrounded, LONG, "Pfarrhaus Öttl")
    figure = comparison_figure(compare(scenario))
    page = np.prod(figure.get_size_inches() * figure.dpi)
    boxes = [ax.get_window_extent() for ax in figure.axes]
    assert len(boxes) == 6
    assert sum(box.width * box.height for box in boxes) > 0.55 * page
    assert {*AROUND, "way home"} <= set(legend_of(figure))
    titles = [ax.title.get_window_extent() for ax in figure.axes]
    assert all(figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1 for box in titles)
    assert not any(overlap(one, other) for one, other in itertools.combinations(titles, 2))
    for ax in figure.axes:
        assert artist(ax, "no-fly zone")
        assert_no_label_covers_anything(ax)


@pytest.mark.parametrize(("end_m", "columns", "part"), [((6000, 300), 2, 0.45), ((300, 6000), 3, 0.2)])
def test_the_maps_of_a_comparison_fit_users_in_a_line(end_m, columns, part):
    xy_m = np.linspace((100, 100), end_m, 4)
    compared = compare(make_scenario(xy_m, clusters=2))
    figure = comparison_figure(compared)
    assert len({round(ax.get_position().x0, 3) for ax in figure.axes}) == columns
    page = np.prod(figure.get_size_inches() * figure.dpi)
    assert sum(np.prod(ax.get_window_extent().size) for ax in figure.axes) > part * page
    titles = [ax.title.get_window_extent() for ax in figure.axes]
    assert not any(overlap(one, other) for one, other in itertools.combinations(titles, 2))
    ticks = [tick.get_window_extent() for tick in figure.axes[-1].get_xticklabels() if tick.get_text()]
    assert not any(overlap(one, other) for one, other in itertools.combinations(ticks, 2))


def test_a_proof_shows_the_planned_way_with_every_turn_and_the_way_home(surrounded):
    plan, read = stored(surrounded)
    assert len(plan.trajectory.path_m) > len(plan.trajectory.stop_at) + 1
    out_m, back_m = planned_ways_m(read)
    assert np.allclose(out_m, plan.trajectory.path_m, atol=0.02)
    assert np.allclose(back_m, way_home_m(plan), atol=0.02)
    proof = prove(read, parse_track(to_tlog(flight_of(read, hz=2.0)), "x"))
    figure = proof_figure(proof)
    (ax,) = figure.axes
    assert np.array_equal(artist(ax, "planned").get_xydata(), out_m)
    assert np.array_equal(artist(ax, "planned way home").get_xydata(), back_m)
    assert {*AROUND, "planned", "planned way home"} <= set(legend_of(figure))
    assert_no_label_covers_anything(ax)


def test_a_plan_without_turns_goes_from_stop_to_stop_and_straight_home():
    plan, read = stored(make_scenario([(900, 0), (0, 1200)]))
    assert read.turns == ()
    assert "turns" not in dumps(plan)
    out_m, back_m = planned_ways_m(read)
    assert np.allclose(out_m, plan.trajectory.path_m, atol=0.02)
    assert np.allclose(back_m, [plan.trajectory.stops_m[-1], (0, 0)], atol=0.02)
    _, staying = stored(make_scenario([(900, 0), (0, 1200)], end="stay"))
    assert len(planned_ways_m(staying)[1]) == 0


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_the_same_plan_is_the_same_picture(surrounded, suffix):
    plan = make_plan(surrounded)
    drawn = draw_plan(plan, Path(f"x.{suffix}"))
    assert len(drawn) > 5_000
    assert drawn == draw_plan(plan, Path(f"x.{suffix}"))
