"""Simulated RGB-D cameras: offscreen rendering, and the noise of an Intel RealSense L515."""
