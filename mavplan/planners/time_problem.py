"""What a mission's time depends on, for many plans at once: legs, holds, what is received in flight, the way home.

Seconds throughout; needs are seconds at the best rate there is, that straight below the vehicle. A plan here is its
stops in flying order and nothing else: who is served where and the holds follow.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mavplan.bounds.time_case import ending_s, top_speed_m_s
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.phases import Vehicle as Flyer
from mavplan.mission.wind import Wind
from mavplan.planners.geometry import as_numbers, as_places
from mavplan.planners.time_passing import PassTable
from mavplan.planners.time_programme import least_hover
from mavplan.radio import REACH_TOLERANCE_M, Channel
from mavplan.scenario.model import UNPAIRED, Bools, Floats, Ints, Users
from mavplan.scenario.sections import Service, Vehicle

MET_S = 1e-7
"""In-flight service of more than this says that a leg comes within R."""

RAMP_PLACE = 1 / 6
"""Where on a ramp, from rest, the time that it takes beyond its way at full speed is spent in the mean."""

SURE_S = 1e-3
"""A user that is served in flight alone is to receive so much more than it needs: the table is not exact."""


@dataclass(frozen=True, eq=False)
class Times:
    """Figures of B plans.

    Attributes
    ----------
    flight_s
        (B,) legs and the end of the mission; take-off, the same for all, left out.
    hover_s
        (B,) least sum of holds; infinite where somebody cannot be served.
    holds_s
        (B, M) the holds.
    prices
        (B, N) what one more second of need would cost.
    """

    flight_s: Floats
    hover_s: Floats
    holds_s: Floats
    prices: Floats

    @property
    def total_s(self) -> Floats:
        """(B,) flight and hover."""
        return self.flight_s + self.hover_s


@dataclass(frozen=True, eq=False)
class Onward:
    """Where the vehicle flies on to behind the last stop of a plan that is part of a longer one.

    Attributes
    ----------
    place_m
        (2,) from where the part begins.
    speed_m_s
        Of the leg there.
    serves
        Whether what users receive on it counts.
    """

    place_m: Floats
    speed_m_s: float
    serves: bool


@dataclass(frozen=True, eq=False)
class TimeProblem:
    """Users and their needs, the channel, how the vehicle flies.

    Attributes
    ----------
    users_m, need_s, mate
        (N, 2) places, (N,) seconds at the best rate, (N,) D2D mates or `UNPAIRED`.
    channel
        Rates and R.
    tdma, in_flight
        One user at a time; what is received on legs counts.
    alone
        Whether that may be all that a user receives, without a stop that reaches it.
    vehicle, wind
        Speed, acceleration, end; what slows it down.
    table
        In-flight service of the channel; None where it does not count.
    onward
        Where a part of a longer plan is left for; None: what `vehicle` says ends it.
    """

    users_m: Floats
    need_s: Floats
    mate: Ints
    channel: Channel
    tdma: bool
    in_flight: bool
    alone: bool
    vehicle: Vehicle
    wind: Wind | None
    table: PassTable | None
    onward: Onward | None = None

    @classmethod
    def of(
        cls,
        users: Users,
        channel: Channel,
        vehicle: Vehicle,
        service: Service,
        *,
        wind: Wind | None = None,
        in_flight: bool,
        alone: bool = True,
        onward: Onward | None = None,
    ) -> "TimeProblem":
        """Return the problem of a scenario's parts."""
        best_bit_s = channel.radio.bandwidth_hz * float(channel.air_rate(np.zeros(1))[0])
        return cls(
            users.xy_m,
            users.demand_bit / best_bit_s,
            users.mate,
            channel,
            service.mode == "tdma",
            in_flight,
            in_flight and alone,
            vehicle,
            wind,
            PassTable.of(channel) if in_flight else None,
            onward,
        )

    @cached_property
    def flyer(self) -> Flyer:
        """The vehicle as the forecast knows it."""
        return Flyer(AUTOPILOTS[self.vehicle.autopilot], self.vehicle.acceleration_m_s2, wind=self.wind)

    @property
    def need_s_per_bit(self) -> float:
        """Seconds that a bit takes at the best rate."""
        return math.log(2.0) / (self._best * self.channel.radio.bandwidth_hz)

    @property
    def takeoff_s(self) -> float:
        """From the start of the mission until the climb is over."""
        return self.flyer.take_off(self.vehicle.altitude_m).seconds.total

    @cached_property
    def speed_m_s(self) -> float:
        """The most that legs are flown at: what lies beyond the autopilot's limit is not."""
        return top_speed_m_s(self.flyer, self.vehicle.speed_m_s)

    @cached_property
    def return_m_s(self) -> float:
        """The most that a return is flown at."""
        return top_speed_m_s(self.flyer, self.flyer.law.return_m_s)

    @property
    def end_at(self) -> tuple[Floats, float] | None:
        """Where the vehicle flies behind the last stop, and how fast it is asked to; None: nowhere."""
        if self.onward is not None:
            return self.onward.place_m, self.onward.speed_m_s
        return (np.zeros(2), self.flyer.law.return_m_s) if self.vehicle.end == "rtl" else None

    @cached_property
    def home_s(self) -> float:
        """What ends the mission, but for the way home: seconds that no plan changes."""
        return ending_s(self.flyer, self.vehicle)

    def leg_s(self, steps_m: Floats, asked_m_s: float) -> Floats:
        """Return (...) the time of legs (..., 2) from rest until the hold at their end begins."""
        flyer = self.flyer
        if self.vehicle.acceleration_m_s2 == 0 and self.wind is None:
            speed = min(asked_m_s, flyer.rules.default_speed_limit_m_s)
            return np.asarray(np.sqrt((steps_m**2).sum(axis=-1)) / speed)
        return flyer.legs(steps_m.reshape(-1, 2), asked_m_s)[0].reshape(steps_m.shape[:-1])

    def flight_s(self, stops_m: Floats) -> Floats:
        """Return (...) what plans with stops (..., M, 2) fly after take-off."""
        seconds: Floats = self.leg_s(np.diff(stops_m, axis=-2, prepend=0.0), self.vehicle.speed_m_s).sum(
            axis=-1
        )
        if self.end_at is not None:
            place_m, asked_m_s = self.end_at
            seconds = seconds + self.leg_s(place_m - stops_m[..., -1, :], asked_m_s)
        return seconds + self.home_s

    def shares(self, squared_m2: Floats) -> Floats:
        """Return the rates at squared ground distances as shares of the best, 0 beyond R."""
        channel = self.channel
        slant = np.sqrt(channel.altitude_m**2 + squared_m2) + channel.position_error_m
        snr = channel.gamma0 * slant**-channel.radio.path_loss_exponent
        within = squared_m2 <= (channel.radius_m + REACH_TOLERANCE_M) ** 2
        return np.where(within, np.log1p(snr) / self._best, 0.0)

    @cached_property
    def _best(self) -> float:
        """The best rate, in nat/s/Hz."""
        return float(self.channel.air_rate(np.zeros(1))[0]) * math.log(2.0)

    def rates(self, stops_m: Floats) -> Floats:
        """Return (..., M, N) shares of the best rate at stops (..., M, 2)."""
        x = stops_m[..., :1] - self.users_m[:, 0]
        y = stops_m[..., 1:] - self.users_m[:, 1]
        return self.shares(x * x + y * y)

    def rates_of_many(self, stops_m: Floats) -> Floats:
        """Return (B, M, N) `rates` of plans (B, M, 2) that have most of their stops in common."""
        places, which = np.unique(as_numbers(stops_m), return_inverse=True)
        return self.rates(as_places(places))[which.reshape(stops_m.shape[:2])]

    def passing_s(self, stops_m: Floats) -> Floats:
        """Return (..., N) seconds at the best rate received on the legs of plans with stops (..., M, 2).

        As at full speed all the way, and what a ramp takes beyond that as if it were spent at one place of it.
        """
        assert self.table is not None
        speed = self.vehicle.speed_m_s
        if self.onward is not None and self.onward.serves:
            last = np.broadcast_to(self.onward.place_m, (*stops_m.shape[:-2], 1, 2))
            stops_m = np.concatenate([stops_m, last], axis=-2)
        starts = np.concatenate([np.zeros((*stops_m.shape[:-2], 1, 2)), stops_m[..., :-1, :]], axis=-2)
        seconds: Floats = self.table.metres(starts, stops_m, self.users_m).sum(axis=-2) / speed
        if self.vehicle.acceleration_m_s2 == 0:
            return seconds
        steps = stops_m - starts
        length = np.sqrt((steps**2).sum(axis=-1))
        legs = self.flyer.motion(length, speed)
        early_s = self.flyer.held_early_s(legs, length, speed)
        slow_s = np.asarray(legs.time_s - early_s - length / speed) / 2
        part = RAMP_PLACE * legs.peak_m_s * legs.ramp_s / 2 / np.maximum(length, 1e-9)
        inward = steps * part[..., None]
        for places in (starts + inward, stops_m - inward):
            seconds = seconds + np.einsum("...m,...mn->...n", slow_s, self.rates(places))
        return seconds

    def wants(self, reached: Bools, passing_s: Floats | None) -> Floats:
        """Return (B, N) what each user must receive at the stops; infinite where that cannot be.

        A user whom no stop reaches is its mate's business, if a stop reaches that one. Else it must be served in
        flight alone: a need of at most what it receives there, or none at all and a leg within R.
        """
        wants = np.broadcast_to(self.need_s, reached.shape).copy()
        paired = self.mate != UNPAIRED
        relayed = ~reached & paired & reached[:, self.mate]
        wants[relayed] = 0.0
        which, user = np.nonzero(relayed)
        wants[which, self.mate[user]] += self.need_s[user]
        alone = ~reached & ~relayed
        if passing_s is not None:
            wants -= passing_s
            wants[relayed] = 0.0
        if passing_s is not None and self.alone:
            served = passing_s >= np.where(self.need_s > 0, self.need_s + SURE_S, MET_S)
            wants[alone] = np.where(served, 0.0, np.inf)[alone]
        else:
            wants[alone] = np.inf
        return wants

    def times(self, stops_m: Floats) -> Times:
        """Return the figures of B plans with stops (B, M, 2)."""
        rates = self.rates(stops_m)
        return self.hovering(self.flight_s(stops_m), rates, self.wants_of(stops_m, rates))

    def wants_of(self, stops_m: Floats, rates: Floats) -> Floats:
        """Return (B, N) what each user must receive at the stops of plans (B, M, 2), their rates given."""
        passing_s = self.passing_s(stops_m) if self.in_flight else None
        return self.wants(np.asarray(rates.any(axis=1)), passing_s)

    def hovering(self, flight_s: Floats, rates: Floats, wants: Floats) -> Times:
        """Return the figures of B plans whose flight, rates (B, M, N) and wants (B, N) are known."""
        if self.tdma:
            return self._one_at_a_time(flight_s, rates, wants)
        batch, stops, users = rates.shape
        found = Times(flight_s, np.full(batch, np.inf), np.zeros((batch, stops)), np.zeros((batch, users)))
        able = np.flatnonzero(np.isfinite(wants).all(axis=1))
        hover = least_hover(rates[able], wants[able])
        found.hover_s[able] = hover.total_s
        found.holds_s[able], found.prices[able] = hover.holds_s, hover.prices
        return found

    def _one_at_a_time(self, flight_s: Floats, rates: Floats, wants: Floats) -> Times:
        """Return the figures where each user is served alone, at its best stop."""
        best = rates.argmax(axis=1)
        rate = np.take_along_axis(rates, best[:, None], axis=1)[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            prices = np.where(rate > 0, 1.0 / rate, 0.0)
            seconds = np.where(wants > 0, wants / rate, 0.0)
        holds = np.zeros(rates.shape[:2])
        np.add.at(holds, (np.arange(len(best))[:, None], best), np.where(np.isfinite(seconds), seconds, 0.0))
        return Times(flight_s, seconds.sum(axis=1), holds, prices)

    def slopes(self, squared_m2: Floats) -> Floats:
        """Return the derivatives of `shares` by the squared distance; 0 beyond R."""
        channel = self.channel
        exponent = channel.radio.path_loss_exponent
        straight = np.sqrt(channel.altitude_m**2 + squared_m2)
        slant = straight + channel.position_error_m
        snr = channel.gamma0 * slant**-exponent
        by_slant = -exponent * snr / ((1 + snr) * slant * self._best)
        within = squared_m2 <= (channel.radius_m + REACH_TOLERANCE_M) ** 2
        return np.where(within, by_slant / (2 * straight), 0.0)
