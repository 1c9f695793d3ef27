"""The report's diagrams, by matplotlib, from the study's tables."""
