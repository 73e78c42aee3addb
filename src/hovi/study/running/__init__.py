"""Running a study: chunks of cells for worker processes, on one machine or several."""
