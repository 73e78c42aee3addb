"""The configuration space: groups that joints move on, charts, derivatives in the tangent space."""
