"""The public names of hovi.effects: read by type checkers, and by `lazy_loader`."""

from .armature import Armature as Armature
from .casadi_cost import CasadiCost as CasadiCost
from .custom import Custom as Custom
from .drag import Drag as Drag
from .dry_friction import DryFriction as DryFriction
from .effect import Effect as Effect
from .effect import Touch as Touch
from .effort_weight import EffortWeight as EffortWeight
from .expressions.symbols import SceneSymbols as SceneSymbols
from .gravity import Gravity as Gravity
from .joint_limit_potential import JointLimitPotential as JointLimitPotential
from .joint_springs import JointSprings as JointSprings
from .motion_cost import AccelerationCost as AccelerationCost
from .motion_cost import JerkCost as JerkCost
from .motion_cost import VelocityCost as VelocityCost
from .moving_base import MovingBase as MovingBase
from .payload import Payload as Payload
from .power_cost import PowerCost as PowerCost
from .reference_cost import ReferenceCost as ReferenceCost
from .registration import REGISTRY as REGISTRY
from .registration import register as register
from .running_cost import RunningCost as RunningCost
from .viscous_friction import ViscousFriction as ViscousFriction
from .wrench import Wrench as Wrench
