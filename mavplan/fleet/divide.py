"""A plan's stops divided among vehicles so that the longest flight is short. Pure, and the same every time.

Each start cuts an order of the stops into pieces by a dynamic programme on the longest piece: the plan's own order, and
the one by bearing from home. Then stops move from the longest flight to others, and change places with theirs, while
that makes the longest flight shorter, or none longer and their sum less.
"""

import math
from collections.abc import Sequence
from itertools import permutations

from mavplan.sorties.ways import Ways

MOST_ORDERS = 5
"""Vehicles with homes of their own up to which every way to give them the pieces is tried."""

MOST_CUT = 300
"""Stops up to which pieces are cut by the dynamic programme; its work grows with the square of them."""

HALVINGS = 40
"""Of the limit to which the pieces of more stops are filled."""

MOST_ROUNDS = 200

MOST_EXCHANGES = 600
"""Pairs of stops of two vehicles up to which exchanges are tried, beside moves."""


def divide(
    ways: Sequence[Ways], holds_s: Sequence[float], orders: Sequence[Sequence[int]]
) -> list[list[int]]:
    """Return the stops of each vehicle in the order in which it flies to them; some may have none.

    Parameters
    ----------
    ways
        Of each vehicle, between the same stops.
    holds_s
        (M,) at each stop.
    orders
        Orders of all stops to begin with.
    """
    best: tuple[tuple[float, ...], list[list[int]]] | None = None
    for order in orders:
        found = _improved(ways, holds_s, _given(ways, holds_s, _pieces(ways[0], holds_s, order, len(ways))))
        cost = _costs(ways, holds_s, found)
        if best is None or cost < best[0]:
            best = cost, found
    assert best is not None
    return best[1]


def _seconds(ways: Ways, holds_s: Sequence[float], stops: Sequence[int]) -> float:
    return ways.flight(list(stops), [holds_s[stop] for stop in stops]).seconds if stops else 0.0


def _costs(
    ways: Sequence[Ways], holds_s: Sequence[float], parts: Sequence[Sequence[int]]
) -> tuple[float, ...]:
    """Return the longest flight and the sum of all."""
    seconds = [_seconds(own, holds_s, part) for own, part in zip(ways, parts, strict=True)]
    return max(seconds), sum(seconds)


def _pieces(ways: Ways, holds_s: Sequence[float], order: Sequence[int], count: int) -> list[list[int]]:
    """Return an order cut into so many pieces, or one a stop, the longest of them as short as can be."""
    size = len(order)
    if size > MOST_CUT:
        return _even_pieces(ways, holds_s, order, count)
    length = [[math.inf] * (size + 1) for _ in range(size)]
    for first in range(size):
        out = ways.out(order[first]).seconds + ways.hold(holds_s[order[first]]).seconds
        for end in range(first + 1, size + 1):
            last = order[end - 1]
            if end - 1 > first:
                out += ways.leg(order[end - 2], last).seconds + ways.hold(holds_s[last]).seconds
            length[first][end] = out + ways.home(last).seconds
    best = [0.0] + [math.inf] * size
    cuts: list[list[int]] = []
    for _ in range(min(count, size)):
        reached, before = [math.inf] * (size + 1), [0] * (size + 1)
        for end in range(1, size + 1):
            for first in range(end):
                longest = max(best[first], length[first][end])
                if longest < reached[end]:
                    reached[end], before[end] = longest, first
        cuts.append(before)
        best = [math.inf, *reached[1:]]
    found, end = [], size
    for before in reversed(cuts):
        found.append(list(order[before[end] : end]))
        end = before[end]
    return [[] for _ in range(count - len(found))] + found[::-1]


def _even_pieces(ways: Ways, holds_s: Sequence[float], order: Sequence[int], count: int) -> list[list[int]]:
    """Return a long order cut into so many pieces, the longest as short as filling one after the other allows."""
    low_s, high_s = 0.0, _seconds(ways, holds_s, order)
    best = [list(order)]
    for _ in range(HALVINGS):
        middle_s = (low_s + high_s) / 2
        found = _filled(ways, holds_s, order, middle_s, count)
        if found is None:
            low_s = middle_s
        else:
            best, high_s = found, middle_s
    return [[] for _ in range(count - len(best))] + best


def _filled(
    ways: Ways, holds_s: Sequence[float], order: Sequence[int], limit_s: float, count: int
) -> list[list[int]] | None:
    """Return pieces of at most so many seconds, each as long as may be; None where there are too many."""
    found: list[list[int]] = []
    out_s = 0.0
    for stop in order:
        hold_s = ways.hold(holds_s[stop]).seconds
        if (
            found
            and out_s + ways.leg(found[-1][-1], stop).seconds + hold_s + ways.home(stop).seconds <= limit_s
        ):
            out_s += ways.leg(found[-1][-1], stop).seconds + hold_s
            found[-1].append(stop)
            continue
        out_s = ways.out(stop).seconds + hold_s
        if len(found) == count or out_s + ways.home(stop).seconds > limit_s:
            return None
        found.append([stop])
    return found


def _given(ways: Sequence[Ways], holds_s: Sequence[float], pieces: list[list[int]]) -> list[list[int]]:
    """Return the pieces given to vehicles, so that the longest flight is shortest."""
    if all(own is ways[0] for own in ways):
        return pieces
    if len(ways) <= MOST_ORDERS:
        orders = [[pieces[i] for i in order] for order in permutations(range(len(pieces)))]
        return min(orders, key=lambda parts: _costs(ways, holds_s, parts))
    left, found = list(pieces), []
    for own in ways:
        nearest = min(left, key=lambda piece: _seconds(own, holds_s, piece) if piece else math.inf)
        left.remove(nearest)
        found.append(nearest)
    return found


def _improved(ways: Sequence[Ways], holds_s: Sequence[float], parts: list[list[int]]) -> list[list[int]]:
    """Return the parts after moves and exchanges that make the longest flight shorter."""
    parts = [list(part) for part in parts]
    seconds = [_seconds(own, holds_s, part) for own, part in zip(ways, parts, strict=True)]
    for _ in range(MOST_ROUNDS):
        longest = max(range(len(parts)), key=lambda v: seconds[v])
        found = _better(ways, holds_s, parts, seconds, longest)
        if found is None:
            return parts
        other, mine, theirs = found
        parts[longest], parts[other] = mine, theirs
        seconds[longest] = _seconds(ways[longest], holds_s, mine)
        seconds[other] = _seconds(ways[other], holds_s, theirs)
    return parts


def _better(
    ways: Sequence[Ways], holds_s: Sequence[float], parts: list[list[int]], seconds: list[float], longest: int
) -> tuple[int, list[int], list[int]] | None:
    """Return the best move or exchange between the longest flight and another, or a better order of its own."""
    own = parts[longest]
    best: tuple[float, float] = (seconds[longest] - 1e-6, math.inf)
    found = None
    for other in (v for v in range(len(parts)) if v != longest):
        trials = [
            (own[:i] + own[i + 1 :], inserted(ways[other], parts[other], stop)) for i, stop in enumerate(own)
        ]
        trials += [
            (
                inserted(ways[longest], own[:i] + own[i + 1 :], theirs),
                inserted(ways[other], parts[other][:j] + parts[other][j + 1 :], stop),
            )
            for i, stop in enumerate(own)
            for j, theirs in enumerate(parts[other])
            if len(own) * len(parts[other]) <= MOST_EXCHANGES
        ]
        for mine, theirs_after in trials:
            pair = (
                _seconds(ways[longest], holds_s, mine),
                _seconds(ways[other], holds_s, theirs_after),
            )
            cost = max(pair), sum(pair)
            if cost < best:
                best, found = cost, (other, mine, theirs_after)
    return found


def inserted(ways: Ways, part: Sequence[int], stop: int) -> list[int]:
    """Return a part with a stop where it costs the least."""
    if not part:
        return [stop]

    def added(at: int) -> float:
        to = ways.out(stop) if at == 0 else ways.leg(part[at - 1], stop)
        on = ways.home(stop) if at == len(part) else ways.leg(stop, part[at])
        saved = (
            ways.out(part[0])
            if at == 0
            else ways.home(part[-1])
            if at == len(part)
            else ways.leg(part[at - 1], part[at])
        )
        return to.seconds + on.seconds - saved.seconds

    at = min(range(len(part) + 1), key=added)
    return [*part[:at], stop, *part[at:]]
