"""Regions of the plane with a bounded number of users each, by halving the wider side again and again."""

import numpy as np

from mavplan.scenario.model import Floats, Ints


def halved(places_m: Floats, most: int) -> list[Ints]:
    """Return the indices of places (N, 2) in parts of at most ``most``, each in a rectangle of its own."""
    return [own for own, _ in shared_out(places_m, np.empty((0, 2)), most)]


def shared_out(
    places_m: Floats, others_m: Floats, most: int, first_share: float = 0.5
) -> list[tuple[Ints, Ints]]:
    """Return regions: the places in each, at most ``most``, and the other points in the same rectangle.

    Parameters
    ----------
    first_share
        Share of the places on one side of the first cut; other shares put all cuts elsewhere.
    """
    found = []
    todo = [(np.arange(len(places_m)), np.arange(len(others_m)), first_share)]
    while todo:
        own, others, share = todo.pop()
        if len(own) <= most:
            found.append((own, others))
            continue
        places = places_m[own]
        axis = int(np.ptp(places, axis=0).argmax())
        order = np.argsort(places[:, axis], kind="stable")
        cut = min(max(round(share * len(own)), 1), len(own) - 1)
        border_m = places[order[cut], axis]
        beyond = others_m[others, axis] >= border_m
        # The lower part is taken first: the last put in is the next taken out.
        todo.append((own[order[cut:]], others[beyond], 0.5))
        todo.append((own[order[:cut]], others[~beyond], 0.5))
    return found
