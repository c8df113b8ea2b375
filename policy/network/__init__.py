"""The SR network: two-stage alignment of language, vision and action."""
