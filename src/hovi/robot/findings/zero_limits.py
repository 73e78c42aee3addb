"""Limits of velocity and effort that are 0: they count as none."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hovi.errors import some_of
from hovi.robot.findings.finding import PYTHON, Finding, Line, Severity
from hovi.robot.findings.limit_lines import EFFORT, SPEED, limit_line
from hovi.robot.findings.subject import Subject


def zero_limits(subject: Subject) -> Iterator[Finding]:
    """One finding about velocities, and one about efforts."""
    model = subject.model
    for what, limit, key, example in (
        ("velocity", model.velocityLimit, "v", SPEED),
        ("effort", model.effortLimit, "tau", EFFORT),
    ):
        at = np.flatnonzero(np.asarray(limit) == 0.0)
        pairs = [(name, joint) for name, joint in subject.joints.items() if joint.nv]
        names = [name for name, joint in pairs if np.any((at - joint.idx_v) // joint.nv == 0)]
        if not names:
            continue
        whole = len(names) == len(pairs) > 3
        yield Finding(
            Severity.MISLEADS,
            f"zero-{what}",
            tuple(names),
            f"the {what} limit is 0 at {f'all {len(names)} joints' if whole else some_of(names)}, "
            "which counts as none",
            tuple(
                limit_line(subject, name)
                if name in subject.elements
                else Line(PYTHON, f'limits={{"{key}": {{{name!r}: {example}}}}}')
                for name in names
            ),
        )
