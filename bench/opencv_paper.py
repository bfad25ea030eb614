"""The paper's whole job with OpenCV 4.5.5: calibrate from a recording, then compare its depth with the board.

    python opencv_paper.py RECORDING...

Written after arXiv:2201.10865, sections 4.2 and 5.1, not copied from its code. Needs opencv-contrib-python 4.5.5.64:
from 4.6 on the old board layout has to be asked for, and `calibrateCameraCharuco` is gone later.

Each image is decoded and searched once and serves both halves; the published code does it twice. That makes this
rival faster than the original. Holes in the depth map are left out, not interpolated across.

Prints one JSON object per recording, with the seconds spent after the imports.
"""

import ast
import glob
import json
import os
import sys
import time

import cv2
import numpy as np

SQUARES = (10, 8)
SQUARE_M = 0.020875
MARKER_M = SQUARE_M / 2
MIN_CORNERS = 9
GRID_M = 0.04
MAX_ERROR_M = 0.02
DEPTH_UNIT_M = 1e-4

DICTIONARY = cv2.aruco.Dictionary_get(cv2.aruco.DICT_ARUCO_ORIGINAL)
PARAMETERS = cv2.aruco.DetectorParameters_create()
BOARD = cv2.aruco.CharucoBoard_create(*SQUARES, SQUARE_M, MARKER_M, DICTIONARY)
SUBPIX = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 0.001)

FLAGS = (
    cv2.CALIB_USE_INTRINSIC_GUESS
    | cv2.CALIB_FIX_ASPECT_RATIO
    | cv2.CALIB_FIX_PRINCIPAL_POINT
    | cv2.CALIB_FIX_TANGENT_DIST
    | cv2.CALIB_FIX_K1
    | cv2.CALIB_FIX_K2
    | cv2.CALIB_FIX_K3
)


def factory_matrix(recording):
    with open(os.path.join(recording, "DepthMetadata.json")) as file:
        metadata = json.load(file)[0]
    return np.array([ast.literal_eval(metadata[f"IntrinsicMatrix.{row}"]) for row in range(3)])


def detect(gray, camera):
    corners, ids, _ = cv2.aruco.detectMarkers(gray, DICTIONARY, parameters=PARAMETERS)
    if len(corners) == 0:
        return None, None
    for corner in corners:
        cv2.cornerSubPix(gray, corner, (3, 3), (-1, -1), SUBPIX)
    n, pixels, ids = cv2.aruco.interpolateCornersCharuco(
        corners, ids, gray, BOARD, cameraMatrix=camera, minMarkers=1
    )
    return (pixels, ids) if n >= MIN_CORNERS else (None, None)


def pose(pixels, ids, camera):
    ok, rotation, translation = cv2.solvePnP(
        BOARD.chessboardCorners[ids], pixels, camera, None, flags=cv2.SOLVEPNP_ITERATIVE
    )
    return cv2.Rodrigues(rotation)[0], translation


def bilinear(depth, pixels):
    """Depth at the pixels, NaN wherever one of the four neighbours is a hole."""
    x, y = pixels[:, 0, 0], pixels[:, 0, 1]
    height, width = depth.shape
    x0 = np.clip(np.floor(x).astype(int), 0, width - 2)
    y0 = np.clip(np.floor(y).astype(int), 0, height - 2)
    fx, fy = x - x0, y - y0
    return (
        depth[y0, x0] * (1 - fx) * (1 - fy)
        + depth[y0, x0 + 1] * fx * (1 - fy)
        + depth[y0 + 1, x0] * (1 - fx) * fy
        + depth[y0 + 1, x0 + 1] * fx * fy
    )


def median_error_mm(views, camera):
    """Mean over the frames of the median of board depth minus sensor depth; None where no depth comes near."""
    medians = []
    for pixels, ids, depth in views:
        rotation, translation = pose(pixels, ids, camera)
        board = (rotation @ BOARD.chessboardCorners[ids].reshape(-1, 3).T + translation)[2]
        error = board - bilinear(depth, pixels)
        error = error[np.abs(error) <= MAX_ERROR_M]
        if len(error):
            medians.append(np.median(error))
    return 1e3 * float(np.mean(medians)) if medians else None


def job(recording):
    start = time.perf_counter()
    factory = factory_matrix(recording)
    views, chosen, centers = [], [], []
    images = glob.glob(os.path.join(recording, "rgb_*.png"))
    for path in sorted(images, key=lambda name: int(name.split("_")[-1][:-4])):
        gray = cv2.imread(path, cv2.IMREAD_GRAYSCALE)
        pixels, ids = detect(gray, factory)
        if pixels is None:
            continue
        codes = cv2.imread(path.replace("rgb_", "depth_"), cv2.IMREAD_UNCHANGED)
        depth = np.where(codes == 0, np.nan, codes * DEPTH_UNIT_M)
        views.append((pixels, ids, depth))
        rotation, translation = pose(pixels, ids, factory)
        center = -rotation.T @ translation
        if all(np.linalg.norm(center - other) >= GRID_M for other in centers):
            centers.append(center)
            chosen.append((pixels, ids))
    rms, own, *_ = cv2.aruco.calibrateCameraCharuco(
        [pixels for pixels, _ in chosen],
        [ids for _, ids in chosen],
        BOARD,
        gray.shape[::-1],
        factory.copy(),
        np.zeros(5),
        None,
        None,
        FLAGS,
    )
    result = {
        "recording": os.path.basename(os.path.normpath(recording)),
        "opencv": cv2.__version__,
        "n_images": len(images),
        "factory_focal_px": factory[0, 0],
        "focal_px": own[0, 0],
        "rms_px": rms,
        "n_views": len(chosen),
        "n_corners": sum(len(ids) for _, ids in chosen),
        "factory_median_error_mm": median_error_mm(views, factory),
        "own_median_error_mm": median_error_mm(views, own),
    }
    result["seconds"] = time.perf_counter() - start
    return result


if __name__ == "__main__":
    for recording in sys.argv[1:]:
        print(json.dumps(job(recording)))
