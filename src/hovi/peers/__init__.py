"""Other people's methods, for the same picture as hovi's: see hovi.accuracy."""
