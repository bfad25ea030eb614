//! Frames from the names of images and the timestamps of metadata: paired by time, never by position.

use std::collections::{BTreeMap, BTreeSet, btree_map::Entry};

use crate::recording::{Frame, FrameImage, Problem};

/// An image of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Color,
    Depth,
}

/// What a file name says: `rgb_<milliseconds>.png` or `depth_<milliseconds>.png`; the inner `None` is such a name
/// without a usable time. The outer `None` is any other file.
pub(super) fn parse_name(name: &str) -> Option<(Kind, Option<i64>)> {
    let stem = name.strip_suffix(".png")?;
    let (kind, digits) = stem
        .strip_prefix("rgb_")
        .map(|digits| (Kind::Color, digits))
        .or_else(|| Some((Kind::Depth, stem.strip_prefix("depth_")?)))?;
    // 12 digits of milliseconds are 31 years; a longer number is no time since boot, and would not fit into
    // nanoseconds.
    let usable = (1..=12).contains(&digits.len()) && digits.bytes().all(|b| b.is_ascii_digit());
    Some((kind, if usable { digits.parse().ok() } else { None }))
}

/// The images of one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Images {
    pub(super) color: Option<String>,
    pub(super) depth: Option<String>,
}

/// The images among `names`, by time.
pub(super) fn images<'a>(
    names: impl Iterator<Item = &'a str>,
    problems: &mut Vec<Problem>,
) -> BTreeMap<i64, Images> {
    let mut images: BTreeMap<i64, Images> = BTreeMap::new();
    let (mut unusable, mut duplicates) = (Vec::new(), Vec::new());
    // The order of names decides which of two images counts: it must not depend on the file system.
    for name in names.collect::<BTreeSet<_>>() {
        match parse_name(name) {
            None => {}
            Some((_, None)) => unusable.push(name.to_owned()),
            Some((kind, Some(timestamp))) => {
                let images = images.entry(timestamp).or_default();
                let slot = match kind {
                    Kind::Color => &mut images.color,
                    Kind::Depth => &mut images.depth,
                };
                if slot.is_some() {
                    duplicates.push(name.to_owned());
                } else {
                    *slot = Some(name.to_owned());
                }
            }
        }
    }
    if !unusable.is_empty() {
        problems.push(Problem::UnusableNames { names: unusable });
    }
    if !duplicates.is_empty() {
        problems.push(Problem::DuplicateImages { names: duplicates });
    }
    let lonely = |missing: fn(&Images) -> bool| -> Vec<i64> {
        images.iter().filter(|(_, images)| missing(images)).map(|(&t, _)| t).collect()
    };
    let timestamps = lonely(|images| images.depth.is_none());
    if !timestamps.is_empty() {
        problems.push(Problem::ColorWithoutDepth { timestamps });
    }
    let timestamps = lonely(|images| images.color.is_none());
    if !timestamps.is_empty() {
        problems.push(Problem::DepthWithoutColor { timestamps });
    }
    images
}

/// Records with their number in the file, by time; of several at one time the first counts.
pub(super) fn by_time<T>(
    file: &'static str,
    records: Vec<T>,
    timestamp: impl Fn(&T) -> i64,
    problems: &mut Vec<Problem>,
) -> BTreeMap<i64, (usize, T)> {
    let out_of_order = records.windows(2).map(|w| (timestamp(&w[0]), timestamp(&w[1])));
    if let Some((_, timestamp)) = out_of_order.into_iter().find(|(before, after)| after < before) {
        problems.push(Problem::MetadataOutOfOrder { file, timestamp });
    }
    let mut by_time = BTreeMap::new();
    let mut duplicates = BTreeSet::new();
    for (i, record) in records.into_iter().enumerate() {
        match by_time.entry(timestamp(&record)) {
            Entry::Vacant(entry) => drop(entry.insert((i + 1, record))),
            Entry::Occupied(entry) => drop(duplicates.insert(*entry.key())),
        }
    }
    if !duplicates.is_empty() {
        let timestamps = duplicates.into_iter().collect();
        problems.push(Problem::DuplicateMetadata { file, timestamps });
    }
    by_time
}

/// Frames in order of time; `complete` adds what the metadata say at a time.
pub(super) fn frames(
    images: BTreeMap<i64, Images>,
    mut complete: impl FnMut(i64, Frame) -> Frame,
) -> Vec<Frame> {
    let first = images.keys().next().copied().unwrap_or(0);
    images
        .into_iter()
        .map(|(timestamp, Images { color, depth })| {
            let frame = Frame {
                id: timestamp.to_string(),
                t_ns: (timestamp - first) * 1_000_000,
                color: color.map(FrameImage::named),
                depth: depth.map(FrameImage::named),
            };
            complete(timestamp, frame)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names() {
        use Kind::{Color, Depth};
        for (name, expected) in [
            ("rgb_0.png", Some((Color, Some(0)))),
            ("depth_633291.png", Some((Depth, Some(633_291)))),
            ("rgb_007.png", Some((Color, Some(7)))),
            ("rgb_999999999999.png", Some((Color, Some(999_999_999_999)))),
            ("rgb_9999999999999.png", Some((Color, None))),
            ("rgb_-1.png", Some((Color, None))),
            ("rgb_1.5.png", Some((Color, None))),
            ("rgb_.png", Some((Color, None))),
            ("depth_a.png", Some((Depth, None))),
            ("rgb_1.jpg", None),
            ("rgb_1.png.txt", None),
            ("._rgb_1.png", None),
            ("DepthMetadata.json", None),
        ] {
            assert_eq!(parse_name(name), expected, "{name}");
        }
    }

    #[test]
    fn images_pair_by_time() {
        let mut problems = Vec::new();
        let names =
            ["depth_20.png", "rgb_3.png", "rgb_20.png", "rgb_020.png", "depth_4.png", "rgb_x.png"];
        let images = images(names.into_iter(), &mut problems);
        assert_eq!(images.keys().copied().collect::<Vec<_>>(), [3, 4, 20]);
        // By name the one with the zero comes first.
        assert_eq!(images[&20].color.as_deref(), Some("rgb_020.png"));
        assert_eq!(images[&20].depth.as_deref(), Some("depth_20.png"));
        assert_eq!(
            problems,
            [
                Problem::UnusableNames { names: vec!["rgb_x.png".into()] },
                Problem::DuplicateImages { names: vec!["rgb_20.png".into()] },
                Problem::ColorWithoutDepth { timestamps: vec![3] },
                Problem::DepthWithoutColor { timestamps: vec![4] },
            ]
        );
        let frames = frames(images, |_, frame| frame);
        assert_eq!(frames.iter().map(|f| f.t_ns).collect::<Vec<_>>(), [0, 1_000_000, 17_000_000]);
    }

    #[test]
    fn records_pair_by_time() {
        let mut problems = Vec::new();
        let by_time =
            by_time("f", vec![(5, 'a'), (3, 'b'), (5, 'c'), (9, 'd')], |r| r.0, &mut problems);
        assert_eq!(by_time[&5], (1, (5, 'a')));
        assert_eq!(by_time[&9], (4, (9, 'd')));
        assert_eq!(
            problems,
            [
                Problem::MetadataOutOfOrder { file: "f", timestamp: 3 },
                Problem::DuplicateMetadata { file: "f", timestamps: vec![5] },
            ]
        );
    }
}
