//! The page's script: small modules in the order in which they use each other. No framework, nothing loaded.

/// Everything that can be read is in the page without it.
pub(super) const SCRIPT: &str = concat!(
    "\"use strict\";\n",
    include_str!("script/theme.js"),
    include_str!("script/tips.js"),
    include_str!("script/copy.js"),
    include_str!("script/gallery.js"),
    include_str!("script/closeups.js"),
    include_str!("script/compare.js"),
    include_str!("script/space.js"),
);
