"""Which forces a contact can carry: cones in the contact's own axes, z out of the surface."""

# X, Y and C are the sides of a sole and the rows of a cone, not constants.
# pyright: strict, reportConstantRedefinition=false
from itertools import product

import numpy as np
from jaxtyping import Float


def sole_cone(half: tuple[float, float], friction: float) -> Float[np.ndarray, "16 6"]:
    """Give the rows C of C λ <= 0 for a rectangle that lies on a surface.

    They are what four corners carry together, each inside its friction pyramid:

        |f_x|, |f_y| ≤ μ f_z,   |m_x| ≤ Y f_z,   |m_y| ≤ X f_z
        −m_z + aY f_x + bX f_y − aμ m_x − bμ m_y ≤ μ (X + Y) f_z
         m_z + aY f_x + bX f_y + aμ m_x + bμ m_y ≤ μ (X + Y) f_z,   a, b = ±1

    Args:
        half: X and Y, half the sides of the rectangle, m.
        friction: μ of the pyramid.

    Returns:
        (16, 6) rows for λ = (f, m) about the rectangle's middle.
    """
    X, Y = half
    mu = friction
    rows = [
        *((s, 0.0, -mu, 0.0, 0.0, 0.0) for s in (1.0, -1.0)),
        *((0.0, s, -mu, 0.0, 0.0, 0.0) for s in (1.0, -1.0)),
        *((0.0, 0.0, -Y, s, 0.0, 0.0) for s in (1.0, -1.0)),
        *((0.0, 0.0, -X, 0.0, s, 0.0) for s in (1.0, -1.0)),
        *(
            (a * Y, b * X, -mu * (X + Y), -s * a * mu, -s * b * mu, -s)
            for s, a, b in product((1.0, -1.0), repeat=3)
        ),
    ]
    return np.array(rows)


def edge_cone(half: float, friction: float) -> Float[np.ndarray, "6 5"]:
    """Give the rows C of C λ <= 0 for a line that lies on a surface.

    They are what its two ends carry together, each inside its friction pyramid; the force along the line
    is whatever either of them gives, across it each has its own:

        |f_x| ≤ μ f_z,   |X f_y + m_z| ≤ μ (X f_z − m_y),   |X f_y − m_z| ≤ μ (X f_z + m_y)

    Args:
        half: X, half the length of the line, which is along x, m.
        friction: μ of the pyramid.

    Returns:
        (6, 5) rows for λ = (f, m_y, m_z) about the line's middle; it turns about x.
    """
    X, mu = half, friction
    rows = [
        *((s, 0.0, -mu, 0.0, 0.0) for s in (1.0, -1.0)),
        *((0.0, s * X, -mu * X, a * mu, s * a) for s, a in product((1.0, -1.0), repeat=2)),
    ]
    return np.array(rows)


def point_cone(friction: float) -> Float[np.ndarray, "4 3"]:
    """Give the rows C of C λ <= 0 for a point: |f_x|, |f_y| ≤ μ f_z.

    Args:
        friction: μ of the pyramid.

    Returns:
        (4, 3) rows for λ = f.
    """
    return np.array(
        [
            (1.0, 0.0, -friction),
            (-1.0, 0.0, -friction),
            (0.0, 1.0, -friction),
            (0.0, -1.0, -friction),
        ]
    )


def sole_metric(half: tuple[float, float], friction: float) -> Float[np.ndarray, " 6"]:
    """Weigh each component of a sole's force by what the cone leaves it at f_z = 1.

    Args:
        half: X and Y, half the sides, m.
        friction: μ.

    Returns:
        (6,) diagonal of R.
    """
    X, Y = half
    return np.array([friction, friction, 1.0, Y, X, friction * (X + Y)]) ** -2.0


def edge_metric(half: float, friction: float) -> Float[np.ndarray, " 5"]:
    """Weigh each component of an edge's force by what the cone leaves it at f_z = 1.

    Args:
        half: X, half the length, m.
        friction: μ.

    Returns:
        (5,) diagonal of R.
    """
    return np.array([friction, friction, 1.0, half, friction * half]) ** -2.0


def point_metric(friction: float) -> Float[np.ndarray, " 3"]:
    """Weigh each component of a point's force by what the cone leaves it at f_z = 1."""
    return np.array([friction, friction, 1.0]) ** -2.0
