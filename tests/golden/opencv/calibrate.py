"""Makes calibrate.json: calibrations by OpenCV of synthetic corners, and the corners themselves.

    python calibrate.py > calibrate.json        # OpenCV 4.14.0, numpy

12 views of a 10x8 board (63 inner corners, square 171/8192 m) through a lens with k1 k2 p1 p2 k3, corners with 0.2 px
of noise and some left out, rounded to 1/1024 px; float32 holds these and the
board exactly: both sides read the same numbers.
OpenCV solves three models with its own start and a termination far beyond its default.

    python calibrate.py 50 > FILE               # the same for 50 views, with the seconds that OpenCV takes by default
"""

import json
import sys
import time

import cv2
import numpy as np

SIZE = (640, 480)
FACTORY = {"fx": 565.0, "fy": 565.0, "cx": 320.5, "cy": 241.0}
TRUE_K = np.array([[532.0, 0, 318.0], [0, 532.0, 244.0], [0, 0, 1]])
TRUE_LENS = np.array([0.06, -0.09, 0.0012, -0.0009, 0.02])
SQUARE_M = 171 / 8192


def views(n_views, seed):
    random = np.random.default_rng(seed)
    board = np.array([[(i % 9 + 1) * SQUARE_M, (i // 9 + 1) * SQUARE_M, 0] for i in range(63)])
    centre = np.array([5 * SQUARE_M, 4 * SQUARE_M, 0])
    found = []
    while len(found) < n_views:
        tilt, azimuth = random.uniform(0.1, 0.8), random.uniform(0, 2 * np.pi)
        turn = cv2.Rodrigues(tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0]))[0]
        turn = turn @ cv2.Rodrigues(np.array([0, 0, random.uniform(-0.5, 0.5)]))[0]
        at = np.array([*random.uniform(-0.03, 0.03, 2), random.uniform(0.22, 0.4)])
        t = at - turn @ centre
        pixels = cv2.projectPoints(board, cv2.Rodrigues(turn)[0], t, TRUE_K, TRUE_LENS)[0][:, 0]
        pixels = np.round(1024 * (pixels + random.normal(0, 0.2, pixels.shape))) / 1024
        inside = (pixels > 2).all(1) & (pixels < np.array(SIZE) - 3).all(1) & (random.random(63) > 0.1)
        if inside.sum() >= 20:
            ids = np.nonzero(inside)[0]
            found.append((ids, board[ids].astype(np.float32), pixels[ids]))
    return found


def solve(found, flags):
    k = np.array([[FACTORY["fx"], 0, FACTORY["cx"]], [0, FACTORY["fy"], FACTORY["cy"]], [0, 0, 1]])
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 500, 1e-15)
    flags |= cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_ASPECT_RATIO
    objects = [points.astype(np.float32) for _, points, _ in found]
    pixels = [p.astype(np.float32) for _, _, p in found]
    rms, k, lens, *_ = cv2.calibrateCamera(objects, pixels, SIZE, k, np.zeros(5), flags=flags, criteria=criteria)
    lens = lens.ravel()
    return {"rms_px": rms, "fx": k[0, 0], "fy": k[1, 1], "cx": k[0, 2], "cy": k[1, 2], "k1": lens[0], "k2": lens[1], "p1": lens[2], "p2": lens[3], "k3": lens[4]}


STRAIGHT = cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST
MODELS = {"focal": STRAIGHT | cv2.CALIB_FIX_PRINCIPAL_POINT, "focal+centre": STRAIGHT, "brown": 0}


def main():
    n_views = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    found = views(n_views, seed=20261122)
    result = {
        "made_by": f"tests/golden/opencv/calibrate.py, OpenCV {cv2.__version__}",
        "square_m": SQUARE_M,
        "factory": FACTORY | {"width": SIZE[0], "height": SIZE[1]},
        "views": [[[int(i), *map(float, p)] for i, p in zip(ids, pixels)] for ids, _, pixels in found],
        "models": {name: solve(found, flags) for name, flags in MODELS.items()},
    }
    if n_views != 12:  # A timing run, not the golden file.
        result["seconds"] = {}
        for name, flags in MODELS.items():
            best = min(timed(found, flags) for _ in range(5))
            result["seconds"][name] = best
    json.dump(result, sys.stdout, separators=(",", ":"))
    print()


def timed(found, flags):
    """With OpenCV's default termination, from the same start."""
    k = np.array([[FACTORY["fx"], 0, FACTORY["cx"]], [0, FACTORY["fy"], FACTORY["cy"]], [0, 0, 1]])
    flags |= cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_ASPECT_RATIO
    objects = [points.astype(np.float32) for _, points, _ in found]
    pixels = [p.astype(np.float32) for _, _, p in found]
    start = time.perf_counter()
    cv2.calibrateCamera(objects, pixels, SIZE, k, np.zeros(5), flags=flags)
    return time.perf_counter() - start


main()
