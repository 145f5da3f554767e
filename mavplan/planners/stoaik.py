"""STOAIK: the highest sum throughput, section 5 of the paper.

S. Zhang et al., EURASIP J. Wireless Com. Network. 2021:107, doi 10.1186/s13638-021-01987-3.
"""

import numpy as np

from mavplan.planners.clustering import clip_clusters, cluster_centres
from mavplan.planners.geometry import nearest_of
from mavplan.planners.ordering import from_origin, minimum_path_order
from mavplan.planners.sca import STEPS, improve_stops
from mavplan.planners.setting import Setting
from mavplan.planners.trajectory import Trajectory, shortest_steps
from mavplan.radio import Channel
from mavplan.scenario.model import Users


def stoaik(users: Users, channel: Channel, setting: Setting) -> Trajectory:
    """Plan by sum-throughput optimisation with improved K-means.

    The K centres of the clustering phase are moved by SCA. Every user that none of them covers gets a stop straight
    above it, its mate or not, and D2D serves nobody (assumed from the text of sections 4.2 and 7). MPSS orders all.
    """
    clusters, notes = clip_clusters(users, setting.clusters)
    centres = cluster_centres(users.xy_m, clusters, setting.rng)
    improved = improve_stops(centres, users.xy_m, channel, STEPS[setting.solver])
    covered = channel.reaches(nearest_of(users.xy_m, improved)[0])
    # Users on one spot share the stop above it.
    above = np.unique(users.xy_m[~covered], axis=0)
    return shortest_steps(
        "stoaik",
        users,
        channel,
        np.vstack([improved, above]),
        reference_m=from_origin(improved[minimum_path_order(improved)]),
        d2d=False,
        clusters=clusters,
        notes=notes,
    )
