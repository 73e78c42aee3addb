"""What a replay page shows around its scene: bars, strips, names and controls."""
