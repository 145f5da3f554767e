"""BOAIK: the balance of throughput and length, section 6 of the paper.

S. Zhang et al., EURASIP J. Wireless Com. Network. 2021:107, doi 10.1186/s13638-021-01987-3.
"""

import numpy as np

from mavplan.planners.balance import best_balance
from mavplan.planners.clustering import clip_clusters, cluster_centres
from mavplan.planners.ordering import from_origin, minimum_path_order, stops_only_path
from mavplan.planners.sca import STEPS, improve_stops
from mavplan.planners.selection import supplementary_stops
from mavplan.planners.setting import Setting
from mavplan.planners.trajectory import Trajectory, assign
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
    stops = np.vstack([improved, added])
    stops = stops[minimum_path_order(stops)]
    path, stop_at = stops_only_path(stops)
    return Trajectory(
        planner="boaik",
        clusters=clusters,
        path_m=path,
        stop_at=stop_at,
        reference_m=reference,
        assignment=assign(users, stops, channel, d2d=True),
        radius_m=channel.radius_m,
        notes=notes,
    )
