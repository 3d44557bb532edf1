"""Array types and the conventions behind them, stated once.

Configuration: (x, y, theta, q1..q7) in m and rad; shape (10,).
Velocity: (v, omega, qd1..qd7), forward and turning speed of the base and arm joints, in m/s and
rad/s; shape (9,).
Twist: (linear, angular) velocity of the end effector in the axes of the mobile base, in m/s and
rad/s; shape (6,).
Pose: homogeneous transform T_a_b, which maps points of frame b to frame a; shape (4, 4).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

N_BASE_VELOCITIES = 2
N_ARM_JOINTS = 7
N_VELOCITIES = N_BASE_VELOCITIES + N_ARM_JOINTS
N_CONFIGURATION = 3 + N_ARM_JOINTS
