"""Dimensions of the parallel gripper, as data for the MJCF builder and for collision checks.

The figures follow the public data sheet of the Robotiq 2F-85 (stroke 85 mm, fingertip pad 22 mm
wide, overall length about 163 mm with the fingers closed, grip force 20 to 235 N, mass 0.9 kg;
https://robotiq.com/products/2f85-140-adaptive-robot-gripper, "Specifications"). The real fingers
move on a four-bar linkage; ours slide in parallel, which keeps the pads parallel as the real
linkage does over its main stroke and needs no closed kinematic chain.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class GripperGeometry:
    """Boxes that bound the gripper, in the tool frame.

    The tool frame has its origin midway between the centres of the finger pads, x along the
    closing direction, z along the approach direction (towards the object).

    Attributes:
        max_width_m: Largest distance between the two pads.
        flange_to_tool_m: Distance from the robot's tool flange to the tool centre point.
        pad_half_m: Half extents (y, z) of a pad.
        finger_thickness_m: Thickness of a finger, pad included, along x.
        tip_below_tool_m: How far the fingertips reach beyond the tool centre point along +z.
        palm_above_tool_m: Distance from the palm's front face back to the tool centre point.
        palm_half_m: Half extents (x, y) of the palm block.
        palm_depth_m: Extent of the palm block along z.
    """

    max_width_m: float = 0.085
    flange_to_tool_m: float = 0.145
    pad_half_m: tuple[float, float] = (0.011, 0.01875)
    finger_thickness_m: float = 0.014
    tip_below_tool_m: float = 0.0178
    palm_above_tool_m: float = 0.050
    palm_half_m: tuple[float, float] = (0.062, 0.032)
    palm_depth_m: float = 0.095

    def boxes(self, width_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Bound the gripper by three boxes at a given opening.

        Args:
            width_m: Distance between the pads in metres, 0 to `max_width_m`.

        Returns:
            Centres (3, 3) and half extents (3, 3) in the tool frame, in metres; rows are the
            finger at negative x, the finger at positive x, and the palm.
        """
        finger_x = width_m / 2 + self.finger_thickness_m / 2
        finger_z = (self.tip_below_tool_m - self.palm_above_tool_m) / 2
        finger_half = (
            self.finger_thickness_m / 2,
            self.pad_half_m[0],
            (self.tip_below_tool_m + self.palm_above_tool_m) / 2,
        )
        palm_z = -self.palm_above_tool_m - self.palm_depth_m / 2
        centers = np.array([[-finger_x, 0, finger_z], [finger_x, 0, finger_z], [0, 0, palm_z]])
        halves = np.array([finger_half, finger_half, (*self.palm_half_m, self.palm_depth_m / 2)])
        return centers, halves


ROBOTIQ_2F85_CLASS = GripperGeometry()
