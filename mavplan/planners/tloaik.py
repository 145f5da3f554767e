"""TLOAIK: the shortest trajectory, section 4 of the paper.

S. Zhang et al., "Trajectory planning in UAV emergency networks with potential underlaying D2D communication based
on K-means", EURASIP J. Wireless Com. Network. 2021:107, doi 10.1186/s13638-021-01987-3.
"""

import numpy as np

from mavplan.planners.clustering import clip_clusters, cluster_centres
from mavplan.planners.ordering import from_origin, minimum_path_order
from mavplan.planners.selection import nearest_to_reference, supplementary_stops
from mavplan.planners.setting import Setting
from mavplan.planners.trajectory import Trajectory, shortest_steps
from mavplan.radio import Channel
from mavplan.scenario.model import Users


def tloaik(users: Users, channel: Channel, setting: Setting) -> Trajectory:
    """Plan by trajectory-length optimisation with improved K-means.

    The K centres of the clustering phase, in MPSS order from the origin, make the reference trajectory; SPSS adds
    stops for those it leaves uncovered; MPSS orders the union. The leg from the origin counts to the reference
    (assumed: the paper does not say).
    """
    clusters, notes = clip_clusters(users, setting.clusters)
    centres = cluster_centres(users.xy_m, clusters, setting.rng)
    reference = from_origin(centres[minimum_path_order(centres)])
    added = supplementary_stops(users, centres, reference, channel, nearest_to_reference(channel))
    return shortest_steps(
        "tloaik",
        users,
        channel,
        np.vstack([centres, added]),
        reference_m=reference,
        d2d=True,
        clusters=clusters,
        notes=notes,
    )
