"""What is left of the residuals once the board's shape is known: does each view move while its rows are read?

    truedepth detect REC --json > detect.json; truedepth calibrate REC --json > calibrate.json
    python rolling_shutter.py detect.json calibrate.json          # numpy

Fits the same corners twice: with a height for each corner of the board, and with, besides, a velocity of each view
(three rotations, three translations over the time that all rows take; known to be 4 mrad and 1 mm beforehand). Then
compares the velocities with how the camera moved from frame to frame. Frames of the app are 500 ms apart.
"""

import json
import sys

import numpy as np

HUBER, FLOOR_PX, HEIGHT_SIGMA_M = 3.0, 0.08, 5e-4
VELOCITY_SIGMA = np.r_[[0.004] * 3, [0.001] * 3]
# The paper's board.
SQUARE_M, COLUMNS, ROWS = 0.020875, 9, 7
BOARD = np.array([[(i % COLUMNS + 1) * SQUARE_M, (i // COLUMNS + 1) * SQUARE_M, 0] for i in range(COLUMNS * ROWS)])


def skew(v):
    zero = np.zeros(len(v))
    x, y, z = v.T
    return np.stack([np.stack([zero, -z, y], 1), np.stack([z, zero, -x], 1), np.stack([-y, x, zero], 1)], 1)


def turn(vector):
    angle = np.linalg.norm(vector)
    if angle < 1e-12:
        return np.eye(3)
    k = skew((vector / angle)[None])[0]
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def vector_of(rotation):
    angle = np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1))
    axis = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    return axis * (0.5 if angle < 1e-9 else angle / (2 * np.sin(angle)))


class Problem:
    """fx = fy, centre, k1 k2 p1 p2 k3 and heights shared; a pose and perhaps a velocity per view."""

    def __init__(self, views, board, size, moving):
        self.views, self.board, self.size, self.n_own = views, board, size, 12 if moving else 6
        self.n = 8 + len(board)
        # Inverse variances of the shared numbers, known to be near zero beforehand.
        self.precision = np.r_[np.zeros(8), np.full(len(board), HEIGHT_SIGMA_M**-2)]

    def view(self, i, shared, pose, derivatives):
        rotation, t, velocity = pose
        ids, seen, weight = self.views[i]
        point = self.board[ids] + np.outer(shared[8 + ids], [0, 0, 1])
        turned = point @ rotation.T
        when = (seen[:, 1] - self.size[1] / 2) / self.size[1]
        p = turned + t + np.cross(when[:, None] * velocity[:3], turned) + when[:, None] * velocity[3:]
        f, cx, cy, k1, k2, p1, p2, k3 = shared[:8]
        x, y, iz = p[:, 0] / p[:, 2], p[:, 1] / p[:, 2], 1 / p[:, 2]
        r2 = x * x + y * y
        radial, slope = 1 + r2 * (k1 + r2 * (k2 + r2 * k3)), k1 + r2 * (2 * k2 + 3 * r2 * k3)
        xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        residual = seen - np.stack([f * xd + cx, f * yd + cy], 1)
        if not derivatives:
            return residual, weight
        m = len(ids)
        by_shared = np.zeros((m, 2, self.n))
        by_shared[:, 0, 0], by_shared[:, 1, 0], by_shared[:, 0, 1], by_shared[:, 1, 2] = xd, yd, 1, 1
        by_shared[:, 0, 3:8] = f * np.stack([x * r2, x * r2 * r2, 2 * x * y, r2 + 2 * x * x, x * r2**3], 1)
        by_shared[:, 1, 3:8] = f * np.stack([y * r2, y * r2 * r2, r2 + 2 * y * y, 2 * x * y, y * r2**3], 1)
        cross = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y
        lens = [[radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x, cross],
                [cross, radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x]]
        lens = f * np.moveaxis(np.array(lens), 2, 0)
        pinhole = np.zeros((m, 2, 3))
        pinhole[:, 0, 0], pinhole[:, 1, 1], pinhole[:, 0, 2], pinhole[:, 1, 2] = iz, iz, -x * iz, -y * iz
        by_point = lens @ pinhole
        by_shared[np.arange(m), :, 8 + ids] = by_point @ rotation[:, 2]
        own = np.concatenate([-by_point @ skew(turned), by_point], 2)
        if self.n_own == 12:
            own = np.concatenate([own, own * when[:, None, None]], 2)
        return residual, weight, by_shared, own

    def cost(self, shared, poses):
        total = 0.5 * self.precision @ shared**2
        for i, pose in enumerate(poses):
            residual, weight = self.view(i, shared, pose, False)
            s = weight * (residual**2).sum(1)
            total += 0.5 * np.where(s > HUBER**2, 2 * HUBER * np.sqrt(s) - HUBER**2, s).sum()
            total += 0.5 * np.sum((pose[2] / VELOCITY_SIGMA) ** 2)
        return total

    def solve(self, shared, poses):
        damping, cost = 1e-4, self.cost(shared, poses)
        for _ in range(60):
            parts = []
            for i, pose in enumerate(poses):
                residual, weight, by_shared, own = self.view(i, shared, pose, True)
                s = weight * (residual**2).sum(1)
                weight = np.repeat(weight * np.where(s > HUBER**2, HUBER / np.sqrt(np.maximum(s, 1e-9)), 1), 2)
                a, b, r = by_shared.reshape(-1, self.n), own.reshape(-1, self.n_own), residual.ravel()
                v, h = b.T @ (weight[:, None] * b), b.T @ (weight * r)
                if self.n_own == 12:
                    v[6:, 6:] += np.diag(VELOCITY_SIGMA**-2)
                    h[6:] -= pose[2] / VELOCITY_SIGMA**2
                parts.append((v, h, a.T @ (weight[:, None] * b), a.T @ (weight[:, None] * a), a.T @ (weight * r)))
            while True:
                s, q, inverses = np.diag((1 + damping) * self.precision), -self.precision * shared, []
                for v, h, w, u, g in parts:
                    inverses.append(np.linalg.inv(v + damping * np.diag(np.diag(v))))
                    s = s + u + damping * np.diag(np.diag(u)) - w @ inverses[-1] @ w.T
                    q = q + g - w @ inverses[-1] @ h
                step = np.linalg.solve(s, q)
                moved = []
                for (rotation, t, velocity), inverse, (v, h, w, u, g) in zip(poses, inverses, parts):
                    own = np.r_[inverse @ (h - w.T @ step), np.zeros(6)]
                    moved.append((turn(own[:3]) @ rotation, t + own[3:6], velocity + own[6:12]))
                new = self.cost(shared + step, moved)
                if new < cost or damping > 1e10:
                    break
                damping *= 5
            done = cost - new < 1e-7 * cost
            if new < cost:
                shared, poses, cost, damping = shared + step, moved, new, max(damping / 5, 1e-9)
            if done:
                break
        return shared, poses


def load(detect_json, calibrate_json):
    """Views (corners' ids, pixels, weights), poses and numbers to start from, image size, frames and name."""
    detected, calibration = (json.load(open(path)) for path in (detect_json, calibrate_json))
    left_out = {(o["frame"], o["id"]) for o in calibration["outliers"]}
    views, poses, frames = [], [], []
    for view in calibration["views"]:
        corners = detected["images"][view["frame"]]["corners"]
        corners = [c for c in corners if (view["frame"], c["id"]) not in left_out]
        ids = np.array([c["id"] for c in corners])
        seen = np.array([[c["x_px"], c["y_px"]] for c in corners])
        sigma = np.array([c["sigma_px"] for c in corners])
        views.append((ids, seen, 1 / (sigma**2 + FLOOR_PX**2)))
        frames.append(view["frame"])
        poses.append((turn(np.array(view["rotation_vector_rad"])), np.array(view["translation_m"]), np.zeros(6)))
    start = np.r_[calibration["focal_px"]["value"], calibration["principal_point_px"], np.zeros(5 + len(BOARD))]
    return views, poses, start, calibration["image_size_px"], frames, calibration["recording"]


def main():
    views, poses, start, size, frames, recording = load(*sys.argv[1:3])
    print(recording)
    for moving in (False, True):
        problem = Problem(views, BOARD, size, moving)
        shared, found = problem.solve(start, poses)
        squares = [(problem.view(i, shared, pose, False)[0] ** 2).sum(1) for i, pose in enumerate(found)]
        rms = np.sqrt(np.concatenate(squares).mean())
        words = "each view with its own velocity" if moving else "still"
        print(f"  {words:<32} rms {rms:.3f} px, focal length {shared[0]:.2f} px, centre {shared[1]:.2f} {shared[2]:.2f}")
    # Velocity against the mean motion from the frame before to the frame after, both per 500 ms.
    fitted, seen = [], []
    for i in range(1, len(found) - 1):
        if frames[i + 1] - frames[i - 1] == 2:
            fitted.append(found[i][2])
            seen.append(np.r_[vector_of(found[i + 1][0] @ found[i - 1][0].T), found[i + 1][1] - found[i - 1][1]] / 2)
    fitted, seen = np.array(fitted), np.array(seen)
    for k, name in enumerate(["pitch", "yaw", "roll"]):
        slope = fitted[:, k] @ seen[:, k] / (seen[:, k] @ seen[:, k])
        correlation = np.corrcoef(fitted[:, k], seen[:, k])[0, 1]
        print(f"  {name:<6} correlation {correlation:+.2f}, all rows read in {500 * slope:.1f} ms")


if __name__ == "__main__":
    main()
