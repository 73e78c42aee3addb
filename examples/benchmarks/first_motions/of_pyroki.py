"""The motion of `task.py` by pyroki: least squares on a grid."""

import jax
import jax.numpy as jnp
import jaxlie
import jaxls
import pyroki as pk
import yourdfpy
from task import GOAL, HOME, URDF, T

arm = pk.Robot.from_urdf(yourdfpy.URDF.load(URDF))
count = 61
dt, var, tool = T / (count - 1), arm.joint_var_cls, arm.links.names.index("tool")
many = jax.tree.map(lambda x: x[None], arm)
every, later, sooner = (var(jnp.arange(*k)) for k in ((0, count), (1, count), (0, count - 1)))
point = jaxlie.SE3.from_translation(jnp.array(GOAL))
held = jaxls.Cost(lambda values, each: (values[each] - jnp.array(HOME)) * 100.0, (var(0),))
stops = [(0, 1), (count - 2, count - 1)]
costs = [
    held,
    *(jaxls.Cost(lambda x, a, b: (x[a] - x[b]) * 100.0, (var(i), var(j))) for i, j in stops),
    pk.costs.pose_cost(arm, var(count - 1), point, jnp.array(tool), 100.0, 0.0),
    pk.costs.limit_cost(many, every, jnp.array([100.0])),
    pk.costs.limit_velocity_cost(many, later, sooner, dt, jnp.array([10.0])),
    pk.costs.smoothness_cost(later, sooner, jnp.array([0.1])),
]
problem = jaxls.LeastSquaresProblem(costs, [every]).analyze()
guess = jaxls.VarValues.make([every.with_value(jnp.tile(jnp.array(HOME), (count, 1)))])
found = problem.solve(initial_vals=guess, verbose=False, linear_solver="dense_cholesky")
t, q = dt * jnp.arange(count), found[every]
