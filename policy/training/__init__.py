"""Training of the SR network from demonstrations; `python -m policy.train` is its command line."""
