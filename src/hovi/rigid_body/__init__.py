"""Rigid-body dynamics: Pinocchio's algorithms as CasADi functions and as a fast batch kernel."""

from hovi.rigid_body.extension import BuildMismatchError
from hovi.rigid_body.functions import RigidBodyFunctions, casadi_functions
from hovi.rigid_body.kernel import InverseDynamicsKernel, joints_without_kernel

__all__ = [
    "BuildMismatchError",
    "InverseDynamicsKernel",
    "RigidBodyFunctions",
    "casadi_functions",
    "joints_without_kernel",
]
