"""Second-order cones of the plane, many at once: the algebra of a primal-dual interior point.

An element (a0, a1, a2) of the cone Q has a0 ≥ ‖(a1, a2)‖; arrays are (3, ...), one cone for each of the rest.

References
----------
Y. E. Nesterov and M. J. Todd, "Self-scaled barriers and interior-point methods for convex programming", Mathematics of
Operations Research 22, 1997, doi 10.1287/moor.22.1.1; written out for this cone in L. Vandenberghe, "The CVXOPT
linear and quadratic cone program solvers", 2010, section 4.
"""

from dataclasses import dataclass

import numpy as np

from mavplan.scenario.model import Floats


def product(a: Floats, b: Floats) -> Floats:
    """Return the Jordan product a∘b = (a·b, a0·b̄ + b0·ā)."""
    found = np.empty_like(a)
    found[0] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    found[1:] = a[0] * b[1:] + b[0] * a[1:]
    return found


def quotient(a: Floats, b: Floats) -> Floats:
    """Return the x with a∘x = b, for a inside the cone."""
    found = np.empty_like(a)
    found[0] = (a[0] * b[0] - a[1] * b[1] - a[2] * b[2]) / determinant(a)
    found[1:] = (b[1:] - found[0] * a[1:]) / a[0]
    return found


def determinant(a: Floats) -> Floats:
    """Return a0² − ‖ā‖², as a product: little is lost close to the border of the cone."""
    norm = np.sqrt(a[1] * a[1] + a[2] * a[2])
    found: Floats = (a[0] - norm) * (a[0] + norm)
    return found


def longest_step(a: Floats, direction: Floats) -> Floats:
    """Return for each cone how far ``a`` can go in this direction before it leaves the cone; infinite where never."""
    squared = direction[0] * direction[0] - direction[1] * direction[1] - direction[2] * direction[2]
    mixed = a[0] * direction[0] - a[1] * direction[1] - a[2] * direction[2]
    first = determinant(a)
    discriminant = mixed * mixed - squared * first
    divisor = np.sqrt(np.maximum(discriminant, 0.0)) - mixed
    leaves = (divisor > 0.0) & (discriminant >= 0.0)
    step: Floats = np.where(leaves, first / np.where(leaves, divisor, 1.0), np.inf)
    return step


@dataclass(frozen=True, eq=False)
class Scaling:
    """The scaling of Nesterov and Todd: the W with W·z = W⁻¹·s for s and z inside the cone.

    W = η·(2·v·vᵀ − J)^(1/2) in the form η·[[w0, w̄ᵀ], [w̄, I + w̄·w̄ᵀ/(1 + w0)]], J = diag(1, −1, −1).

    Attributes
    ----------
    w
        (3, ...) with w0² − ‖w̄‖² = 1.
    inverse_square
        1/η².
    """

    w: Floats
    inverse_square: Floats

    @classmethod
    def of(cls, s: Floats, z: Floats) -> "Scaling":
        """Return the scaling of two elements inside the cone."""
        s_root, z_root = np.sqrt(determinant(s)), np.sqrt(determinant(z))
        s, z = s / s_root, z / z_root
        twice_gamma = np.sqrt(2.0 + 2.0 * (s[0] * z[0] + s[1] * z[1] + s[2] * z[2]))
        w = np.empty_like(s)
        w[0] = (s[0] + z[0]) / twice_gamma
        w[1:] = (s[1:] - z[1:]) / twice_gamma
        return cls(w, z_root / s_root)

    def times(self, a: Floats) -> Floats:
        """Return W·a."""
        w, root = self.w, np.sqrt(self.inverse_square)
        dot = w[1] * a[1] + w[2] * a[2]
        found = np.empty_like(a)
        found[0] = (w[0] * a[0] + dot) / root
        found[1:] = (a[1:] + w[1:] * (a[0] + dot / (1.0 + w[0]))) / root
        return found

    def inverse_times(self, a: Floats) -> Floats:
        """Return W⁻¹·a."""
        w, root = self.w, np.sqrt(self.inverse_square)
        dot = w[1] * a[1] + w[2] * a[2]
        found = np.empty_like(a)
        found[0] = (w[0] * a[0] - dot) * root
        found[1:] = (a[1:] + w[1:] * (dot / (1.0 + w[0]) - a[0])) * root
        return found

    def inverse_square_times(self, a: Floats) -> Floats:
        """Return W⁻²·a = (2·(Jw)·(Jw)ᵀ − J)·a/η²."""
        w = self.w
        twice_dot = 2.0 * (w[0] * a[0] - w[1] * a[1] - w[2] * a[2])
        found = np.empty_like(a)
        found[0] = self.inverse_square * (twice_dot * w[0] - a[0])
        found[1:] = self.inverse_square * (a[1:] - twice_dot * w[1:])
        return found
