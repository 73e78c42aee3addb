"""Methods: how a program, an objective with bounds and equations, is minimised."""

import lazy_loader

# A motion that is planned needs none of them.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
