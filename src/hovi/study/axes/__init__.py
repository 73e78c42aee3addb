"""What varies: lists, grids, tables, samples, configurations and poses."""
