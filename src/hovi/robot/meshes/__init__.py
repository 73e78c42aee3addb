"""Triangles of mesh files, read without any foreign library."""
