"""Endless variants of the families: recipes that draw parameters, and the rule what is new enough.

Use it through `models.objects.families.sample`.
"""
