"""OpenCV's ChArUco detection alone, on one thread.

    python opencv_detect.py IMAGE...

4.5.5 with the calls of its time, later versions with CharucoDetector; one marker is enough for a corner in both.
Prints one JSON object: version, milliseconds per image (decoding not counted), corners found.
"""

import json
import sys
import time

import cv2

SQUARES, SQUARE_M, MARKER_M = (10, 8), 0.020875, 0.0104375


def detector_455():
    dictionary = cv2.aruco.Dictionary_get(cv2.aruco.DICT_ARUCO_ORIGINAL)
    parameters = cv2.aruco.DetectorParameters_create()
    board = cv2.aruco.CharucoBoard_create(*SQUARES, SQUARE_M, MARKER_M, dictionary)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 0.001)

    def detect(gray):
        corners, ids, _ = cv2.aruco.detectMarkers(gray, dictionary, parameters=parameters)
        if len(corners) == 0:
            return 0
        for corner in corners:
            cv2.cornerSubPix(gray, corner, (3, 3), (-1, -1), criteria)
        return cv2.aruco.interpolateCornersCharuco(corners, ids, gray, board, minMarkers=1)[0]

    return detect


def detector_new():
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_ARUCO_ORIGINAL)
    board = cv2.aruco.CharucoBoard(SQUARES, SQUARE_M, MARKER_M, dictionary)
    board.setLegacyPattern(True)
    parameters = cv2.aruco.CharucoParameters()
    parameters.minMarkers = 1
    detector = cv2.aruco.CharucoDetector(board, parameters)

    def detect(gray):
        ids = detector.detectBoard(gray)[1]
        return 0 if ids is None else len(ids)

    return detect


def main(paths):
    cv2.setNumThreads(1)
    detect = detector_455() if cv2.__version__.startswith("4.5.") else detector_new()
    images = [cv2.imread(path, cv2.IMREAD_GRAYSCALE) for path in paths]
    for gray in images[:5]:
        detect(gray)
    start = time.perf_counter()
    n_corners = sum(detect(gray) for gray in images)
    seconds = time.perf_counter() - start
    print(
        json.dumps(
            {
                "opencv": cv2.__version__,
                "ms_per_image": 1e3 * seconds / len(images),
                "n_corners": n_corners,
                "n_images": len(images),
            }
        )
    )


if __name__ == "__main__":
    main(sys.argv[1:])
