"""The public names of hovi.conditions: read by type checkers, and by `lazy_loader`."""

from .kept.follow import Follow as Follow
from .kept.keep import EndPoses as EndPoses
from .kept.keep import Keep as Keep
from .kept.keep import Pose as Pose
from .kept.keep_orientation import KeepOrientation as KeepOrientation
from .kept.keep_pose import KeepPose as KeepPose
from .kept.on_line import OnLine as OnLine
from .kept.on_plane import OnPlane as OnPlane
from .kept.row import CasadiRow as CasadiRow
from .kept.row import Formula as Formula
from .kept.together import Together as Together
from .kept.tool_speed import ToolAcceleration as ToolAcceleration
from .kept.tool_speed import ToolSpeed as ToolSpeed
from .kept.upright import Upright as Upright
