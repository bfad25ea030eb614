"""Is the paper's board the same in all recordings? Twist and bend of the sheet, with views still and moving.

    truedepth detect REC --json > a.detect.json; truedepth calibrate REC --json > a.calibrate.json
    python board_shapes.py a.detect.json a.calibrate.json [b.detect.json b.calibrate.json ...]          # numpy

Fits as rolling_shutter.py does. Heights are described by how far the board's corners stand from its middle: twist
(x*y) and bend along rows (x*x) and columns (y*y), micrometres where x = +-1 and y = +-1 are the outermost corners.
Their sigma is that of a jackknife: a twelfth of the views is left out at a time.
"""

import sys

import numpy as np

from rolling_shutter import BOARD, Problem, load

PARTS = 12


def form(heights):
    x, y = (2 * (BOARD[:, k] - BOARD[:, k].min()) / np.ptp(BOARD[:, k]) - 1 for k in (0, 1))
    terms = np.c_[np.ones(len(BOARD)), x, y, x * y, x * x, y * y]
    return 1e6 * np.linalg.lstsq(terms, heights, rcond=None)[0][3:]


def main():
    for moving in (False, True):
        print("each view with its own velocity" if moving else "still")
        for detect, calibrate in zip(sys.argv[1::2], sys.argv[2::2]):
            views, poses, start, size, _, name = load(detect, calibrate)
            whole, found = Problem(views, BOARD, size, moving).solve(start, poses)
            parts = []
            for part in range(PARTS):
                kept = [i for i in range(len(views)) if i % PARTS != part]
                own = [views[i] for i in kept]
                parts.append(form(Problem(own, BOARD, size, moving).solve(whole, [found[i] for i in kept])[0][8:]))
            sigma = np.sqrt((PARTS - 1) * np.var(parts, axis=0))
            words = [f"{v:5.0f} +- {s:3.0f}" for v, s in zip(form(whole[8:]), sigma)]
            print(f"  {name:<24} twist {words[0]}, along rows {words[1]}, along columns {words[2]} um")


main()
