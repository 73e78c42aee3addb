"""Effects: opt-in physics and costs of a scene beyond rigid-body inertia, one file each."""

import lazy_loader

# A scene without effects needs none of them; `hovi.effects.registration` has the list.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
