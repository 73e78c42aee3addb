"""hovi: higher-order variational integrators for planning and replaying robot motion."""

import lazy_loader

from hovi.discrete.output.exporter import register_exporter

# A public name is imported when it is first used, so that `hovi --version` answers at once.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
register_exporter(lambda: __getattr__("export"))
