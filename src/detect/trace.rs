//! The steps between an image and an observation, for people to look at.

use crate::{geom::Pixel, image::Gray};

use super::{
    Detector, Observation,
    detector::{factors, most_saddles},
    lattice::lattices,
    pyramid::Level,
    saddle::{self, saddles},
};

/// What the detector sees on its way, on the first level on which saddles join to lattices.
///
/// For pictures and for finding out why a board is missed; costs about twice a detection. All positions are those of
/// the image.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Image pixels per pixel of the level, along one axis.
    pub factor: usize,
    /// The smoothed level.
    pub level: Gray,
    /// Crossings of two edges, strongest first: place, and unit vectors along the four edges.
    pub saddles: Vec<(Pixel, [[f64; 2]; 4])>,
    /// Lattices of at least six nodes (four, where the board has no more), largest
    /// first: the nodes' numbers along both axes and their places.
    pub lattices: Vec<Vec<([i32; 2], Pixel)>>,
    /// What came of it.
    pub observation: Observation,
}

impl Detector {
    /// The steps that [`detect`](Self::detect) takes, and its result; `None` where no level shows a lattice.
    pub fn trace(&self, image: &Gray) -> Option<Trace> {
        let (mut level, mut memory) = (Level::default(), saddle::Memory::default());
        for factor in factors(image) {
            if level.fill(image, factor).is_none() {
                continue;
            }
            let saddles = saddles(&level, most_saddles(&level), &mut memory);
            let lattices = lattices(&level, &saddles, self.min_nodes());
            if lattices.is_empty() {
                continue;
            }
            return Some(Trace {
                factor,
                level: level.to_gray(),
                saddles: saddles
                    .iter()
                    .map(|s| (level.to_image(s.x, s.y), s.edges.map(|e| e.map(f64::from))))
                    .collect(),
                lattices: lattices
                    .iter()
                    .map(|l| l.nodes.iter().map(|n| ([n.i, n.j], n.pixel)).collect())
                    .collect(),
                observation: self.detect(image),
            });
        }
        None
    }
}
