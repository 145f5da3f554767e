"""A proof that no path which reaches everybody is shorter, and its check: two rules, no solver.

*A leaf* is a sequence of discs with a vector u_i, ‖u_i‖ ≤ 1, for each leg. A path that touches the discs in this
order at x_1 … x_K has a length of at least Σ‖x_i − x_{i−1}‖ ≥ Σ u_i·(x_i − x_{i−1}); sorted by the x_i, each of which
lies within R of its centre c_i, that is at least

    Σ_i [c_i·(u_i − u_{i+1}) − R·‖u_i − u_{i+1}‖],

with home as the origin and u_{K+1} = 0 where the path ends anywhere.

*A branch* is a sequence and a user who has to be reached, or whose mate has. Any path that touches the sequence in
order and reaches everybody touches the user's disc, or the mate's, somewhere before, between or behind: each of these
longer sequences must contain, in order, the sequence of a later branch or of a leaf. The first branch is the empty
sequence. So every path that reaches everybody ends in a leaf, and none is shorter than the least of their bounds.
Where it returns home, a path may be read backwards.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

UNPAIRED = -1
KIND = "path"
MOST_DIGITS = 12
REACH_TOLERANCE_M = 1e-6
"""A user this far beyond R counts as reached, in plans and so in proofs."""


class CertificateError(ValueError):
    """The certificate proves nothing; the message says where it breaks."""


@dataclass(frozen=True)
class Branch:
    """A sequence of users, one more to be reached, and for each longer sequence what it contains.

    Attributes
    ----------
    sequence
        Users whose discs are touched, in order.
    user
        Who is to be reached, or its mate.
    children
        First for the user, then for the mate (if it has one elsewhere), from before the first of the sequence to behind
        the last: a branch from 0, or a leaf as −1 − its index.
    """

    sequence: tuple[int, ...]
    user: int
    children: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Leaf:
    """A sequence of users, and the vectors (L, 2) of its legs; longer ones than 1 count as of length 1."""

    sequence: tuple[int, ...]
    duals: Floats


@dataclass(frozen=True, eq=False)
class PathCertificate:
    """Branches, the empty sequence first, and leaves; without any branch it proves a length of 0."""

    returns: bool
    branches: tuple[Branch, ...]
    leaves: tuple[Leaf, ...]


def proved_length_m(certificate: PathCertificate, users_xy_m: Floats, mate: Ints, radius_m: float) -> float:
    """Return the length in metres that a certificate proves no path to be below.

    Parameters
    ----------
    users_xy_m
        (N, 2) users in metres from home.
    mate
        (N,) mates or `UNPAIRED`.
    radius_m
        R.

    Raises
    ------
    CertificateError
        A case is missing, or a reference leads nowhere or back.
    """
    branches, leaves = certificate.branches, certificate.leaves
    if not branches:
        return 0.0
    if branches[0].sequence:
        raise CertificateError("the first branch is not the empty sequence")
    known = range(len(users_xy_m))
    for index, branch in enumerate(branches):
        if not {*branch.sequence, branch.user}.issubset(known):
            raise CertificateError(f"branch {index} names a user that does not exist")
        longer = list(_longer(branch, users_xy_m, mate))
        if len(longer) != len(branch.children):
            raise CertificateError(f"branch {index} has {len(branch.children)} of {len(longer)} cases")
        for sequence, child in zip(longer, branch.children, strict=True):
            if not (index < child < len(branches) or -len(leaves) <= child < 0):
                raise CertificateError(
                    f"branch {index} refers to {child}, which is no later branch and no leaf"
                )
            part = branches[child].sequence if child > 0 else leaves[-1 - child].sequence
            backwards = certificate.returns and _contains(sequence, part[::-1])
            if not (_contains(sequence, part) or backwards):
                raise CertificateError(
                    f"branch {index} refers to {child}, whose sequence is no part of the case"
                )
    return max(0.0, min(_leaf_m(leaf, certificate.returns, users_xy_m, radius_m) for leaf in leaves))


def _longer(branch: Branch, users_xy_m: Floats, mate: Ints) -> Iterable[tuple[int, ...]]:
    """Yield the sequences with the user, then with the mate, at every position."""
    other = int(mate[branch.user])
    members = [branch.user]
    if other != UNPAIRED and (users_xy_m[other] != users_xy_m[branch.user]).any():
        members.append(other)
    for member in members:
        for position in range(len(branch.sequence) + 1):
            yield (*branch.sequence[:position], member, *branch.sequence[position:])


def _contains(sequence: tuple[int, ...], part: tuple[int, ...]) -> bool:
    """Return whether ``part`` is what is left of the sequence when some of it is left out."""
    rest = iter(sequence)
    return all(user in rest for user in part)


def _leaf_m(leaf: Leaf, returns: bool, users_xy_m: Floats, radius_m: float) -> float:
    """Return the length that a leaf proves."""
    count = len(leaf.sequence)
    if leaf.duals.shape != (count + returns, 2) or not count or not np.isfinite(leaf.duals).all():
        raise CertificateError(f"a leaf of {count} users has vectors of shape {leaf.duals.shape}")
    if not set(leaf.sequence).issubset(range(len(users_xy_m))):
        raise CertificateError("a leaf names a user that does not exist")
    u = leaf.duals / np.maximum(np.linalg.norm(leaf.duals, axis=1, keepdims=True), 1.0)
    turns = u[:count] - (u[1:] if returns else np.vstack([u[1:], np.zeros(2)]))
    reach_m = radius_m + REACH_TOLERANCE_M
    centres_m = users_xy_m[list(leaf.sequence)]
    return float((centres_m * turns).sum() - reach_m * np.linalg.norm(turns, axis=1).sum())


def to_json(certificate: PathCertificate) -> dict[str, Any]:
    """Return the certificate as an object for JSON, a line of text for each branch and leaf.

    Branches are ``sequence|user|children``; leaves are ``sequence|digits|vectors``, the vectors' x and y as whole
    numbers, to be divided by 10 to the power of the digits.
    """
    return {
        "kind": KIND,
        "returns": certificate.returns,
        "branches": [
            f"{_line(branch.sequence)}|{branch.user}|{_line(branch.children)}"
            for branch in certificate.branches
        ],
        "leaves": [f"{_line(leaf.sequence)}|{_decimals(leaf.duals)}" for leaf in certificate.leaves],
    }


def from_json(content: Any) -> PathCertificate:
    """Return the certificate in an object.

    Raises
    ------
    CertificateError
        It is none.
    """
    try:
        if content["kind"] != KIND:
            raise CertificateError(f"a certificate of kind {content['kind']!r} is not known here")
        branches = tuple(_branch(*line.split("|")) for line in content["branches"])
        leaves = tuple(_leaf(*line.split("|")) for line in content["leaves"])
        return PathCertificate(content["returns"] is True, branches, leaves)
    except (KeyError, TypeError, AttributeError, ValueError, OverflowError) as error:
        raise CertificateError(f"not a certificate of a path: {error}") from error


def _branch(sequence: str, user: str, children: str) -> Branch:
    return Branch(_numbers(sequence), int(user), _numbers(children))


def _leaf(sequence: str, digits: str, vectors: str) -> Leaf:
    decimals = int(digits)
    if not 0 <= decimals <= MOST_DIGITS:
        raise ValueError(f"{decimals} digits of a leaf")
    return Leaf(
        _numbers(sequence), np.array(_numbers(vectors), dtype=np.float64).reshape(-1, 2) / 10.0**decimals
    )


def _numbers(line: str) -> tuple[int, ...]:
    return tuple(int(word) for word in line.split())


def _line(numbers: Iterable[int]) -> str:
    return " ".join(map(str, numbers))


def _decimals(duals: Floats) -> str:
    """Return the number of decimals that vectors have, and them as whole numbers."""
    for digits in range(MOST_DIGITS + 1):
        whole = np.rint(duals * 10.0**digits)
        if digits == MOST_DIGITS or (whole / 10.0**digits == duals).all():
            break
    return f"{digits}|{_line(int(value) for value in whole.ravel())}"
