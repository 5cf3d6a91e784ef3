"""State space of a linear system."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._flexarm import Linear


def state_space(linear: Linear) -> tuple[NDArray[np.float64], ...]:
    """Returns A, B, C, D of a :class:`Linear`; see :meth:`Linear.state_space`."""
    k, n = linear.M_a.shape
    size = k + n
    forces = np.hstack([-linear.K, -linear.K_a, -linear.D, -linear.D_a, -linear.M_a, linear.J.T])
    accelerations = np.linalg.solve(linear.M, forces) if k else forces
    A, B = np.zeros((2 * size, 2 * size)), np.zeros((2 * size, n + 6))
    A[:size, size:] = np.eye(size)
    A[size : size + k] = accelerations[:, : 2 * size]
    B[size : size + k] = accelerations[:, 2 * size :]
    B[size + k :, :n] = np.eye(n)
    C = np.hstack([linear.J, linear.J_a, np.zeros((6, size))])
    return A, B, C, np.zeros((6, n + 6))
