#!/usr/bin/env bash
# Proves that perception stands alone: installs the project without its simulator into a fresh
# environment, lifts a synthetic scene with `python -m perception.lift`, and makes sure that neither
# simulator nor planner can be imported there. Takes minutes and some 7 GB in TMPDIR, which it
# gives back. Prints "perception stands alone" and ends with 0 if all is well.
set -euo pipefail
cd "$(dirname "$0")/.."
project=$PWD
python=${PYTHON3:-.venv/bin/python}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

say() { printf 'check: %s\n' "$*" >&2; }

say "installing sr-mj[perception] into a fresh environment"
"$python" -m venv "$work/venv"
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-cache-dir \
  -c constraints.txt "$project[perception]"
# From here on outside of the checkout: only what was installed counts.
cd "$work"
cat >make_views.py <<'PYTHON'
"""A red ball and a green box on a table, seen from two sides by ray casting."""

import numpy as np
import open3d as o3d

from perception import CameraView, Intrinsics, save_views

K = Intrinsics(fx=500.0, fy=500.0, cx=320.0, cy=240.0, width=640, height=480)
COLORS = np.array([[120, 110, 100], [200, 30, 30], [30, 160, 60]], np.uint8)
scene = o3d.t.geometry.RaycastingScene()
for mesh, shift in (
    (o3d.geometry.TriangleMesh.create_box(2.0, 2.0, 0.02), (-1.0, -1.0, -0.02)),
    (o3d.geometry.TriangleMesh.create_sphere(0.05, 60), (0.0, 0.1, 0.05)),
    (o3d.geometry.TriangleMesh.create_box(0.08, 0.08, 0.1), (0.0, -0.15, 0.0)),
):
    scene.add_triangles(o3d.t.geometry.TriangleMesh.from_legacy(mesh.translate(shift)))


def look(name: str, position: tuple[float, float, float]) -> CameraView:
    forward = -np.array(position) / np.linalg.norm(position)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    T = np.eye(4)
    T[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    T[:3, 3] = position
    u, v = np.meshgrid(np.arange(K.width), np.arange(K.height))
    rays = np.stack([(u - K.cx) / K.fx, (v - K.cy) / K.fy, np.ones(u.shape)], axis=-1)
    rays = np.concatenate([np.broadcast_to(T[:3, 3], rays.shape), rays @ T[:3, :3].T], axis=-1)
    hits = scene.cast_rays(o3d.core.Tensor(rays.astype(np.float32)))
    depth = hits["t_hit"].numpy()
    is_hit = np.isfinite(depth)
    ids = np.where(is_hit, hits["geometry_ids"].numpy(), 0)
    depth_m = np.where(is_hit, depth, 0).astype(np.float32)
    return CameraView(
        name=name, rgb=COLORS[ids], depth_m=depth_m, intrinsics=K, T_world_cam_cv=T
    )


save_views([look("left", (0.4, 0.3, 0.4)), look("right", (0.4, -0.3, 0.4))], "views")
PYTHON
"$work/venv/bin/python" make_views.py
say "lifting"
"$work/venv/bin/python" -m perception.lift views --text "a red ball" "a green box" --out result \
  2>stderr.txt
cat stderr.txt >&2
[ ! -s stderr.txt ] || { say "the command wrote to stderr"; exit 1; }
for file in cloud.npz summary.json red_ball.ply red_ball_left.png green_box_right.png; do
  [ -s "result/$file" ] || { say "no $file was written"; exit 1; }
done
"$work/venv/bin/python" - "$project" <<'PYTHON'
import importlib.util
import sys
from pathlib import Path

import perception

assert Path(sys.argv[1]) not in Path(perception.__file__).parents, "the checkout was imported"
absent = ("mujoco", "dm_control", "mink", "daqp", "imageio", "trimesh", "lxml", "manifold3d")
present = [name for name in absent if importlib.util.find_spec(name)]
assert not present, f"installed with sr-mj[perception]: {', '.join(present)}"
PYTHON
say "perception stands alone ($(du -sh --apparent-size venv | cut -f1) installed)"
