//! Least squares, robust losses, covariance and statistics; knows no cameras.
//!
//! A problem with few shared parameters and many independent blocks implements [`Bordered`]; wrapped as [`BySchur`] it
//! is minimised by [`minimize`] (Levenberg-Marquardt). At the minimum each block is [`Reduced`] to what it says about
//! the shared parameters; [`Pooled`], these give covariances and held-out errors.
//!
//! Residuals are *observed − predicted*, derivatives are those of the prediction.
//!
//! ```
//! use truedepth::solve::{Arrow, BlockNormal, Bordered, BySchur, Effort, Row, minimize};
//!
//! /// Lines of one common slope, each with its own offset.
//! struct Lines([Vec<(f64, f64)>; 2]);
//!
//! impl Bordered<1> for Lines {
//!     type Block = f64;
//!     fn linearize_block(
//!         &self,
//!         i: usize,
//!         shared: &[f64],
//!         _loose: &[f64],
//!         offset: &f64,
//!         n: &mut BlockNormal<1>,
//!     ) -> bool {
//!         for &(x, y) in &self.0[i] {
//!             let residual = y - (shared[0] * x + offset);
//!             n.add_row(&Row { weight: 1.0, residual, d_block: [1.0] }, &[x]);
//!             n.add_cost(0.5 * residual * residual);
//!         }
//!         true
//!     }
//!     fn advance_block(&self, offset: &f64, [step]: &[f64; 1]) -> f64 {
//!         offset + step
//!     }
//! }
//!
//! let lines = Lines([vec![(0.0, 1.0), (1.0, 3.0)], vec![(0.0, 5.0), (2.0, 9.0)]]);
//! let start = Arrow { shared: vec![0.0], loose: Vec::new(), blocks: vec![0.0; 2] };
//! let minimum = minimize(&BySchur(&lines), start, Effort::default()).expect("in the domain");
//! assert!((minimum.state.shared[0] - 2.0).abs() < 1e-9);
//! assert!((minimum.state.blocks[1] - 5.0).abs() < 1e-9);
//! ```
//!
//! Not here: cameras, poses, pixels; large or sparse systems of other shapes.

mod stats;

mod loss;

mod cholesky;

mod lm;

mod schur;

mod lanes;

mod mixture;

mod covariance;

pub use cholesky::{Cholesky, DenseCholesky};
pub use covariance::{LeftOut, Pooled, covariance_of, larger, total, units};
pub(crate) use lanes::{LANES, MAX_PARAMETERS, NormalParts, Rows, Sums, sum};
pub use lm::{Effort, LeastSquares, Minimum, Solution, minimize};
pub use loss::Loss;
pub use mixture::Mixture;
pub use schur::{
    Arrow, ArrowNormal, BlockNormal, Bordered, BySchur, MAX_SHARED, Reduced, Response, Row,
};
pub use stats::{mad_sigma, mean, median, quantile, rms, standard_deviation, standard_error};
