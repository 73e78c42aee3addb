"""hovi: higher-order variational integrators for planning and replaying robot motion."""

from typing import Any

import lazy_loader

from hovi.discrete.output.exporter import register_exporter

# A public name is imported when it is first used, so that `hovi --version` answers at once.
_public, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
_ELSEWHERE = {
    "load": "hovi.Trajectory.load(file) for a motion, hovi.load_task(file) for a scene file, "
    "hovi.load_robot(file) for a robot",
    "save": "solution.save(file) or trajectory.save(file)",
    "replan": "solution.replan(...), or hovi.plan(..., guess=motion) from a motion that was loaded",
    "advance": "solution.advance(...)",
}


def __getattr__(name: str) -> Any:
    """A public name; AttributeError for others, with what to use instead of some."""
    if name in _ELSEWHERE:
        raise AttributeError(f"hovi has no {name!r}: use {_ELSEWHERE[name]}.")
    return _public(name)


register_exporter(lambda: _public("export"))
