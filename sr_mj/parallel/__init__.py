"""Many independent pieces of work: in processes of this machine, or on a Ray cluster.

Both take the same three functions: one that makes what does a piece of work in a fresh process, one
that hands out the next piece, and one that says what comes of a piece whose process always dies.
"""
