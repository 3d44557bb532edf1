"""Names of entities and timelines in a recording: what writer, layout and reader agree on."""

APPLICATION = "horf"

STEP_TIMELINE = "step"
TIME_TIMELINE = "sim_time"

WORLD = "/world"
SCENE = "/world/scene"
GOAL = "/world/goal"
ROBOT = "/world/robot"
CAMERA = "/world/robot/base_link/camera"
DEPTH = "/world/robot/base_link/camera/depth"
CLOUD = "/world/cloud"
BASE_PATH = "/world/path/base"
EE_PATH = "/world/path/end_effector"
EE = "/world/end_effector"

CLEARANCE = "/clearance"
BODY_DISTANCES = "/body_distances"
LINEAR_TWIST = "/twist/linear"
ANGULAR_TWIST = "/twist/angular"
REWARD = "/reward"
QP_SLACK = "/qp/slack"
QP_TIME = "/qp/solve_time"

EPISODE_PROPERTIES = "episode"
