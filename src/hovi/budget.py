"""What is left of a solve's budget."""

from __future__ import annotations

import dataclasses
import time

from hovi.optimize.trust_region import Options


class Deadline:
    """The steps and the time of a solve, shared by its rounds.

    options: the budgets of the whole solve, which starts now.
    """

    def __init__(self, options: Options) -> None:
        self.options = options
        limit = options.time_limit
        self.ends = None if limit is None else time.monotonic() + limit

    def left(self, steps_done: int, decrease: float | None = None) -> Options:
        """Options for what is left.

        steps_done: steps that are used up. decrease: where another tolerance is wanted.
        """
        left = None if self.ends is None else max(self.ends - time.monotonic(), 0.0)
        return dataclasses.replace(
            self.options,
            time_limit=left,
            max_iterations=max(self.options.max_iterations - steps_done, 0),
            decrease=self.options.decrease if decrease is None else decrease,
        )
