"""MJCF models: UR5, gripper, table and bin, cameras, and the catalogue of everyday objects.

Everything here is geometry and physics as data; no rendering, planning or perception.
"""
