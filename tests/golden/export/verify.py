"""Reads every exported calibration back with the program it is for, and compares the numbers.

    /usr/bin/python3 -m venv --system-site-packages /tmp/v       # mrcal is Debian's python3-mrcal
    /tmp/v/bin/pip install opencv-python-headless open3d pycolmap pyyaml numpy
    /tmp/v/bin/python verify.py

Programs that are not installed are named and passed over. Kalibr and ROS read plain YAML (kalibr_common.ConfigReader,
camera_calibration_parsers); neither is on PyPI, so that PyYAML reads theirs and the fields are compared with what their
documentation says. The camera is the one of the test in src/wire/export/mod.rs.
"""

import importlib.util
from pathlib import Path

HERE = Path(__file__).parent
PINHOLE = [595.25, 596.5, 318.375, 239.9375]
LENS = [0.07, -0.0825, 0.00025, -0.00125, 0.0000125]
RAY = [0.31, -0.22, 1.0]


def drawn(lens):
    """Where the ray is drawn, by OpenCV's formula."""
    k1, k2, p1, p2, k3 = lens
    x, y, _ = RAY
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    fx, fy, cx, cy = PINHOLE
    return [
        fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx,
        fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy,
    ]


def close(found, expected, tolerance=1e-12):
    found, expected = [float(f) for f in found], [float(e) for e in expected]
    assert len(found) == len(expected), (found, expected)
    assert all(abs(f - e) <= tolerance * max(1, abs(e)) for f, e in zip(found, expected)), (found, expected)


def opencv():
    import cv2
    import numpy as np

    storage = cv2.FileStorage(str(HERE / "opencv.yml"), cv2.FILE_STORAGE_READ)
    k = storage.getNode("camera_matrix").mat()
    lens = storage.getNode("distortion_coefficients").mat()
    close([k[0, 0], k[1, 1], k[0, 2], k[1, 2]], PINHOLE)
    close(lens.ravel(), LENS)
    assert (storage.getNode("image_width").real(), storage.getNode("image_height").real()) == (640, 480)
    pixel = cv2.projectPoints(np.array([RAY]), np.zeros(3), np.zeros(3), k, lens)[0]
    close(pixel.ravel(), drawn(LENS), 1e-10)


def mrcal():
    import mrcal as program
    import numpy as np

    model = program.cameramodel(str(HERE / "mrcal.cameramodel"))
    name, numbers = model.intrinsics()
    assert name == "LENSMODEL_OPENCV5" and list(model.imagersize()) == [640, 480]
    close(numbers, PINHOLE + LENS)
    close(program.project(np.array(RAY), name, numbers), drawn(LENS), 1e-10)


def pycolmap():
    import pycolmap as program

    line = [l for l in (HERE / "cameras.txt").read_text().splitlines() if not l.startswith("#")][0].split()
    camera = program.Camera(model=line[1], width=int(line[2]), height=int(line[3]), params=[float(f) for f in line[4:]])
    assert camera.verify_params()
    x, y = camera.img_from_cam(RAY if hasattr(camera, "_3d") else [RAY[0], RAY[1], 1.0])
    # The first pixel's centre is (0.5, 0.5) there.
    close([x - 0.5, y - 0.5], drawn(LENS), 1e-10)


def open3d():
    import open3d as program

    pinhole = program.io.read_pinhole_camera_intrinsic(str(HERE / "open3d.json"))
    fx, fy = pinhole.get_focal_length()
    close([fx, fy, *pinhole.get_principal_point()], PINHOLE)
    assert (pinhole.width, pinhole.height) == (640, 480)


def yaml():
    import yaml as program

    kalibr = program.safe_load((HERE / "camchain.yaml").read_text())["cam0"]
    assert (kalibr["camera_model"], kalibr["distortion_model"]) == ("pinhole", "radtan")
    close(kalibr["intrinsics"], PINHOLE)
    assert kalibr["resolution"] == [640, 480]
    # radtan has no k3: the four others are fitted, and draw the ray in nearly the same place.
    close(drawn([*kalibr["distortion_coeffs"], 0.0]), drawn(LENS), 1e-4)
    ros = program.safe_load((HERE / "ros.yaml").read_text())
    k = ros["camera_matrix"]["data"]
    close([k[0], k[4], k[2], k[5]], PINHOLE)
    close(ros["distortion_coefficients"]["data"], LENS)
    assert (ros["image_width"], ros["image_height"], ros["distortion_model"]) == (640, 480, "plumb_bob")
    p = ros["projection_matrix"]["data"]
    close([p[0], p[5], p[2], p[6]], PINHOLE)


for name, check in [("cv2", opencv), ("mrcal", mrcal), ("pycolmap", pycolmap), ("open3d", open3d), ("yaml", yaml)]:
    if importlib.util.find_spec(name) is None:
        print(f"{name}: not installed")
        continue
    check()
    print(f"{name}: read back")
