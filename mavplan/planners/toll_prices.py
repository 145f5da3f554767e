"""Prices of service under which every plan pays at least what it serves: the linear programme that finds good ones.

A user n whom the vehicle comes no nearer than δ_n gets its data at a rate of at most ρ(δ_n). Let its second of need
be worth y_n(δ) = β_n + α_n·ĝ(δ), α, β ≥ 0, ĝ ≤ 1/ρ, which rises with δ. Where Σ_n y_n(‖w − w_n‖)·ρ(‖w − w_n‖) over
the users within R is at most λ at every place w, a second at any place is worth at most λ, as y_n(δ_n) ≤ y_n(‖w −
w_n‖) there. So the seconds of service are at least Σ need_n·y_n(δ_n)/λ. As ĝ·ρ ≤ 1, Σ (α_n + β_n·ρ) ≤ λ is enough.

Without in-flight service these seconds are the hover, λ = 1, and they come on top of the flight; with it they are
flight and hover together, and (1 − λ)·flight + what they are worth is still at most flight and hover. Either way

    time ≥ min over paths of (1 − λ)·way/v + Σ_n need_n·y_n(δ_n),      λ = 0 in the first term without.

The paths met so far give the programme its rows; which path is cheapest under its prices the search of
`toll_search` says.
"""

from dataclasses import dataclass, field

import numpy as np

from mavplan.planners.linear_programme import least
from mavplan.planners.toll_curve import Curve
from mavplan.scenario.model import Floats, Ints


@dataclass(frozen=True, eq=False)
class Prices:
    """α and β of N users, and λ.

    Attributes
    ----------
    flat, steep
        (N,) α and β, not negative.
    share
        λ with in-flight service; 0 without.
    """

    flat: Floats
    steep: Floats
    share: float

    def towards(self, other: "Prices", part: float) -> "Prices":
        """Return prices between these and others: as good as both where both are allowed."""
        return Prices(
            self.flat + part * (other.flat - self.flat),
            self.steep + part * (other.steep - self.steep),
            self.share + part * (other.share - self.share),
        )

    def lowered(self, most: float) -> "Prices":
        """Return the prices where their sum rises to ``most`` somewhere: no higher than what is allowed."""
        allowed = self.share if self.share > 0 else 1.0
        part = min(1.0, allowed / most) if most > 0 else 1.0
        return Prices(part * self.flat, part * self.steep, self.share)


@dataclass(eq=False)
class PriceProgramme:
    """The linear programme, grown row by row.

    Parameters
    ----------
    need_s
        (N,) seconds of need at the best rate.
    members
        (Q, 2) users that may stand for each requirement, twice the same where there is one; each user in one of them.
    curve
        ĝ.
    in_flight
        Whether λ is free.
    """

    need_s: Floats
    members: Ints
    curve: Curve
    in_flight: bool
    _rows: list[Floats] = field(default_factory=list)
    _limits: list[float] = field(default_factory=list)
    _paths: list[tuple[float, float, Floats]] = field(default_factory=list)

    def allow(self, rates: Floats) -> None:
        """Take in places: no sum of prices above λ there. ``rates`` (P, N) are ρ, 0 beyond R."""
        self._rows.append(np.hstack([(rates > 0).astype(float), rates]))

    def pass_by(self, way_s: float, back_s: float, away_m: Floats) -> None:
        """Take in a path: seconds to its last stop and from there home, and (N,) how near it comes to each user."""
        if not any(way_s == known[0] and (away_m == known[2]).all() for known in self._paths):
            self._paths.append((way_s, back_s, away_m))

    @property
    def paths(self) -> int:
        """Number of different paths met so far."""
        return len(self._paths)

    def solve(self) -> tuple[Prices, float]:
        """Return the prices that are best for the paths met so far, and the bound that they promise."""
        users, at = len(self.need_s), self._columns()
        places = np.vstack(self._rows)
        allowed = np.full((len(places), 1), -1.0 if self.in_flight else 0.0)
        above = np.hstack([places, allowed, np.zeros((len(places), at.width - at.share - 1))])
        rows, limits = self._path_rows(at)
        cost = np.zeros(at.width)
        cost[at.bound] = -1.0
        low, high = np.zeros(at.width), np.full(at.width, np.inf)
        low[at.bound] = -np.inf
        high[at.share] = 1.0 if self.in_flight else 0.0
        # Prices of users who need nothing would only take room.
        needless = np.flatnonzero(self._needs() <= 0)
        high[needless] = high[users + needless] = 0.0
        most = np.concatenate([np.full(len(places), 0.0 if self.in_flight else 1.0), limits])
        found = least(cost, np.concatenate([above, rows]), most, low, high)
        if found is None:
            raise ArithmeticError("prices: HiGHS finds none")
        values = np.maximum(found.x, 0.0)
        share = min(float(values[at.share]), 1.0) if self.in_flight else 0.0
        return Prices(values[:users], values[users : 2 * users], share), -found.value

    def _columns(self) -> "_Columns":
        pairs = int((self.members[:, 0] != self.members[:, 1]).sum())
        return _Columns(len(self.need_s), pairs, len(self._paths))

    def _path_rows(self, at: "_Columns") -> tuple[Floats, Floats]:
        """Return rows that keep the bound below what each path pays, and what they are at most."""
        users, nearest = len(self.need_s), self.curve.values[0]
        paired = self.members[:, 0] != self.members[:, 1]
        single, pairs = self.members[~paired, 0], self.members[paired]
        rows: list[Floats] = []
        limits: list[float] = []

        def row(limit: float) -> Floats:
            rows.append(np.zeros(at.width))
            limits.append(limit)
            return rows[-1]

        for number, members in enumerate(pairs):
            for member in members:
                worth = row(0.0)
                worth[at.relayed + number] = 1.0
                worth[member], worth[users + member] = -nearest, -1.0
        for index, (way_s, back_s, away_m) in enumerate(self._paths):
            paid = self.need_s * self.curve.at(away_m)
            all_paid = row(way_s + back_s)
            all_paid[at.bound] = 1.0
            all_paid[single], all_paid[users + single] = -paid[single], -self.need_s[single]
            if self.in_flight:
                all_paid[at.share] = way_s
            for number, members in enumerate(pairs):
                pays = at.paid + index * len(pairs) + number
                all_paid[pays] = -1.0
                for member, mate in (members, members[::-1]):
                    if away_m[member] <= self.curve.radius_m:
                        option = row(0.0)
                        option[pays] = 1.0
                        option[member], option[users + member] = -paid[member], -self.need_s[member]
                        option[at.relayed + number] = -self.need_s[mate]
        return np.array(rows), np.array(limits)

    def _needs(self) -> Floats:
        """(N,) what each user may have to receive: its own need, and its mate's."""
        one, other = self.members.T
        needs = self.need_s.copy()
        needs[one] = needs[other] = np.where(
            one == other, self.need_s[one], self.need_s[one] + self.need_s[other]
        )
        return needs


@dataclass(frozen=True, slots=True)
class _Columns:
    """Where variables stand: α and β of users, λ, the bound, a mate's least worth in each pair, what pairs pay."""

    users: int
    pairs: int
    paths: int

    @property
    def share(self) -> int:
        return 2 * self.users

    @property
    def bound(self) -> int:
        return self.share + 1

    @property
    def relayed(self) -> int:
        return self.bound + 1

    @property
    def paid(self) -> int:
        return self.relayed + self.pairs

    @property
    def width(self) -> int:
        return self.paid + self.paths * self.pairs
