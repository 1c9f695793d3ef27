"""Many cases: planned, drawn, run, and kept where nothing is lost."""
