"""Studies: many plans of one scene with fields that vary, their tables and their pictures."""
