"""A servo-controlled flexible arm behind ``step(targets)``, as in Gymnasium and MuJoCo, at 1 kHz.

Prints the real-time factor. ``reset`` and ``step`` return what those of ``gymnasium.Env`` do;
Gymnasium is not required.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

import flexarm

Floats = NDArray[np.float64]


class FlexibleArmEnv:
    """Reach a position of the TCP with a flexible arm.

    The action is the joint targets of the next millisecond (rad); the observation is joint
    positions, velocities, and TCP position minus goal (m); the reward is minus the distance to the
    goal (m).
    """

    def __init__(self, robot: str = "reference_arm", period: float = 1e-3) -> None:
        self.arm = flexarm.load(robot).flexible(drives="servo")
        self.home = np.array([0.0, -0.9, 0.9, 0.0, 0.4, 0.0])
        self.live = self.arm.live(self.home, period=period, step=period)
        self.goal: Floats = self.live.target_pose[:3, 3]

    def reset(self, *, seed: int | None = None) -> tuple[Floats, dict[str, Any]]:
        """Rest at home; the goal is the TCP position of a nearby pose."""
        nearby = self.home + np.random.default_rng(seed).uniform(-0.1, 0.1, self.home.size)
        self.goal = self.arm.robot.model.fk(nearby)[:3, 3]
        self.live.reset(self.home)
        return self._observation(), {"pose": nearby}

    def step(self, targets: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Command the joints for one control period."""
        self.live.step(targets)
        observation = self._observation()
        distance = float(np.linalg.norm(observation[-3:]))
        return observation, -distance, False, self.live.time > 10.0, {"distance": distance}

    def _observation(self) -> Floats:
        away = self.live.tcp_pose[:3, 3] - self.goal
        return np.concatenate([self.live.position, self.live.velocity, away])


def main(seconds: float = 2.0) -> None:
    env = FlexibleArmEnv()
    _, info = env.reset(seed=1)
    start, end = env.home, info["pose"]
    steps = round(seconds / env.live.period)
    distance = np.zeros(steps)
    begin = time.perf_counter()
    for k in range(steps):
        # Half a second to the goal, smoothly; then the arm rings and settles.
        s = min(1.0, (k + 1) * env.live.period / 0.5)
        targets = start + (end - start) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
        _, _, _, _, info = env.step(targets)
        distance[k] = info["distance"]
    spent = time.perf_counter() - begin
    print(f"{steps} steps at {1 / env.live.period:.0f} Hz: {seconds / spent:.1f} times real time")
    print(f"distance from the goal: {1e3 * distance[-1]:.2f} mm at the end, {1e3 * distance[round(0.5 / env.live.period)]:.2f} mm when the motion ends")


if __name__ == "__main__":
    main()
