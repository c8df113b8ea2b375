"""Policies that need no training, to compare the learnt one with."""
