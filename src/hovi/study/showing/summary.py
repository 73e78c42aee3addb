"""The numbers of a study: how many plans ended how, and what they cost and took."""

from __future__ import annotations

from typing import Any

import numpy as np

from hovi.study.showing.plans import Plans

QUANTILES = (0.0, 0.25, 0.5, 0.75, 1.0)
SHOWN = ("cost", "error_estimate", "nit", "margin", "least_distance", "seconds")
"""The columns of which quantiles are reported."""


def summary(plans: Plans) -> dict[str, Any]:
    """JSON-compatible data: counts by status and caution, quantiles of columns of minima.

    finished: as of Plans.
    """
    success = plans.success
    quantiles = {}
    for name in SHOWN:
        values = plans.numbers(name)[success]
        values = values[np.isfinite(values)]
        if len(values):
            quantiles[name] = [float(x) for x in np.quantile(values, QUANTILES)]
    return {
        "plans": len(plans),
        "finished": plans.finished,
        "success": int(success.sum()),
        "status": plans.by_status(),
        "cautions": plans.by_caution(),
        "parameters": list(plans.parameters),
        "quantiles": quantiles,
        "seconds": float(np.nansum(plans.numbers("seconds"))),
        "irreproducible": int(len(plans) - sum(plans.columns["reproducible"])),
        "worst": [_worst(plans, row) for row in plans.worst(10)],
    }


def _worst(plans: Plans, row: int) -> dict[str, Any]:
    own = {name: plans.columns[name][row] for name in plans.varying or plans.parameters}
    names = ("cell", "key", "cost")
    return {name: plans.columns[name][row] for name in names} | {"parameters": own}
