"""The channel integrated along a flown path: what each user received, in flight and during each hold. Pure.

Rate 0 beyond R over the ground and below the threshold in space; distance in space with the height really flown.
Between two moments the rate is the mean of theirs.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mavplan.hover import Slot
from mavplan.proof.path import Path
from mavplan.radio import REACH_TOLERANCE_M, Channel, highest_altitude_m, spectral_rate
from mavplan.track.model import Floats, Span

NEAREST_M = 1.0
"""The gain is defined at 1 m; nearer, nobody hears any better."""

CHUNK = 400_000
"""So many rates are worked out at a time: 3 MB, whatever the length of the track and the number of users."""


@dataclass(frozen=True, eq=False)
class Received:
    """What N users received from the vehicle, in bits. M stops.

    Attributes
    ----------
    flight_bit
        (N,) while it was at no stop.
    hold_bit
        (M, N) during each hold.
    """

    flight_bit: Floats
    hold_bit: Floats

    @property
    def total_bit(self) -> Floats:
        """(N,) in all."""
        total: Floats = self.flight_bit + self.hold_bit.sum(axis=0)
        return total


def rates_bit_s(xy_m: Floats, height_m: Floats, users_m: Floats, channel: Channel) -> Floats:
    """Return (S, N) bit/s of N users from S places of the vehicle.

    Parameters
    ----------
    xy_m, height_m
        (S, 2) and (S,) metres east and north of home and above it.
    users_m
        (N, 2) users at the height of home, reached within R over the ground; or (N, 3) with their own heights, reached
        as far in space as the threshold is met.
    channel
        As it is.
    """
    apart = xy_m[:, None, :] - users_m[None, :, :2]
    ground_m2 = np.einsum("snk,snk->sn", apart, apart)
    most_m = highest_altitude_m(channel.radio) + REACH_TOLERANCE_M
    if users_m.shape[1] == 3:
        slant_m2 = ground_m2 + (height_m[:, None] - users_m[None, :, 2]) ** 2
        heard = np.flatnonzero(slant_m2 <= most_m**2)
    else:
        slant_m2 = ground_m2 + (height_m**2)[:, None]
        heard = np.flatnonzero(
            (ground_m2 <= (channel.radius_m + REACH_TOLERANCE_M) ** 2) & (slant_m2 <= most_m**2)
        )
    rates = np.zeros(slant_m2.size)
    squared = np.maximum(slant_m2.ravel()[heard], NEAREST_M**2)
    rates[heard] = channel.radio.bandwidth_hz * spectral_rate(
        squared, channel.gamma0, channel.radio.path_loss_exponent
    )
    return rates.reshape(slant_m2.shape)


def received_by_broadcast(
    path: Path, holds: Sequence[Span | None], users_m: Floats, channel: Channel
) -> Received:
    """Return what users received where everyone in reach receives all the time.

    Parameters
    ----------
    path
        The flight; beginnings and ends of holds are moments of it (`mavplan.proof.path.cut`).
    holds
        The M holds, None where there was none.
    users_m
        (N, 2) or (N, 3), as for `rates_bit_s`.
    channel
        As it is, without anything kept for drift.
    """
    share_s = counted_s(path)
    stop_of = stop_of_piece(path, holds)
    flight = np.zeros(len(users_m))
    hold = np.zeros((len(holds), len(users_m)))
    for first, last in _chunks(share_s, len(users_m)):
        rates = rates_bit_s(path.xy_m[first : last + 1], path.height_m[first : last + 1], users_m, channel)
        labels = stop_of[first:last]
        for label in np.unique(labels):
            # Each piece is half its length at either end.
            piece_s = np.where(labels == label, share_s[first:last], 0.0) / 2
            bits = np.append(piece_s, 0.0) @ rates + np.append(0.0, piece_s) @ rates
            if label < 0:
                flight += bits
            else:
                hold[label] += bits
    return Received(flight, hold)


def counted_s(path: Path) -> Floats:
    """Return (S − 1,) seconds of each piece that count."""
    return np.where(path.counts, np.diff(path.time_s), 0.0)


def stop_of_piece(path: Path, holds: Sequence[Span | None]) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return (S − 1,) at which stop each piece was flown, −1 for none."""
    middle_s = (path.time_s[:-1] + path.time_s[1:]) / 2
    stop_of = np.full(len(middle_s), -1, dtype=np.int64)
    for stop, span in enumerate(holds):
        if span is not None:
            first, last = np.searchsorted(middle_s, span)
            stop_of[first:last] = stop
    return stop_of


def _chunks(share_s: Floats, users: int) -> Iterator[tuple[int, int]]:
    """Yield ranges of pieces that are worked out at a time; those in which nothing counts are left out."""
    size = max(CHUNK // max(users, 1), 1)
    for first in range(0, len(share_s), size):
        last = min(first + size, len(share_s))
        if share_s[first:last].any():
            yield first, last


def received_by_turns(
    path: Path, holds: Sequence[Span | None], schedule: Sequence[Slot], users_m: Floats, channel: Channel
) -> Received:
    """Return what users received where one at a time is served, during holds only.

    The turns of a stop run from the real beginning of its hold; what of them lies behind its end is lost. Arguments
    as for `received_by_broadcast`; beginnings and ends of turns need not be moments of the path.
    """
    received = Received(np.zeros(len(users_m)), np.zeros((len(holds), len(users_m))))
    for slot in schedule:
        turn = turn_of(slot, holds[slot.stop])
        if turn is not None:
            bits = turn_bits(path, turn, users_m[slot.user], channel)[1]
            received.hold_bit[slot.stop, slot.user] += bits.sum()
    return received


def turn_of(slot: Slot, hold: Span | None) -> Span | None:
    """Return when a turn really was, None where nothing was left of it."""
    if hold is None:
        return None
    begin_s = hold.from_s + slot.start_s
    end_s = min(begin_s + slot.duration_s, hold.until_s)
    return Span(begin_s, end_s) if end_s > begin_s else None


def turn_bits(path: Path, turn: Span, user_m: Floats, channel: Channel) -> tuple[Floats, Floats]:
    """Return the moments (K,) of a turn and the bits (K − 1,) that its user received between them."""
    first, last = np.searchsorted(path.time_s, turn, side="right")
    inner = path.time_s[first:last]
    time_s = np.unique(np.concatenate(([turn.from_s], inner, [turn.until_s])))
    time_s = time_s[(time_s >= path.time_s[0]) & (time_s <= path.time_s[-1])]
    if len(time_s) < 2:
        return time_s, np.zeros(0)
    xy_m = np.column_stack([np.interp(time_s, path.time_s, axis) for axis in path.xy_m.T])
    height_m = np.interp(time_s, path.time_s, path.height_m)
    rates = rates_bit_s(xy_m, height_m, user_m[None, :], channel)[:, 0]
    piece = np.searchsorted(path.time_s, time_s[:-1], side="right") - 1
    share_s = np.where(path.counts[piece], np.diff(time_s), 0.0)
    return time_s, share_s * (rates[:-1] + rates[1:]) / 2
