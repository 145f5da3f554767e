"""A short path through very many discs: region by region, then over the borders between them.

Regions of a bounded number of users are put in an order by their middles; each gets a path of its own from where the
one before it ends to where the next begins. Then the plane is cut anew, twice, elsewhere, and the pieces of the path
within each new region are made shorter together, their ends held: so the old borders, and what one side's legs do for
the other, are within a region. Regions do not wait for one another: they are tasks for many processes, and the path is
the same wherever they are worked out.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mavplan.planners.coarse_order import coarse_order
from mavplan.planners.cover_candidates import COVER_SLACK_M, Requirements
from mavplan.planners.near_legs import legs_near
from mavplan.planners.path_problem import PathProblem
from mavplan.planners.quick_path import FIXED, JOIN, Pieces, improved
from mavplan.planners.regions import shared_out
from mavplan.planners.spread import Spread
from mavplan.planners.touring import tour_discs
from mavplan.progress import Progress, tell_share
from mavplan.scenario.model import Bools, Floats, Ints

REGION = 1000
"""Requirements of a region at most."""

EFFORTS = (0.35, 0.3, 0.3)
"""Attempts for each requirement: when the path of a region is made, and each time that the plane is cut anew."""

LEAST_ATTEMPTS = 9_500
"""In all: where there are few requirements there is time for more."""

CUTS = (0.31, 0.69)
"""Each time that the plane is cut anew, the share of requirements on one side of the first cut."""

TOURED = 12
"""Points of a stretch that is toured exactly at the end."""

PRECISION = 1e-6


@dataclass(frozen=True, eq=False)
class _Task:
    """What a region needs to know."""

    required: Requirements
    radius_m: float
    pieces: Pieces
    seed: tuple[int, ...]
    attempts: int


def wide_path(
    problem: PathProblem,
    seed: int,
    spread: Spread,
    progress: Progress | None = None,
    *,
    effort: float = 1.0,
) -> Floats:
    """Return points (K, 2) of a path that meets all requirements, without its start and its given end.

    Parameters
    ----------
    problem
        Of requirements that are not met from the start, at least one.
    seed
        Of what is drawn; each region draws by its own number.
    spread
        Where regions are worked out.
    progress
        Called with the part done and the whole.
    effort
        Part of the usual attempts, where the path is only a beginning.
    """
    rounds_done = 0
    more = effort * max(1.0, LEAST_ATTEMPTS / (sum(EFFORTS) * len(problem.required)))
    efforts = [more * usual for usual in EFFORTS]

    def tell(share: float) -> None:
        tell_share(progress, (rounds_done + share) / len(EFFORTS))

    middles = problem.required.places_m[problem.required.choices].mean(axis=1)
    line, place = _made(problem, middles, (efforts[0], seed), spread, tell)
    for number, (share, each) in enumerate(zip(CUTS, efforts[1:], strict=True), start=1):
        rounds_done = number
        line, place = _recut(problem, (line, place), middles, (share, each, seed, number), spread, tell)
    ends = slice(1, None if problem.end_m is None else -1)
    return _toured(problem, line[ends], place[ends])


def worked_out(task: _Task) -> Pieces:
    """Return the pieces of a region made shorter; what every worker does."""
    rng = np.random.default_rng(task.seed)
    return improved(task.required, task.radius_m, task.pieces, rng, task.attempts)


def _made(
    problem: PathProblem,
    middles: Floats,
    how: tuple[float, int],
    spread: Spread,
    tell: Callable[[float], None],
) -> tuple[Floats, Ints]:
    """Return the points of a path, region by region, and which place each touches."""
    required, (effort, seed) = problem.required, how
    regions = [own for own, _ in shared_out(middles, np.empty((0, 2)), REGION)]
    centres = np.array([middles[own].mean(axis=0) for own in regions])
    regions = [regions[at] for at in coarse_order(centres, problem.start_m, problem.end_m)]
    doors = [problem.start_m, *_doors(middles, regions)]
    tasks = []
    for number, own in enumerate(regions):
        last = number + 1 == len(regions)
        open_end = last and problem.end_m is None
        door = problem.end_m if last else doors[number + 1]
        points = np.vstack([doors[number], *([] if door is None else [door])])
        fixed = np.full(len(points), FIXED)
        pieces = Pieces(points, fixed, np.zeros(len(points) - 1, dtype=np.bool_), open_end)
        attempts = round(effort * len(own))
        tasks.append(_Task(required.part(own), problem.radius_m, pieces, (seed, 0, number), attempts))
    lines, places = [problem.start_m[None]], [np.array([FIXED])]
    for number, (found, own) in enumerate(zip(spread(worked_out, tasks), regions, strict=True)):
        tell((number + 1) / len(tasks))
        lines.append(found.points_m[1:])
        places.append(_of_all(found.place, np.unique(required.choices[own]))[1:])
        if number + 1 < len(regions):
            places[-1][-1] = JOIN
    return np.vstack(lines), np.concatenate(places)


def _doors(middles: Floats, regions: Sequence[Ints]) -> list[Floats]:
    """Return between each region and the next the middle of two of their members that are near each other."""
    from scipy.spatial import KDTree

    found = []
    for own, following in itertools.pairwise(regions):
        away, at = KDTree(middles[own]).query(middles[following])
        nearest = int(np.argmin(away))
        found.append((middles[own][int(np.asarray(at)[nearest])] + middles[following][nearest]) / 2)
    return found


def _of_all(place: Ints, kept: Ints) -> Ints:
    """Return places that are numbered among those kept as they are numbered among all."""
    found = place.copy()
    found[place >= 0] = kept[place[place >= 0]]
    return found


def _recut(
    problem: PathProblem,
    path: tuple[Floats, Ints],
    middles: Floats,
    how: tuple[float, float, int, int],
    spread: Spread,
    tell: Callable[[float], None],
) -> tuple[Floats, Ints]:
    """Return the path made shorter within regions that are cut anew."""
    line, place = path
    share, effort, seed, number = how
    required = problem.required
    cells = shared_out(middles, line, REGION, share)
    cell_of = np.empty(len(line), dtype=np.int64)
    for cell, (_, points) in enumerate(cells):
        cell_of[points] = cell
    leg_cell = np.where(cell_of[:-1] == cell_of[1:], cell_of[:-1], len(cells))
    owned = _owned(required, line, problem.radius_m, leg_cell, len(cells))
    runs = np.split(np.arange(len(line)), np.flatnonzero(np.diff(cell_of)) + 1)
    by_cell: list[list[Ints]] = [[] for _ in cells]
    for run in runs:
        if len(run) > 1 or run[0] == len(line) - 1:
            by_cell[cell_of[run[0]]].append(run)
    tasks, which = [], []
    for cell, own_runs in enumerate(by_cell):
        ends_here = bool(own_runs) and problem.end_m is None and own_runs[-1][-1] == len(line) - 1
        if not own_runs or (len(own_runs) == 1 and len(own_runs[0]) == 1 and not len(owned[cell])):
            continue
        part = required.part(owned[cell])
        pieces = _pieces(line, place, own_runs, ends_here, np.unique(required.choices[owned[cell]]))
        attempts = round(effort * len(owned[cell]))
        tasks.append(_Task(part, problem.radius_m, pieces, (seed, number, cell), attempts))
        which.append(cell)
    lines, places = [line[run] for run in runs], [place[run] for run in runs]
    run_at = {int(run[0]): at for at, run in enumerate(runs)}
    for finished, (cell, task, found) in enumerate(zip(which, tasks, spread(worked_out, tasks), strict=True)):
        tell((finished + 1) / len(tasks))
        kept = np.unique(required.choices[owned[cell]])
        bounds = np.flatnonzero(found.given) + 1
        new_lines, new_places = np.split(found.points_m, bounds), np.split(found.place, bounds)
        for run, new_line, new_place in zip(by_cell[cell], new_lines, new_places, strict=True):
            at = run_at[int(run[0])]
            numbered = _of_all(new_place, kept)
            numbered[0] = place[run[0]]
            if not (task.pieces.open_end and run[-1] == len(line) - 1):
                numbered[-1] = place[run[-1]]
            lines[at], places[at] = new_line, numbered
    return np.vstack(lines), np.concatenate(places)


def _pieces(line: Floats, place: Ints, runs: Sequence[Ints], ends_here: bool, kept: Ints) -> Pieces:
    """Return the runs of a path in one region as pieces whose ends are held."""
    at = np.concatenate(runs)
    given = np.zeros(len(at) - 1, dtype=np.bool_)
    ends = np.cumsum([len(run) for run in runs])
    given[ends[:-1] - 1] = True
    own = place[at].copy()
    touching = own >= 0
    number = np.minimum(np.searchsorted(kept, own[touching]), max(len(kept) - 1, 0))
    known = kept[number] == own[touching] if len(kept) else np.zeros(len(number), dtype=np.bool_)
    # A point whose place the path meets elsewhere too is needed no longer.
    own[touching] = np.where(known, number, JOIN)
    own[ends - 1] = FIXED
    own[np.concatenate(([0], ends[:-1]))] = FIXED
    if ends_here and len(runs[-1]) > 1:
        last = place[at[-1]]
        found = np.flatnonzero(kept == last)
        own[-1] = found[0] if len(found) else JOIN
    return Pieces(line[at], own, given, ends_here)


def _owned(required: Requirements, line: Floats, radius_m: float, leg_cell: Ints, cells: int) -> list[Ints]:
    """Return which requirements each region has to meet: those that no leg over a border meets, each once."""
    leg, at = meetings(required, line, radius_m)
    cell = leg_cell[leg]
    free = np.ones(len(required), dtype=np.bool_)
    free[at[cell == cells]] = False
    owner = np.full(len(required), cells, dtype=np.int64)
    # The first of several regions: written last to first.
    owner[at[::-1]] = cell[::-1]
    chosen = np.flatnonzero(free)
    order = chosen[np.argsort(owner[chosen], kind="stable")]
    counts = np.bincount(owner[chosen], minlength=cells)[:cells]
    return np.split(order, np.cumsum(counts))[:cells]


def meetings(required: Requirements, line: Floats, radius_m: float) -> tuple[Ints, Ints]:
    """Return pairs of a leg and a requirement that it meets, by leg."""
    leg, place = legs_near(line, required.places_m, radius_m + COVER_SLACK_M)
    one = np.argsort(required.choices.ravel(), kind="stable")
    counts = np.bincount(required.choices.ravel(), minlength=len(required.places_m))
    first = np.cumsum(counts) - counts
    times = counts[place]
    offset = np.arange(int(times.sum())) - np.repeat(np.cumsum(times) - times, times)
    return np.repeat(leg, times), one[np.repeat(first[place], times) + offset] // 2


def _toured(problem: PathProblem, points_m: Floats, place: Ints) -> Floats:
    """Return the points with stretches toured exactly, where everybody is still met."""
    for shift in (0, TOURED // 2):
        points_m = _stretches_toured(problem, points_m, place, shift)
    return points_m


def _stretches_toured(problem: PathProblem, points_m: Floats, place: Ints, shift: int) -> Floats:
    """Return the points with stretches between held points toured exactly."""
    required = problem.required
    before = problem.path_m(points_m)
    # A stretch: points first … last between the held points first − 1 and last + 1 of the whole line.
    touching = np.concatenate(([False], place >= 0, [False] * (len(before) - 1 - len(place))))
    firsts = np.arange(1 + shift, len(before) - TOURED, TOURED + 1)
    rows = firsts[:, None] + np.arange(TOURED)
    whole = touching[rows].all(axis=1) if len(rows) else np.zeros(0, dtype=np.bool_)
    rows = rows[whole]
    if not len(rows):
        return points_m
    centres = required.places_m[place[rows - 1]]
    ends = before[rows[:, -1] + 1]
    tours = tour_discs(centres, problem.radius_m, before[rows[:, 0] - 1], ends, precision=PRECISION)
    after = before.copy()
    after[rows] = tours.points_m
    return _with_all_met(problem, before, after, rows)[1 : 1 + len(points_m)]


def _with_all_met(problem: PathProblem, before: Floats, after: Floats, rows: Ints) -> Floats:
    """Return the line with those stretches put back without which somebody is not met any more."""
    required = problem.required
    stretch = np.full(len(before), -1)
    stretch[rows] = np.arange(len(rows))[:, None]
    leg, met = meetings(required, before, problem.radius_m)
    while True:
        now = np.zeros(len(required), dtype=np.bool_)
        now[meetings(required, after, problem.radius_m)[1]] = True
        if now.all():
            return after
        lost = leg[~now[met]]
        back = np.unique(np.concatenate([stretch[lost], stretch[lost + 1]]))
        back = back[back >= 0]
        after[rows[back]] = before[rows[back]]


def met_all(problem: PathProblem, points_m: Floats) -> Bools:
    """Return (Q,) which requirements a path through these points meets."""
    found = np.zeros(len(problem.required), dtype=np.bool_)
    found[meetings(problem.required, problem.path_m(points_m), problem.radius_m)[1]] = True
    return found
