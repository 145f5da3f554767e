"""The bound of a plan's file proved anew, from the file alone."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mavplan.bounds import Bound, path, time
from mavplan.bounds.path import CertificateError
from mavplan.bounds.time_case import TimeCase
from mavplan.mission.wind import Wind
from mavplan.radio import planning_channel
from mavplan.stored_plan import StoredPlan

ROUNDING = 0.002
"""Metres or seconds by which figures in the file are rounded."""

CENTIMETRES_S = 0.05
"""By so much a mission may be shorter than planned: the places in it are whole centimetres."""


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
    if stated is None:
        raise CertificateError("a certificate, but no bound")
    if stated.objective == "mission_s":
        proved, unit = _proved_s(plan, content), "s"
    else:
        proved, unit = _proved_m(plan, stated, content), "m"
    said = content.get("bound")
    if not isinstance(said, int | float) or proved < said - ROUNDING:
        raise CertificateError(f"proves {proved:,.3f} {unit}, not the {said} {unit} that it says")
    if proved > stated.plan + (CENTIMETRES_S if unit == "s" else ROUNDING):
        raise CertificateError(
            f"proves {proved:,.3f} {unit}, more than the {stated.plan:,.3f} {unit} of the plan itself"
        )
    return ProvedBound(stated, proved)


def _proved_m(plan: StoredPlan, stated: Bound, content: Mapping[str, Any]) -> float:
    certificate = path.from_json(content)
    if certificate.returns != (stated.objective == "tour_m"):
        raise CertificateError("the certificate is of another kind of path than the plan's")
    users = plan.scenario.users
    radius_m = planning_channel(plan.scenario).radius_m
    return path.proved_length_m(certificate, users.xy_m, users.mate, radius_m)


def _proved_s(plan: StoredPlan, content: Mapping[str, Any]) -> float:
    scenario = plan.scenario
    case = TimeCase.of(
        scenario.users,
        planning_channel(scenario),
        scenario.vehicle,
        scenario.service,
        wind=Wind.of(scenario.wind),
        in_flight=plan.in_flight,
    )
    return time.proved_time_s(time.from_json(content), case)
