"""Reference tools as methods of a work-precision diagram."""
