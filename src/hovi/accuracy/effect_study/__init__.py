"""Which effect matters on a scene, and what it costs."""
