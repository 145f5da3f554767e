"""A proof that no mission takes less time, and its check: prices of service, and paths that pay by the metre and tolls.

*Prices.* A second of user n's need is worth y_n = β_n + α_n·ĝ(δ_n), δ_n the nearest that the vehicle comes to it,
ĝ convex and at most 1/ρ, where ρ(d) is the rate from a distance over the rate straight below. Where α_n + β_n·ρ(d_n),
summed over the users within R, is at most λ at every place, a second of service is worth at most λ anywhere, for
y_n(δ_n) ≤ y_n(d_n) and ĝ·ρ ≤ 1. So service takes at least Σ need_n·y_n(δ_n)/λ. Without in-flight service that is the
hover, λ = 1, on top of the flight. With it, it is flight and hover together, which are also (1 − λ)·flight +
λ·(flight and hover) or more. Either way

    time ≥ beside + min over paths of (1 − λ)·way/v + Σ_n need_n·y_n(δ_n)      (without in-flight service 1 for 1 − λ).

One user at a time, each takes need_n/ρ(δ_n) or more: α_n + β_n ≤ 1 is enough. Of a D2D pair the member that is served
pays for its own need, and for its mate's what a second of either is worth at least.

*The tree.* A leaf is a sequence of users with a vector u_i, ‖u_i‖ ≤ 1, for each leg. A path that comes nearest to
them in this order, at x_1 … x_K, pays at least w·Σ u_i·(x_i − x_{i−1}) for its way, w the cost of a metre (w' for the
last leg, back home), and sorted by the x_i that is with their tolls at least

    Σ_i [g_i·c_i − max over 0 ≤ δ ≤ R of (‖g_i‖·δ − α_i·need_i·ĝ(δ))],    g_i = w_i·u_i − w_{i+1}·u_{i+1};

everybody else pays at least what is paid straight above. A branch names one more user; any path comes nearest to it,
or to its mate, somewhere before, between or behind. So every path ends in a leaf, and the least of them is proved.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mavplan.bounds.path import CertificateError
from mavplan.bounds.time_case import TimeCase
from mavplan.radio import REACH_TOLERANCE_M
from mavplan.scenario.model import UNPAIRED

Floats = NDArray[np.float64]

KNOTS = 4000
"""Steps of the distance from 0 to R in which ĝ is taken: on each as where it begins."""

TOUCH = 2e-4
"""Share by which the greatest sum of prices may be found too high."""

LAST_CELL_M = 1e-4
CELLS_AT_ONCE = 1_000_000
DIGITS = 1e5
"""Vectors are written as whole numbers, this for a length of 1."""


Entry = int | Floats
"""A branch: the user that is named; or a leaf: (L, 2) vectors of its legs, longer ones than 1 count as of length 1."""


@dataclass(frozen=True, eq=False)
class TimeCertificate:
    """Prices and the tree.

    Attributes
    ----------
    share
        λ with in-flight service, else 0.
    flat, steep
        (N,) α and β, not negative.
    tree
        In preorder. The children of a branch are the sequences with the user, then with its mate, from before the first
        of the sequence to behind the last.
    """

    share: float
    flat: Floats
    steep: Floats
    tree: tuple[Entry, ...]


def proved_time_s(certificate: TimeCertificate, case: TimeCase) -> float:
    """Return the seconds that a certificate proves no mission to be below, take-off to the end.

    Raises
    ------
    CertificateError
        It is none for this case.
    """
    users = len(case.need_s)
    share, flat, steep = certificate.share, certificate.flat, certificate.steep
    if flat.shape != (users,) or steep.shape != (users,):
        raise CertificateError(f"there are prices of {len(flat)} and {len(steep)} users for {users}")
    sound = np.isfinite(flat) & np.isfinite(steep) & (flat >= 0) & (steep >= 0)
    if not sound.all() or not 0.0 <= share <= 1.0 or (share > 0 and not case.in_flight):
        raise CertificateError("a price or the share is out of range")
    most = (flat + steep).max() if case.tdma else highest_sum(case, flat, steep)
    allowed = share if case.in_flight else 1.0
    lowered = min(1.0, allowed / most) if most > 0 else 1.0
    tolls = _Tolls(case, share, lowered * flat, lowered * steep)
    least = math.inf
    leaves: dict[int, list[tuple[tuple[int, ...], Floats]]] = {}
    for sequence, duals in _leaves(certificate.tree, case):
        leaves.setdefault(len(sequence), []).append((sequence, duals))
    for same in leaves.values():
        least = min(least, float(tolls.of(same).min()))
    return max(case.beside_s(share) + least, 0.0)


def _leaves(tree: tuple[Entry, ...], case: TimeCase) -> Iterator[tuple[tuple[int, ...], Floats]]:
    """Yield the leaves with their sequences, of users."""
    waiting: list[tuple[int, ...]] = [()]
    for entry in tree:
        if not waiting:
            raise CertificateError("the tree has more entries than cases")
        sequence = waiting.pop()
        if not isinstance(entry, int):
            if (
                entry.shape != (len(sequence) + (case.return_m_s is not None), 2)
                or not np.isfinite(entry).all()
            ):
                raise CertificateError(f"a leaf of {len(sequence)} users has vectors of shape {entry.shape}")
            yield sequence, entry
            continue
        if not 0 <= entry < len(case.need_s):
            raise CertificateError(f"a branch names user {entry}, who does not exist")
        mate = int(case.mate[entry])
        if entry in sequence or mate in sequence:
            raise CertificateError(f"a branch names user {entry} again")
        members = [entry] if mate == UNPAIRED else [entry, mate]
        longer = [
            (*sequence[:at], member, *sequence[at:]) for member in members for at in range(len(sequence) + 1)
        ]
        waiting += reversed(longer)
    if waiting:
        raise CertificateError(f"{len(waiting)} cases are missing in the tree")


class _Tolls:
    """What users are paid for at least, under prices."""

    def __init__(self, case: TimeCase, share: float, flat: Floats, steep: Floats) -> None:
        self._case = case
        need, users = case.need_s, np.arange(len(case.need_s))
        mate = np.where(case.mate == UNPAIRED, users, case.mate)
        worth = np.minimum(flat + steep, (flat + steep)[mate])
        self._fixed = steep * need + np.where(mate == users, 0.0, worth * need[mate])
        self._weight = flat * need
        straight = self._fixed + self._weight
        self._least = np.minimum(straight, straight[mate])
        self._all = float(self._least[users <= mate].sum())
        kept = 1.0 - share
        self._metre = kept / case.speed_m_s
        # From the last user to the last stop a metre costs the one, from there home the other.
        self._back = None if case.return_m_s is None else min(self._metre, 1.0 / case.return_m_s)
        reach_m = case.channel.radius_m + REACH_TOLERANCE_M
        knots = np.linspace(0.0, reach_m, KNOTS + 1)
        rates = case.channel.air_rate(knots)
        self._until, self._slow = knots[1:], (rates[0] / rates)[:-1]

    def of(self, leaves: list[tuple[tuple[int, ...], Floats]]) -> Floats:
        """Return what leaves of one length prove."""
        sequences = np.array([sequence for sequence, _ in leaves], dtype=np.int64)
        count = sequences.shape[1]
        unit = np.stack([duals for _, duals in leaves])
        unit = unit / np.maximum(np.linalg.norm(unit, axis=2, keepdims=True), 1.0)
        cost = np.full(unit.shape[1], self._metre)
        if self._back is not None:
            cost[-1] = self._back
        vectors = unit * cost[:, None]
        turns = vectors[:, :count].copy()
        turns[:, : vectors.shape[1] - 1] -= vectors[:, 1:]
        pull, weight = np.linalg.norm(turns, axis=2), self._weight[sequences]
        spared = np.empty(pull.shape)
        at_once = max(1, 2_000_000 // (KNOTS * max(count, 1)))
        for first in range(0, len(pull), at_once):
            rows = slice(first, first + at_once)
            gain = pull[rows, :, None] * self._until - weight[rows, :, None] * self._slow
            spared[rows] = gain.max(axis=2)
        centres = self._case.users_xy_m[sequences]
        inside = self._fixed[sequences] - self._least[sequences]
        proved: Floats = ((turns * centres).sum(axis=2) - spared + inside).sum(axis=1) + self._all
        return proved


def highest_sum(case: TimeCase, flat: Floats, steep: Floats) -> float:
    """Return what the sum of α_n + β_n·ρ over the users within R is at most, at any place, told too high by a touch.

    In a square it is at most the sum over all users that any place in it reaches, each as near as the nearest.
    """
    paid = (flat > 0) | (steep > 0)
    users, flat, steep = case.users_xy_m[paid], flat[paid], steep[paid]
    if not len(users):
        return 0.0
    reach_m = case.channel.radius_m + REACH_TOLERANCE_M
    best = float(case.channel.air_rate(np.zeros(1))[0])
    side = reach_m / 5
    west_south = users.min(axis=0) - reach_m
    counts = np.ceil((users.max(axis=0) + reach_m - west_south) / side).astype(np.int64)
    corners = west_south + side * np.stack(
        [axis.ravel() for axis in np.meshgrid(np.arange(counts[0]), np.arange(counts[1]))], axis=1
    )
    settled, reached = 0.0, 0.0
    while len(corners):
        most = np.empty((2, len(corners)))
        at_once = max(1, CELLS_AT_ONCE // len(users))
        for first in range(0, len(corners), at_once):
            rows = slice(first, first + at_once)
            for row, wide in enumerate((side, 0.0)):
                low = corners[rows, None] + (side - wide) / 2
                gap = np.maximum(np.maximum(low - users, users - low - wide), 0.0)
                away = np.hypot(gap[..., 0], gap[..., 1])
                pays = (flat + steep * case.channel.air_rate(away) / best) * (away <= reach_m)
                most[row, rows] = pays.sum(axis=1)
        reached = max(reached, float(most[1].max()))
        open_ = (most[0] > reached * (1 + TOUCH)) & (side > LAST_CELL_M)
        settled = max(settled, float(most[0, ~open_].max(initial=0.0)))
        side /= 2
        quarters = side * np.array([(0, 0), (0, 1), (1, 0), (1, 1)])
        corners = (corners[open_, None] + quarters).reshape(-1, 2)
    return settled


def to_json(certificate: TimeCertificate) -> dict[str, Any]:
    """Return the certificate as an object for JSON; a leaf is text, its vectors as whole numbers."""
    return {
        "kind": "time",
        "share": certificate.share,
        "flat": certificate.flat.tolist(),
        "steep": certificate.steep.tolist(),
        "tree": [entry if isinstance(entry, int) else _words(entry) for entry in certificate.tree],
    }


def _words(duals: Floats) -> str:
    return " ".join(str(int(value)) for value in np.rint(duals * DIGITS).ravel())


def from_json(content: Any) -> TimeCertificate:
    """Return the certificate in an object.

    Raises
    ------
    CertificateError
        It is none.
    """
    try:
        if content["kind"] != "time":
            raise CertificateError(f"a certificate of kind {content['kind']!r} is not known here")
        flat, steep = (np.array(content[name], dtype=np.float64) for name in ("flat", "steep"))
        return TimeCertificate(float(content["share"]), flat, steep, tuple(map(_entry, content["tree"])))
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise CertificateError(f"not a certificate of a mission's time: {error}") from error


def _entry(value: Any) -> Entry:
    if isinstance(value, str):
        return np.array([int(word) for word in value.split()], dtype=np.float64).reshape(-1, 2) / DIGITS
    if not isinstance(value, int) or isinstance(value, bool):
        raise TypeError(f"{value!r} is neither a user nor vectors")
    return value
