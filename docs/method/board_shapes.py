"""Is the paper's board the same in all recordings? Twist and bend of the sheet: views still, moving, and a free lens.

    truedepth detect REC --json > a.detect.json; truedepth calibrate REC --json > a.calibrate.json
    python board_shapes.py a.detect.json a.calibrate.json [b.detect.json b.calibrate.json ...]          # numpy

Fits as rolling_shutter.py does. The free lens adds to Brown's a smooth shift of the image, in both directions: cubic
B-splines of 9 by 7 knots, each of about 0.3 px beforehand. Heights are described by how far the board's corners stand
from its middle: twist (x*y) and bend along rows (x*x) and columns (y*y), micrometres where x = +-1 and y = +-1 are the
outermost corners. Their sigma is that of a jackknife: a twelfth of the views is left out at a time.
"""

import sys

import numpy as np

from rolling_shutter import BOARD, Problem, load

PARTS = 12
KNOTS, LENS_SIGMA_PX = (9, 7), 0.3


def splines(at, n):
    """The n cubic B-splines over 0 to 1 at these places: one row for each."""
    place = at * (n - 3)
    first = np.clip(np.floor(place).astype(int), 0, n - 4)
    u = place - first
    values = np.c_[(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3] / 6
    rows = np.zeros((len(at), n))
    rows[np.arange(len(at))[:, None], first[:, None] + np.arange(4)] = values
    return rows


class FreeLens(Problem):
    """A problem with a smooth shift of the image besides: its numbers along x, then along y, after all others."""

    def __init__(self, views, board, size, moving):
        super().__init__(views, board, size, moving)
        self.n_before, self.n_knots = self.n, KNOTS[0] * KNOTS[1]
        self.n += 2 * self.n_knots
        self.precision = np.r_[self.precision, np.full(2 * self.n_knots, LENS_SIGMA_PX**-2)]
        self.splines = []
        for ids, seen, _ in views:
            x, y = (splines(np.clip(seen[:, k] / size[k], 0, 1), KNOTS[k]) for k in (0, 1))
            self.splines.append((y[:, :, None] * x[:, None, :]).reshape(len(ids), -1))

    def view(self, i, shared, pose, derivatives):
        residual, weight, *rest = super().view(i, shared, pose, derivatives)
        rows, shift = self.splines[i], shared[self.n_before:].reshape(2, -1)
        residual = residual - rows @ shift.T
        if derivatives:
            by_shared = rest[0]
            by_shared[:, 0, self.n_before:self.n_before + self.n_knots] = rows
            by_shared[:, 1, self.n_before + self.n_knots:] = rows
        return residual, weight, *rest


def form(heights):
    x, y = (2 * (BOARD[:, k] - BOARD[:, k].min()) / np.ptp(BOARD[:, k]) - 1 for k in (0, 1))
    terms = np.c_[np.ones(len(BOARD)), x, y, x * y, x * x, y * y]
    return 1e6 * np.linalg.lstsq(terms, heights, rcond=None)[0][3:]


def main():
    still, moving = "still", "each view with its own velocity"
    for title, model, moves in [
        (still, Problem, False),
        (moving, Problem, True),
        (f"{still}, free lens", FreeLens, False),
        (f"{moving}, free lens", FreeLens, True),
    ]:
        print(title)
        for detect, calibrate in zip(sys.argv[1::2], sys.argv[2::2]):
            views, poses, start, size, _, name = load(detect, calibrate)
            problem = model(views, BOARD, size, moves)
            whole, found = problem.solve(np.r_[start, np.zeros(problem.n - len(start))], poses)
            parts = []
            for part in range(PARTS):
                kept = [i for i in range(len(views)) if i % PARTS != part]
                own = [views[i] for i in kept]
                heights = model(own, BOARD, size, moves).solve(whole, [found[i] for i in kept])[0][8:8 + len(BOARD)]
                parts.append(form(heights))
            sigma = np.sqrt((PARTS - 1) * np.var(parts, axis=0))
            words = [f"{v:5.0f} +- {s:3.0f}" for v, s in zip(form(whole[8:8 + len(BOARD)]), sigma)]
            print(f"  {name:<24} twist {words[0]}, along rows {words[1]}, along columns {words[2]} um", flush=True)


main()
