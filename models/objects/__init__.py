"""Everyday objects made by code: parametric shapes, painted textures, convex collision parts.

`models.objects.catalogue` lists, describes and loads them; `models.objects.mjcf_builder` turns one
into an MJCF tree. Importing this package alone builds nothing.
"""
