"""What a study shows: summaries, histograms, maps and the worst motions."""
