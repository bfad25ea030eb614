//! Saddles joined to lattices: which corner is whose neighbour.
//!
//! A chessboard's corners are linked along its edges. For each of the four edges of a saddle the nearest saddle in
//! that direction is its neighbour if the colours of the squares between them agree at both ends *and* along the
//! way. Links that both ends agree on are followed from saddle to saddle, which numbers them (i, j) without any model
//! of the camera: perspective and lens distortion only bend the lattice, they do not change who is whose neighbour.

use std::collections::{BTreeSet, VecDeque};

use crate::{geom::Pixel, par::vectorized};

use super::{
    map::{SmoothMap, length},
    pyramid::Level,
    saddle::Saddle,
};

/// Corners numbered along two axes. In the image, the axis j lies clockwise of i, as y lies of x.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// The nodes, by (j, i).
    pub(super) nodes: Vec<Node>,
    /// Median contrast of the corners, grey levels.
    pub(super) contrast: f64,
    /// True where the cell between (0, 0) and (1, 1) is bright; cells alternate from there.
    pub(super) origin_is_bright: bool,
}

/// A corner and its number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) i: i32,
    pub(super) j: i32,
    /// Where it lies in the image.
    pub(super) pixel: Pixel,
    /// The standard deviation of that, pixels, where it has been measured as a corner.
    pub(super) sigma_px: Option<f64>,
}

impl Lattice {
    /// True where the cell between (i, j) and (i + 1, j + 1) is bright.
    pub(super) fn is_bright(&self, i: i32, j: i32) -> bool {
        self.origin_is_bright == ((i + j) % 2 == 0)
    }

    /// The map from (i, j) to the image; `None` where the nodes do not span a plane.
    pub(super) fn map(&self) -> Option<SmoothMap> {
        SmoothMap::fit(&self.pairs())
    }

    /// Number and place of every node.
    fn pairs(&self) -> Vec<([f64; 2], Pixel)> {
        self.nodes.iter().map(|n| ([f64::from(n.i), f64::from(n.j)], n.pixel)).collect()
    }

    /// Drops, one by one, the nodes that lie farthest from where the map through all expects them, until all lie
    /// within a quarter of a square: a wrong link numbers everything behind it wrongly. The map through what is left,
    /// as of [`map`](Self::map).
    pub(super) fn prune(&mut self) -> Option<SmoothMap> {
        // Small lattices hardly bend, and a bend would follow the wrong node.
        const SMALL: usize = 36;
        let fit = |nodes: &[([f64; 2], Pixel)]| {
            if nodes.len() < SMALL { SmoothMap::homography(nodes) } else { SmoothMap::fit(nodes) }
        };
        while let Some(map) = fit(&self.pairs()) {
            let misfit = |node: &Node| {
                let (x, y) = (f64::from(node.i), f64::from(node.j));
                let (Some(at), Some([u, v])) = (map.at(x, y), map.axes(x, y)) else {
                    return f64::INFINITY;
                };
                at.distance(node.pixel) / length(u).min(length(v))
            };
            let worst =
                self.nodes.iter().map(misfit).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
            match worst {
                Some((index, misfit)) if misfit > 0.25 => self.nodes.remove(index),
                _ if self.nodes.len() < SMALL => return self.map(),
                _ => return Some(map),
            };
        }
        None
    }

    /// Where it is, for people: one of its middle nodes.
    pub(super) fn middle(&self) -> Pixel {
        self.nodes[self.nodes.len() / 2].pixel
    }

    /// Adds the neighbours of nodes that `find` sees at the place where the map expects them, until it sees no more.
    /// At most `most` nodes.
    pub(super) fn extend(
        &mut self,
        most: usize,
        mut find: impl FnMut(&SmoothMap, i32, i32) -> Option<(Pixel, f64)>,
    ) {
        let mut known: BTreeSet<(i32, i32)> = self.nodes.iter().map(|n| (n.j, n.i)).collect();
        let mut tried = known.clone();
        while let Some(map) = self.map() {
            let around: BTreeSet<(i32, i32)> = known
                .iter()
                .flat_map(|&(j, i)| [(j, i + 1), (j, i - 1), (j + 1, i), (j - 1, i)])
                .filter(|place| !tried.contains(place))
                .collect();
            let n_before = self.nodes.len();
            for &(j, i) in &around {
                if self.nodes.len() < most
                    && let Some((pixel, sigma_px)) = find(&map, i, j)
                {
                    self.nodes.push(Node { i, j, pixel, sigma_px: Some(sigma_px) });
                    known.insert((j, i));
                }
            }
            tried.extend(around);
            if self.nodes.len() == n_before {
                break;
            }
        }
        self.nodes.sort_unstable_by_key(|n| (n.j, n.i));
    }
}

/// Neighbours lie at least this far apart, pixels of the level: below, their rings overlap.
const MIN_SPACING: f32 = 4.5;
/// A neighbour lies within this angle of the edge: cos 22°.
const MIN_COS: f32 = 0.927;
/// How many saddles in an edge's direction are tried, nearest first: markers add few that pass the cone.
const MOST_TRIED: usize = 6;
/// The difference across an edge, as a fraction of the contrast of the weaker end.
const MIN_STEP: f32 = 0.25;

/// Lattices with at least `min_nodes` nodes, largest first.
pub(super) fn lattices(level: &Level, saddles: &[Saddle], min_nodes: usize) -> Vec<Lattice> {
    let links = vectorized(
        #[inline(always)]
        || links(level, saddles),
    );
    let mut taken = vec![false; saddles.len()];
    let mut found = Vec::new();
    // Saddles come strongest first: numbering starts where the image is clearest.
    for root in 0..saddles.len() {
        if !taken[root] {
            let lattice = grow(level, saddles, &links, root, &mut taken);
            if lattice.nodes.len() >= min_nodes {
                found.push(lattice);
            }
        }
    }
    found.sort_by_key(|lattice| std::cmp::Reverse(lattice.nodes.len()));
    found
}

/// A link: the neighbour and which of its edges leads back.
type Link = Option<(u32, u8)>;

/// For every saddle and edge the neighbour that agrees.
#[inline(always)]
fn links(level: &Level, saddles: &[Saddle]) -> Vec<[Link; 4]> {
    let mut grid = Buckets::new(level, saddles);
    let mut one_way: Vec<[Link; 4]> = vec![[None; 4]; saddles.len()];
    let mut near: [Vec<Near>; 4] = Default::default();
    for (p, links) in one_way.iter_mut().enumerate() {
        grid.near(saddles, p, &mut near);
        for (k, link) in links.iter_mut().enumerate() {
            *link = nearest(&mut near[k], |n| neighbour(level, saddles, p, k, n));
        }
    }
    // Both ends must agree.
    let mut mutual = one_way.clone();
    for (p, links) in mutual.iter_mut().enumerate() {
        for (k, link) in links.iter_mut().enumerate() {
            if let Some((q, l)) = *link
                && one_way[q as usize][l as usize] != Some((p as u32, k as u8))
            {
                *link = None;
            }
        }
    }
    mutual
}

/// A saddle in the direction of an edge of another.
#[derive(Clone, Copy, Debug)]
struct Near {
    q: u32,
    /// From the other to this, pixels of the level.
    offset: [f32; 2],
    /// Square of the distance.
    square: f32,
}

/// The first of the nearest [`MOST_TRIED`] that `find` takes, nearest first. Forgets what it has looked at.
fn nearest<T>(near: &mut Vec<Near>, mut find: impl FnMut(&Near) -> Option<T>) -> Option<T> {
    for _ in 0..MOST_TRIED {
        // Equals by number: the order must not depend on where the search began.
        let order = |a: &Near, b: &Near| a.square.total_cmp(&b.square).then(a.q.cmp(&b.q));
        let (at, _) = near.iter().enumerate().min_by(|a, b| order(a.1, b.1))?;
        if let Some(found) = find(&near.swap_remove(at)) {
            return Some(found);
        }
    }
    None
}

/// The link along edge `k` of `p` to a saddle in that direction, if it can be its neighbour.
fn neighbour(level: &Level, saddles: &[Saddle], p: usize, k: usize, near: &Near) -> Link {
    let (here, there) = (&saddles[p], &saddles[near.q as usize]);
    let ([dx, dy], least) = (near.offset, MIN_COS * near.square.sqrt());
    let l = there.edges.iter().position(|[x, y]| -(dx * x + dy * y) > least)?;
    let bright = here.is_bright_after(k);
    (bright == there.is_bright_after((l + 3) % 4) && is_edge(level, here, there, bright))
        .then_some((near.q, l as u8))
}

/// True where the line between two saddles separates bright from dark all the way.
fn is_edge(level: &Level, a: &Saddle, b: &Saddle, bright_clockwise: bool) -> bool {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let length = (dx * dx + dy * dy).sqrt();
    // The side of ascending angle is (−dy, dx). Near enough to stay within the white rim round a marker, far enough
    // to leave the blurred edge.
    let offset = (0.11 * length).clamp(1.5, 5.0) / length;
    let (nx, ny) = (-dy * offset, dx * offset);
    let least = MIN_STEP * a.contrast.min(b.contrast);
    let sign = if bright_clockwise { 1.0 } else { -1.0 };
    [0.25, 0.5, 0.75].iter().all(|&t| {
        let (x, y) = (a.x + t * dx, a.y + t * dy);
        sign * (level.nearest(x + nx, y + ny) - level.nearest(x - nx, y - ny)) > least
    })
}

/// Numbers everything that can be reached from `root`.
fn grow(
    level: &Level,
    saddles: &[Saddle],
    links: &[[Link; 4]],
    root: usize,
    taken: &mut [bool],
) -> Lattice {
    // For each saddle reached: its number, and which of its edges points along +i.
    let mut queue = VecDeque::from([(root, 0_i32, 0_i32, 0_usize)]);
    let mut nodes: Vec<Node> = Vec::new();
    let mut contrasts: Vec<f32> = Vec::new();
    let mut occupied = BTreeSet::from([(0, 0)]);
    taken[root] = true;
    let step = |axis: usize| [(1, 0), (0, 1), (-1, 0), (0, -1)][axis];
    let mut bright_votes = 0_i32;
    while let Some((p, i, j, first)) = queue.pop_front() {
        let pixel = level.to_image(saddles[p].x, saddles[p].y);
        nodes.push(Node { i, j, pixel, sigma_px: None });
        contrasts.push(saddles[p].contrast);
        // The sector from +i to +j is the cell (i, j).
        let bright = saddles[p].is_bright_after(first) == ((i + j) % 2 == 0);
        bright_votes += if bright { 1 } else { -1 };
        for axis in 0..4 {
            if let Some((q, back)) = links[p][(first + axis) % 4] {
                let q = q as usize;
                let (di, dj) = step(axis);
                let place = (j + dj, i + di);
                // First come, first numbered: a place taken twice, or a saddle reached with two numbers, is a wrong
                // link somewhere; the later one is dropped.
                if !taken[q] && occupied.insert(place) {
                    taken[q] = true;
                    // q's edge `back` points along −axis.
                    let q_first = (usize::from(back) + 4 + 2 - axis) % 4;
                    queue.push_back((q, i + di, j + dj, q_first));
                }
            }
        }
    }
    nodes.sort_unstable_by_key(|n| (n.j, n.i));
    contrasts.sort_unstable_by(f32::total_cmp);
    let contrast = f64::from(contrasts[contrasts.len() / 2]);
    Lattice { nodes, contrast, origin_is_bright: bright_votes > 0 }
}

/// Saddles by place.
struct Buckets {
    columns: usize,
    rows: usize,
    /// Where each bucket starts in `members`.
    starts: Vec<u32>,
    /// Saddles, bucket by bucket, and their places.
    members: Vec<u32>,
    x: Vec<f32>,
    y: Vec<f32>,
    /// For each member looked at, in which edges' directions it lies: memory only.
    flags: Vec<u8>,
}

/// Side of a bucket, pixels of the level: neighbours are at most this far apart for certain. Larger squares are found
/// on a coarser level.
const BUCKET: f32 = 64.0;

impl Buckets {
    fn new(level: &Level, saddles: &[Saddle]) -> Self {
        let mut grid = Self {
            columns: level.width / BUCKET as usize + 1,
            rows: level.height / BUCKET as usize + 1,
            starts: Vec::new(),
            members: vec![0; saddles.len()],
            x: vec![0.0; saddles.len()],
            y: vec![0.0; saddles.len()],
            flags: Vec::new(),
        };
        let mut starts = vec![0_u32; grid.columns * grid.rows + 1];
        let bucket = |s: &Saddle| {
            let (column, row) = grid.place(s);
            row * grid.columns + column
        };
        for s in saddles {
            starts[bucket(s) + 1] += 1;
        }
        for b in 0..grid.columns * grid.rows {
            starts[b + 1] += starts[b];
        }
        let mut next = starts.clone();
        let slots: Vec<usize> = saddles
            .iter()
            .map(|s| {
                let slot = &mut next[bucket(s)];
                *slot += 1;
                *slot as usize - 1
            })
            .collect();
        for (index, (s, slot)) in saddles.iter().zip(slots).enumerate() {
            grid.members[slot] = index as u32;
            (grid.x[slot], grid.y[slot]) = (s.x, s.y);
        }
        grid.starts = starts;
        grid
    }

    /// Column and row of a saddle's bucket.
    fn place(&self, s: &Saddle) -> (usize, usize) {
        let column = ((s.x.max(0.0) / BUCKET) as usize).min(self.columns - 1);
        (column, ((s.y.max(0.0) / BUCKET) as usize).min(self.rows - 1))
    }

    /// For each edge of `p` the saddles in its direction, in the same bucket and those around it.
    #[inline(always)]
    fn near(&mut self, saddles: &[Saddle], p: usize, out: &mut [Vec<Near>; 4]) {
        out.iter_mut().for_each(Vec::clear);
        let here = &saddles[p];
        let (column, row) = self.place(here);
        for r in row.saturating_sub(1)..=(row + 1).min(self.rows - 1) {
            let first = self.starts[r * self.columns + column.saturating_sub(1)] as usize;
            let last = (column + 1).min(self.columns - 1);
            let end = self.starts[r * self.columns + last + 1] as usize;
            let (x, y) = (&self.x[first..end], &self.y[first..end]);
            self.flags.clear();
            self.flags.resize((end - first).next_multiple_of(8), 0);
            flag_directions(here, x, y, &mut self.flags[..end - first]);
            for (chunk, eight) in self.flags.as_chunks::<8>().0.iter().enumerate() {
                if u64::from_le_bytes(*eight) == 0 {
                    continue;
                }
                for (i, flag) in eight.iter().enumerate().filter(|(_, flag)| **flag != 0) {
                    let i = 8 * chunk + i;
                    let (dx, dy) = (x[i] - here.x, y[i] - here.y);
                    let q = self.members[first + i];
                    let near = Near { q, offset: [dx, dy], square: dx * dx + dy * dy };
                    for (k, out) in out.iter_mut().enumerate() {
                        if flag >> k & 1 == 1 {
                            out.push(near);
                        }
                    }
                }
            }
        }
    }
}

/// Sets bit k where a place lies in the direction of edge k and not too near.
#[inline(always)]
fn flag_directions(here: &Saddle, x: &[f32], y: &[f32], flags: &mut [u8]) {
    for ((&x, &y), flag) in x.iter().zip(y).zip(flags) {
        let (dx, dy) = (x - here.x, y - here.y);
        let square = dx * dx + dy * dy;
        let least = MIN_COS * MIN_COS * square;
        let mut bits = 0;
        for k in 0..4 {
            let along = dx * here.edges[k][0] + dy * here.edges[k][1];
            // Its magnitude with its sign: one comparison for both conditions.
            bits |= u8::from(along * along.abs() >= least) << k;
        }
        *flag = if square >= MIN_SPACING * MIN_SPACING { bits } else { 0 };
    }
}
