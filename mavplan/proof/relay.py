"""What D2D users got from their mates: what the mate received beyond its own demand, no faster than their link. Pure.

The mate sends on from the moment at which it has its own; what it cannot send at once waits. D2D does not chain.
"""

from collections.abc import Sequence

import numpy as np

from mavplan.hover import Slot
from mavplan.proof.path import Path
from mavplan.proof.receive import CHUNK, counted_s, rates_bit_s, turn_bits, turn_of
from mavplan.radio import Channel
from mavplan.scenario.model import Bools
from mavplan.track.model import Floats, Span


def forwarded_bit(
    time_s: Floats, received_bit: Floats, own_bit: float, rate_bit_s: float, end_s: float
) -> float:
    """Return what one mate has sent on at the end.

    A queue that is filled by what comes beyond ``own_bit`` and emptied at a constant rate has let pass, until T, the
    least of A(s) + r·(T − s) over all moments s, where A is what has come in.

    Parameters
    ----------
    time_s
        (K,) increasing moments.
    received_bit
        (K,) what the mate has received until each, 0 at the first.
    own_bit
        Its own demand.
    rate_bit_s
        Of the link; infinite for an ideal one.
    end_s
        Until when it sends; not before the last moment.
    """
    row = int(np.searchsorted(received_bit, own_bit, side="right"))
    if row == len(time_s):
        return 0.0
    beyond = received_bit[row:] - own_bit
    if np.isinf(rate_bit_s):
        return float(beyond[-1])
    share = (own_bit - received_bit[row - 1]) / (received_bit[row] - received_bit[row - 1])
    begin_s = time_s[row - 1] + share * (time_s[row] - time_s[row - 1])
    waiting = beyond + rate_bit_s * (end_s - time_s[row:])
    return float(min(waiting.min(), beyond[-1], rate_bit_s * (end_s - begin_s)))


def relayed_by_broadcast(
    path: Path,
    users_m: Floats,
    mates: Sequence[int],
    own_bit: Floats,
    rates: Floats,
    channel: Channel,
    seen: Bools | None = None,
) -> Floats:
    """Return (K,) bits that each of K mates has sent on when the flight is over.

    Parameters
    ----------
    path
        The flight.
    users_m
        (N, 2) or (N, 3), as for `mavplan.proof.receive.rates_bit_s`.
    mates
        K indices of users.
    own_bit, rates
        (K,) their own demands, and bit/s of their links.
    channel
        As it is.
    seen
        (S − 1, N) whether the ground leaves sight of each user along each piece; None: of all.
    """
    sent = np.zeros(len(mates))
    share_s = counted_s(path)
    size = max(CHUNK // max(len(path.time_s), 1), 1)
    for first in range(0, len(mates), size):
        some = list(mates[first : first + size])
        cumulative = np.zeros((len(path.time_s), len(some)))
        step = max(CHUNK // len(some), 2)
        for row in range(0, len(share_s), step):
            rows = slice(row, min(row + step, len(share_s)) + 1)
            heard = rates_bit_s(path.xy_m[rows], path.height_m[rows], users_m[some], channel)
            pieces = share_s[rows.start : rows.stop - 1, None] * (heard[:-1] + heard[1:]) / 2
            if seen is not None:
                pieces = np.where(seen[rows.start : rows.stop - 1, some], pieces, 0.0)
            cumulative[rows.start + 1 : rows.stop] = cumulative[rows.start] + np.cumsum(pieces, axis=0)
        for column in range(len(some)):
            number = first + column
            sent[number] = forwarded_bit(
                path.time_s,
                cumulative[:, column],
                float(own_bit[number]),
                float(rates[number]),
                float(path.time_s[-1]),
            )
    return sent


def relayed_by_turns(
    path: Path,
    holds: Sequence[Span | None],
    schedule: Sequence[Slot],
    users_m: Floats,
    mates: Sequence[int],
    own_bit: Floats,
    rates: Floats,
    channel: Channel,
) -> Floats:
    """Return (K,) bits that each mate has sent on, as `relayed_by_broadcast`, where one at a time is served."""
    sent = np.zeros(len(mates))
    for number, mate in enumerate(mates):
        times, pieces = [path.time_s[:1]], [np.zeros(0)]
        turns = [turn_of(slot, holds[slot.stop]) for slot in schedule if slot.user == mate]
        for turn in sorted(turn for turn in turns if turn is not None):
            time_s, bits = turn_bits(path, turn, users_m[mate], channel)
            if len(bits):
                times.append(time_s)
                pieces.append(np.append(0.0, bits))
        received = np.append(0.0, np.cumsum(np.concatenate(pieces)))
        sent[number] = forwarded_bit(
            np.concatenate(times),
            received,
            float(own_bit[number]),
            float(rates[number]),
            float(path.time_s[-1]),
        )
    return sent
