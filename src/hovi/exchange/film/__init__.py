"""Films of a motion: pictures by a browser or by matplotlib, as video and as GIF."""
