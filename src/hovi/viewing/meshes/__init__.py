"""Meshes as pages draw them: few triangles, near the original ones."""
