"""Export of motions to file formats of other programs."""
