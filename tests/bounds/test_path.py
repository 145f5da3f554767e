"""Certificates of the shortest path: what they prove, that damage never proves more, and that no planner is asked."""

import ast
import dataclasses
import inspect
import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mavplan.bounds import path
from mavplan.bounds.path import (
    Branch,
    CertificateError,
    Leaf,
    PathCertificate,
    from_json,
    proved_length_m,
    to_json,
)
from mavplan.planners.path_bound import path_lower_bound
from mavplan.planners.path_certificate import path_certificate
from mavplan.scenario import UNPAIRED

RADIUS_M = 300.0


def drawn(seed, mean=16, paired=False):
    """Users of the regime, neighbours in the list paired where they are within 900 m."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 2000, (max(2, rng.poisson(mean)), 2))
    mate = np.full(len(xy), UNPAIRED)
    if paired:
        for one in range(0, len(xy) - 1, 2):
            if np.linalg.norm(xy[one] - xy[one + 1]) < 900:
                mate[one], mate[one + 1] = one + 1, one
    return xy, mate


def searched(xy, mate, closed, **limits):
    return path_lower_bound(xy, RADIUS_M, closed=closed, mate=mate, **{"time_limit_s": None, **limits})


@pytest.mark.parametrize("closed", [False, True], ids=["open", "closed"])
@pytest.mark.parametrize("paired", [False, True], ids=["single", "paired"])
@pytest.mark.parametrize(("mean", "seed"), [(5, 0), (16, 1), (16, 2), (60, 3)])
def test_what_the_search_proved_the_check_confirms(mean, seed, paired, closed):
    xy, mate = drawn(seed, mean, paired)
    found = searched(xy, mate, closed)
    certificate = from_json(json.loads(json.dumps(to_json(path_certificate(found, xy, mate)))))
    proved = proved_length_m(certificate, xy, mate, RADIUS_M)
    assert found.bound_m * (1 - 1e-9) <= proved <= found.path.length_m


def test_nobody_to_fly_to_needs_no_proof():
    xy, mate = np.array([[100.0, 0.0]]), np.array([UNPAIRED])
    certificate = path_certificate(searched(xy, mate, False), xy, mate)
    assert certificate.branches == ()
    assert proved_length_m(certificate, xy, mate, RADIUS_M) == 0.0


def test_two_users_at_one_place_and_a_pair_at_one_place_are_proved():
    xy = np.array([[1000.0, 0.0], [1000.0, 0.0], [0.0, 1000.0], [0.0, 1000.0], [1000.0, 1000.0]])
    mate = np.array([UNPAIRED, 4, 3, 2, 1])
    found = searched(xy, mate, False)
    certificate = path_certificate(found, xy, mate)
    assert proved_length_m(certificate, xy, mate, RADIUS_M) == pytest.approx(found.path.length_m, rel=2e-6)


def test_a_proof_that_would_be_too_long_proves_less_and_no_falsehood():
    xy, mate = drawn(3, 60)
    found = searched(xy, mate, False)
    proved = [
        proved_length_m(path_certificate(found, xy, mate, most_cases=most), xy, mate, RADIUS_M)
        for most in (1, 20, 100, 10_000)
    ]
    assert proved == sorted(proved)
    assert proved[0] < 0.9 * proved[-1] <= found.path.length_m


def test_a_search_that_was_cut_off_is_proved_as_far_as_it_came():
    xy, mate = drawn(7, 60)
    found = searched(xy, mate, False, node_limit=200)
    assert found.gap > 0.005
    proved = proved_length_m(path_certificate(found, xy, mate), xy, mate, RADIUS_M)
    assert proved == pytest.approx(found.bound_m, rel=1e-4)
    assert proved >= found.bound_m * (1 - 1e-9)


XY, MATE = drawn(4, 6, paired=True)
FOUND = {closed: searched(XY, MATE, closed) for closed in (False, True)}
WHOLE = {closed: path_certificate(FOUND[closed], XY, MATE) for closed in (False, True)}


@settings(max_examples=300, deadline=None)
@given(st.data(), st.booleans())
def test_no_damage_proves_more_than_the_truth(data, closed):
    content = to_json(WHOLE[closed])
    for _ in range(data.draw(st.integers(1, 4))):
        lines = content[data.draw(st.sampled_from(["branches", "leaves"]))]
        if not lines:
            continue
        at = data.draw(st.integers(0, len(lines) - 1))
        action = data.draw(st.sampled_from(["drop", "copy", "swap", "word", "cut"]))
        if action == "drop":
            del lines[at]
        elif action == "copy":
            lines.insert(at, lines[data.draw(st.integers(0, len(lines) - 1))])
        elif action == "swap":
            other = data.draw(st.integers(0, len(lines) - 1))
            lines[at], lines[other] = lines[other], lines[at]
        else:
            parts = [part.split() for part in lines[at].split("|")]
            part = data.draw(st.sampled_from([part for part in parts if part] or [[]]))
            if part and action == "word":
                part[data.draw(st.integers(0, len(part) - 1))] = str(data.draw(st.integers(-9, 20000)))
            elif part:
                del part[data.draw(st.integers(0, len(part) - 1))]
            lines[at] = "|".join(" ".join(part) for part in parts)
    try:
        proved = proved_length_m(from_json(content), XY, MATE, RADIUS_M)
    except CertificateError:
        return
    assert proved <= FOUND[closed].path.length_m * (1 + 1e-9)


def test_a_missing_case_an_early_reference_and_a_foreign_sequence_are_named():
    whole = WHOLE[False]
    first = whole.branches[0]

    def broken(**changes):
        branches = (dataclasses.replace(first, **changes), *whole.branches[1:])
        return dataclasses.replace(whole, branches=branches)

    for certificate, words in (
        (broken(children=first.children[1:]), "cases"),
        (broken(children=(0, *first.children[1:])), "no later branch"),
        (broken(children=(-9999, *first.children[1:])), "no leaf"),
        (broken(sequence=(first.user,)), "empty"),
        (broken(user=len(XY)), "does not exist"),
        (dataclasses.replace(whole, branches=whole.branches[1:]), "empty"),
    ):
        with pytest.raises(CertificateError, match=words):
            proved_length_m(certificate, XY, MATE, RADIUS_M)
    elsewhere = Leaf((1, 0, 2, 3), np.zeros((4, 2)))
    stranger = PathCertificate(False, (Branch((), 4, (-1,) * (2 if MATE[4] >= 0 else 1)),), (elsewhere,))
    with pytest.raises(CertificateError, match="no part"):
        proved_length_m(stranger, XY, MATE, RADIUS_M)


def test_a_leaf_by_hand():
    xy, mate = np.array([[1000.0, 0.0]]), np.array([UNPAIRED])
    straight = PathCertificate(False, (Branch((), 0, (-1,)),), (Leaf((0,), np.array([[1.0, 0.0]])),))
    assert proved_length_m(straight, xy, mate, RADIUS_M) == pytest.approx(700.0, abs=1e-5)
    aside = PathCertificate(False, (Branch((), 0, (-1,)),), (Leaf((0,), np.array([[0.6, 0.8]])),))
    assert proved_length_m(aside, xy, mate, RADIUS_M) == pytest.approx(300.0, abs=1e-5)
    there_and_back = np.array([[1.0, 0.0], [-1.0, 0.0]])
    closed = PathCertificate(True, (Branch((), 0, (-1,)),), (Leaf((0,), there_and_back),))
    assert proved_length_m(closed, xy, mate, RADIUS_M) == pytest.approx(1400.0, abs=1e-5)


def test_vectors_longer_than_one_prove_no_more():
    xy, mate = np.array([[1000.0, 0.0]]), np.array([UNPAIRED])
    for factor, vector in itertools.product((1.0, 1.5, 1e6), ([1.0, 0.0], [0.6, 0.8])):
        one = PathCertificate(False, (Branch((), 0, (-1,)),), (Leaf((0,), factor * np.array([vector])),))
        assert proved_length_m(one, xy, mate, RADIUS_M) <= 700.0


@pytest.mark.parametrize(
    "content",
    [
        None,
        [],
        {},
        {"kind": "cover"},
        {"kind": "path", "returns": False, "branches": "x", "leaves": []},
        {"kind": "path", "returns": False, "branches": ["|0"], "leaves": []},
        {"kind": "path", "returns": False, "branches": ["|0|-1"], "leaves": ["0|99|1 0"]},
        {"kind": "path", "returns": False, "branches": ["|0|-1"], "leaves": ["0|0|1 0 1"]},
        {"kind": "path", "returns": False, "branches": [3], "leaves": []},
    ],
)
def test_what_is_no_certificate_is_refused(content):
    with pytest.raises(CertificateError):
        from_json(content)


def test_the_check_asks_no_planner_and_no_solver():
    tree = ast.parse(inspect.getsource(path))
    imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    imported |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert imported == {"collections.abc", "dataclasses", "typing", "numpy", "numpy.typing"}
