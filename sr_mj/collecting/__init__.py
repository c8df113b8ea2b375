"""Collecting demonstrations: scenes, goals, the expert's decisions, workers, folders."""
