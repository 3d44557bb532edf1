"""Whole-body motion of a mobile manipulator as a Gymnasium environment.

Importing this package registers "horf/Reach-v0".
"""

from gymnasium.envs.registration import register

from horf_env.task import MAX_STEPS

register(
    id="horf/Reach-v0",
    entry_point="horf_env.env:HorfReachEnv",
    max_episode_steps=MAX_STEPS,
)
