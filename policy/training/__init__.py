"""Training of networks from demonstrations; `python -m policy.train` is its command line."""
