"""Parametric families: each function shapes and paints one kind of object.

A family is a pure function of its parameters (dimensions, colours, printed words, `seed`): the
same parameters give the same bytes. Lengths are in metres.
"""
