"""Perception: depth camera, frame stack and point cloud of the last frames."""

from horf_env.perception.camera import CameraModel
from horf_env.perception.cloud import CloudHistory, remove_floor, unproject
from horf_env.perception.depth_camera import DepthCamera
from horf_env.perception.far_view import FarView
from horf_env.perception.frame_memory import FrameSettings
from horf_env.perception.frames import FrameStack, coarser, dequantise_depth, quantise_depth
from horf_env.perception.goal_space import goal_space
from horf_env.perception.guide import GUIDE_SIZE, Guide
from horf_env.perception.image import Image
from horf_env.perception.local_map import MapSettings
from horf_env.perception.memory import MemorySettings, ObstacleMemory, View
from horf_env.perception.noise import DisparityNoise
from horf_env.perception.top_view import CELLS, CHANNELS, top_view
from horf_env.perception.ways import GroundPlan, SeenSpace

__all__ = [
    "CELLS",
    "CHANNELS",
    "GUIDE_SIZE",
    "CameraModel",
    "CloudHistory",
    "DepthCamera",
    "DisparityNoise",
    "FarView",
    "FrameSettings",
    "FrameStack",
    "GroundPlan",
    "Guide",
    "Image",
    "MapSettings",
    "MemorySettings",
    "ObstacleMemory",
    "SeenSpace",
    "View",
    "coarser",
    "dequantise_depth",
    "goal_space",
    "quantise_depth",
    "remove_floor",
    "top_view",
    "unproject",
]
