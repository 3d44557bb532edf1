"""Scenes: what they are, where they come from, and their geometry for sensors and checks."""

from horf_env.scenes.distance import obstacle_distance
from horf_env.scenes.families import SCENES
from horf_env.scenes.instances import (
    planner_path_length,
    test_instance,
    training_instance,
    validation_instance,
)
from horf_env.scenes.scene import Box, Cylinder, Goal, Scene, Sphere, Start, load_scene
from horf_env.scenes.scene_mesh import triangles
from horf_env.scenes.surface_points import surface_points

__all__ = [
    "SCENES",
    "Box",
    "Cylinder",
    "Goal",
    "Scene",
    "Sphere",
    "Start",
    "load_scene",
    "obstacle_distance",
    "planner_path_length",
    "surface_points",
    "test_instance",
    "training_instance",
    "triangles",
    "validation_instance",
]
