"""Conditions: what is asked of a motion, each a function at instants, in a set."""

import lazy_loader

# A motion without conditions needs none of them.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
