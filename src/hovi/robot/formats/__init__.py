"""Robots in other formats than URDF, where the user names their file or their package."""
