#!/usr/bin/env python3
"""The print in the depth maps, apart from our own code: where does depth lie on colour, and is it the hand?

    python docs/method/print_in_depth.py ../shared/data/zeiss      # needs opencv-python and numpy

Regresses the depth maps on the colour images themselves (no poses, no camera, no board but its outline): zoom and shift
with their σ by leaving out frames, then the shift of single frames on what the gyroscope said at their time. If the shift
came of rows read while the hand turns, it would go with the turning and vanish without.
"""

import json
import sys
from pathlib import Path

import cv2
import numpy as np

BLUR_PX, NEIGHBOURHOOD_PX = 4.0, 12.0


def load(folder, truth):
    frames = []
    gyroscope = np.loadtxt(folder / "Gyroscope.txt", usecols=range(4))
    for color in sorted(folder.glob("rgb_*.png")):
        depth = color.with_name(color.name.replace("rgb_", "depth_"))
        seen = [v for k, v in truth.items() if k.endswith(f"{folder.name}/{color.name}")]
        if not depth.exists() or not seen or len(seen[0]["corners"]) < 20:
            continue
        gray = cv2.imread(str(color), cv2.IMREAD_GRAYSCALE).astype(float)
        depth_mm = cv2.imread(str(depth), cv2.IMREAD_UNCHANGED) * 0.1
        inside = np.zeros(gray.shape, np.uint8)
        outline = cv2.convexHull(np.array(list(seen[0]["corners"].values()), np.float32)).astype(np.int32)
        cv2.fillConvexPoly(inside, outline, 1)
        inside = cv2.erode(inside, np.ones((15, 15)))
        measured = cv2.erode((depth_mm > 0).astype(float), np.ones((5, 5)))
        inverse = np.where(depth_mm > 0, 1000 / np.maximum(depth_mm, 1), 0)
        height, width = gray.shape
        y, x = np.mgrid[0:height, 0:width].astype(float)
        use = (inside > 0) & (measured > 0)
        if use.sum() < 3000:
            continue
        plane = np.linalg.lstsq(np.c_[np.ones(use.sum()), x[use], y[use]], inverse[use], rcond=None)[0]
        rough = np.where(measured > 0, inverse - plane[0] - plane[1] * x - plane[2] * y, 0)
        sigma = 1.48 * np.median(abs(rough[use]))
        rough = np.clip(rough, -5 * sigma, 5 * sigma) * measured
        weight = cv2.GaussianBlur(measured, (0, 0), NEIGHBOURHOOD_PX) + 1e-6

        def less_mean(image, use=use, measured=measured, weight=weight):
            return (image - cv2.GaussianBlur(image * measured, (0, 0), NEIGHBOURHOOD_PX) / weight)[use]

        texture = less_mean(rough)
        sigma = 1.48 * np.median(abs(texture))
        keep = abs(texture) < 4 * sigma
        moment = np.argmin(abs(gyroscope[:, 0] - float(color.stem[4:])))
        frames.append({
            "gray": cv2.GaussianBlur(gray, (0, 0), BLUR_PX).astype(np.float32),
            "less_mean": less_mean,
            "keep": keep,
            "texture": texture[keep] / sigma,
            "xy": (x, y),
            "turning": gyroscope[max(0, moment - 2):moment + 3, 1:].mean(0),
        })
    return frames


def normal(frame, place):
    zoom, shift_x, shift_y = place
    x, y = frame["xy"]
    cx, cy = x.shape[1] / 2, x.shape[0] / 2
    at = [(c + zoom * (p - s - c)).astype(np.float32) for p, s, c in ((x, shift_x, cx), (y, shift_y, cy))]
    gray = cv2.remap(frame["gray"], *at, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE).astype(float)
    by_x, by_y = (cv2.Sobel(gray, -1, *d, ksize=3) / 8 for d in ((1, 0), (0, 1)))
    columns = [gray, (x - cx) * by_x + (y - cy) * by_y, -by_x, -by_y]
    a = np.array([frame["less_mean"](c)[frame["keep"]] for c in columns])
    a -= a.mean(1, keepdims=True)
    return a @ a.T, a @ frame["texture"]


def solve(information, score):
    contrast, *off = np.linalg.solve(information, score)
    return np.array(off) / contrast, contrast


def main():
    data = Path(sys.argv[1])
    truth = json.loads((data / "truth.json").read_text())
    for folder in sorted((data / "FrontCamCalibrationDataset").iterdir()):
        frames = load(folder, truth)
        place = np.array([1.0, 0.0, 0.0])
        for _ in range(6):
            parts = [normal(frame, place) for frame in frames]
            information, score = (np.array(p) for p in zip(*parts))
            off, contrast = solve(information.sum(0), score.sum(0))
            place = place + off
        n = len(frames)
        without = np.array([
            solve(information.sum(0) - information[i], score.sum(0) - score[i])[0] for i in range(n)
        ])
        sigma = np.sqrt((n - 1) / n * ((without - without.mean(0)) ** 2).sum(0))
        print(f"{folder.name}: {n} frames, zoom {place[0]:.4f} ± {sigma[0]:.4f}, "
              f"shift {place[1]:+.2f} ± {sigma[1]:.2f}, {place[2]:+.2f} ± {sigma[2]:.2f} px")
        # One frame alone does not tell zoom and contrast well: these are those of all.
        rows = np.array([f["turning"] for f in frames])
        a = np.c_[np.ones(n), rows]
        for axis, k in (("x", 2), ("y", 3)):
            single = np.array([
                place[k - 1] + np.linalg.solve(m[2:, 2:], s[2:] - m[2:, 0] * contrast)[k - 2] / contrast
                for m, s in zip(information, score)
            ])
            fit = np.linalg.lstsq(a, single, rcond=None)[0]
            left = single - a @ fit
            error = np.sqrt((left @ left) / (n - 4) * np.diag(np.linalg.inv(a.T @ a)))
            says = ", ".join(f"{v:+.2f} ± {e:.2f}" for v, e in zip(fit[1:], error[1:]))
            print(f"  shift {axis} without turning {fit[0]:+.2f} ± {error[0]:.2f} px; px per rad/s about x, y, z: {says}")


main()
