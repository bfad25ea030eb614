"""Makes mrcal.json: the covariance and the projection uncertainty that mrcal finds for the corners of
../opencv/calibrate.json, in its model LENSMODEL_OPENCV5 (fx fy cx cy k1 k2 p1 p2 k3).

    /usr/bin/python3 mrcal_uncertainty.py > mrcal.json      # Debian's python3-mrcal 2.2

All corners alike, no outliers left out, no regularisation, a flat board: what `Method::Plain(Model::BrownAspect)` does.
σ are for corner noise of 1 px per coordinate.
"""
import json
from pathlib import Path

import cv2
import mrcal
import numpy as np

golden = json.loads((Path(__file__).parent / "../opencv/calibrate.json").read_text())
views, square, factory = golden["views"], golden["square_m"], golden["factory"]
# ids run along rows of 9; mrcal's object is a grid of (rows, columns) with its own origin at the first corner.
observations = np.zeros((len(views), 7, 9, 3))
observations[..., 2] = -1  # not seen
for view, corners in zip(observations, views):
    for i, x, y in corners:
        view[i // 9, i % 9] = [x, y, 1]
indices = np.array([[i, 0, -1] for i in range(len(views))], dtype=np.int32)
intrinsics = np.array([[factory["fx"], factory["fy"], factory["cx"], factory["cy"], 0, 0, 0, 0, 0.0]])
frames = []
for view in observations:
    seen = view[..., 2] > 0
    rows, columns = np.nonzero(seen)
    points = np.stack([columns * square, rows * square, 0 * rows], 1).astype(float)
    k = np.array([[factory["fx"], 0, factory["cx"]], [0, factory["fy"], factory["cy"]], [0, 0, 1]])
    _, r, t = cv2.solvePnP(points, view[seen][:, :2].copy(), k, np.zeros(5))
    frames.append(np.r_[r.ravel(), t.ravel()])
inputs = dict(
    lensmodel="LENSMODEL_OPENCV5",
    intrinsics=intrinsics,
    extrinsics_rt_fromref=np.zeros((0, 6)),
    frames_rt_toref=np.array(frames),
    points=None,
    observations_board=observations,
    indices_frame_camintrinsics_camextrinsics=indices,
    observations_point=None,
    indices_point_camintrinsics_camextrinsics=None,
    imagersizes=np.array([[640, 480]], dtype=np.int32),
    calibration_object_spacing=square,
    calobject_warp=None,
    do_optimize_intrinsics_core=True,
    do_optimize_intrinsics_distortions=True,
    do_optimize_extrinsics=True,
    do_optimize_frames=True,
    do_optimize_calobject_warp=False,
    do_apply_outlier_rejection=False,
    do_apply_regularization=False,
    verbose=False,
)
for _ in range(6):
    mrcal.optimize(**inputs)
model = mrcal.cameramodel(optimization_inputs=inputs, icam_intrinsics=0)
_, _, jacobian, factorization = mrcal.optimizer_callback(**inputs)
n = jacobian.shape[1]
scale = np.ones(n)
mrcal.unpack_state(scale, **inputs)
columns = factorization.solve_xt_JtJ_bt(np.eye(9, n))
covariance = columns[:, :9] * scale[:9, None] * scale[None, :9]
n_columns, n_rows, depth = 5, 4, 0.3
grid = []
for v in np.linspace(0, 479, n_rows):
    for u in np.linspace(0, 639, n_columns):
        ray = mrcal.unproject(np.array([u, v]), *model.intrinsics())
        p = ray * depth / ray[2]
        what = dict(what="worstdirection-stdev", observed_pixel_uncertainty=1.0)
        grid.append(float(mrcal.projection_uncertainty(p, model, **what)))
print(json.dumps({
    "intrinsics": [float(f) for f in inputs["intrinsics"][0]],
    "sigma_per_px": [float(s) for s in np.sqrt(np.diag(covariance))],
    "grid": {"columns": n_columns, "rows": n_rows, "depth_m": depth, "sigma_px_per_px": grid},
}))
