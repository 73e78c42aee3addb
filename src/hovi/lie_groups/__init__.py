"""The groups that joints move on and charts of them, by C++ over batches."""

from hovi.lie_groups.compiled_charts import CompiledCharts, local_rates, rates
from hovi.lie_groups.groups import (
    GROUPS,
    SE2,
    SE3,
    SO2,
    SO3,
    Group,
    Layout,
    differenced,
    integrated,
)

__all__ = [
    "GROUPS",
    "SE2",
    "SE3",
    "SO2",
    "SO3",
    "CompiledCharts",
    "Group",
    "Layout",
    "differenced",
    "integrated",
    "local_rates",
    "rates",
]
