#!/usr/bin/env python3
"""Reprojection RMS of a full-model calibration, with OpenCV's corners and with truedepth's, on the corners both find.

    python3 bench/reprojection.py ROOT          (a Python with opencv-contrib-python >= 4.6, below 5)

ROOT holds the published recordings (zeiss/FrontCamCalibrationDataset). Both sets of corners are given to the same
cv2.calibrateCamera (k1 k2 p1 p2 k3 free); only frames with at least 12 common corners, only the common corners.
Expects target/release/truedepth.
"""

import json
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np

TRUEDEPTH = Path(__file__).resolve().parent.parent / "target" / "release" / "truedepth"
BOARD = "10x8:20.875mm:10.4375mm:ARUCO_ORIGINAL"


def ours(recording):
    command = [TRUEDEPTH, "detect", "--json", "--board", BOARD, recording]
    document = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
    return {
        Path(image["path"]).name: {c["id"]: (c["x_px"], c["y_px"]) for c in image["corners"]}
        for image in document["images"]
    }


def opencv(recording):
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_ARUCO_ORIGINAL)
    board = cv2.aruco.CharucoBoard((10, 8), 0.020875, 0.0104375, dictionary)
    board.setLegacyPattern(True)
    parameters = cv2.aruco.CharucoParameters()
    parameters.minMarkers = 1
    detector = cv2.aruco.CharucoDetector(board, parameters)
    found = {}
    for path in sorted(recording.glob("rgb_*.png")):
        corners, ids, _, _ = detector.detectBoard(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))
        found[path.name] = (
            {} if ids is None else dict(zip(ids.ravel().tolist(), corners.reshape(-1, 2).tolist()))
        )
    return found, board.getChessboardCorners()


def rms(corners, common, places):
    objects = [np.float32([places[i] for i in ids]) for ids in common.values()]
    images = [np.float32([corners[name][i] for i in ids]) for name, ids in common.items()]
    start = np.array([[590.0, 0, 320], [0, 590.0, 240], [0, 0, 1]])
    value, matrix, *_ = cv2.calibrateCamera(
        objects, images, (640, 480), start, np.zeros(5), flags=cv2.CALIB_USE_INTRINSIC_GUESS
    )
    return value, matrix[0, 0]


def main(root):
    print("OpenCV", cv2.__version__)
    for recording in sorted((root / "zeiss" / "FrontCamCalibrationDataset").iterdir()):
        theirs, places = opencv(recording)
        own = ours(recording)
        common = {name: sorted(set(theirs[name]) & set(own.get(name, {}))) for name in theirs}
        common = {name: ids for name, ids in common.items() if len(ids) >= 12}
        n = sum(map(len, common.values()))
        (a, fa), (b, fb) = rms(theirs, common, places), rms(own, common, places)
        print(
            f"{recording.name}: {len(common)} frames, {n} corners; RMS {a:.4f} px (fx {fa:.2f}) with OpenCV's, "
            f"{b:.4f} px (fx {fb:.2f}) with truedepth's"
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
