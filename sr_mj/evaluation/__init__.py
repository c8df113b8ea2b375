"""From a policy to the numbers of the evaluation protocol.

`plan` lists the episodes, `worker` runs one, `pool` runs many, `results` keeps them, and `report`
turns what was kept into tables, charts and pages.
"""
