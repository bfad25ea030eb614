//! What is round the sheet.

/// The wall the sheet is taped to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wall {
    /// Of one colour.
    Plain {
        /// 0 to 1.
        reflectance: f64,
    },
}

impl Wall {
    /// Reflectance of the bare wall, 0 to 1.
    pub(super) fn reflectance(&self) -> f64 {
        match self {
            Self::Plain { reflectance } => *reflectance,
        }
    }
}
