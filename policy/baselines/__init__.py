"""Policies to compare the learnt one with."""
