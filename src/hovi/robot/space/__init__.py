"""The configuration space: Lie groups of the joints, charts, tangent-space derivatives."""
