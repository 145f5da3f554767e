"""The bound of a plan's file proved anew, from the file alone."""

from dataclasses import dataclass

from mavplan.bounds import Bound
from mavplan.bounds.path import CertificateError, from_json, proved_length_m
from mavplan.radio import planning_channel
from mavplan.stored_plan import StoredPlan

ROUNDING = 0.002
"""Metres by which figures in the file are rounded."""


@dataclass(frozen=True)
class ProvedBound:
    """What a certificate proves of a plan.

    Attributes
    ----------
    stated
        The plan's figure and its bound, as the file has them.
    proved
        What the certificate proves; less than the stated bound where the whole proof would have been too long.
    """

    stated: Bound
    proved: float


def prove_bound(plan: StoredPlan) -> ProvedBound | None:
    """Check the certificate in a plan's file; None where it has none.

    Raises
    ------
    CertificateError
        It proves nothing, less than it says, or more than the plan has.
    """
    stated, content = plan.bound, plan.certificate
    if content is None:
        return None
    if stated is None or stated.objective == "mission_s":
        raise CertificateError("a certificate of a path, but no bound on one")
    certificate = from_json(content)
    if certificate.returns != (stated.objective == "tour_m"):
        raise CertificateError("the certificate is of another kind of path than the plan's")
    users = plan.scenario.users
    radius_m = planning_channel(plan.scenario).radius_m
    proved_m = proved_length_m(certificate, users.xy_m, users.mate, radius_m)
    said_m = content.get("bound")
    if not isinstance(said_m, int | float) or proved_m < said_m - ROUNDING:
        raise CertificateError(f"proves {proved_m:,.3f} m, not the {said_m} m that it says")
    if proved_m > stated.plan + ROUNDING:
        raise CertificateError(
            f"proves {proved_m:,.3f} m, more than the {stated.plan:,.3f} m of the plan itself"
        )
    return ProvedBound(stated, proved_m)
