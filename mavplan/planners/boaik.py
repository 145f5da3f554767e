"""BOAIK: the balance of throughput and length, section 6 of the paper.

S. Zhang et al., EURASIP J. Wireless Com. Network. 2021:107, doi 10.1186/s13638-021-01987-3.
"""

import numpy as np

from mavplan.planners.balance import best_balance
from mavplan.planners.clustering import clip_clusters, cluster_centres
from mavplan.planners.ordering import from_origin, minimum_path_order
from mavplan.planners.sca import STEPS, improve_stops
from mavplan.planners.selection import supplementary_stops
from mavplan.planners.setting import Setting
from mavplan.planners.trajectory import Trajectory, shortest_steps
from mavplan.radio import Channel
from mavplan.scenario.model import Users


def boaik(users: Users, channel: Channel, setting: Setting) -> Trajectory:
    """Plan by balanced optimisation with improved K-means.

    The clustering phase is STOAIK's; its stops after SCA make the reference trajectory. The supplementary phase serves
    by D2D first, as TLOAIK's, and places each further stop where the joint evaluation index of its own user is
    greatest, P3.
    """
    clusters, notes = clip_clusters(users, setting.clusters)
    centres = cluster_centres(users.xy_m, clusters, setting.rng)
    improved = improve_stops(centres, users.xy_m, channel, STEPS[setting.solver])
    reference = from_origin(improved[minimum_path_order(improved)])
    added = supplementary_stops(users, improved, reference, channel, best_balance(channel))
    return shortest_steps(
        "boaik",
        users,
        channel,
        np.vstack([improved, added]),
        reference_m=reference,
        d2d=True,
        clusters=clusters,
        notes=notes,
    )
