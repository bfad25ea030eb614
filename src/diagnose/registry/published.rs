//! The device tables of arXiv:2201.10865, row by row as printed.

use super::{Api, Entry, KnownIssue, Sheet};

/// One printed row: distortion centre, reference dimensions, depth focal length and centre, colour focal length and
/// centre; pixels.
type Row = ([f64; 2], [f64; 2], f64, [f64; 2], f64, [f64; 2]);

const UWA: [f64; 2] = [2016.0, 1512.0];
const UWA_AR: [f64; 2] = [2880.0, 2160.0];
const SEVEN: [f64; 2] = [3088.0, 2316.0];
const SEVEN_AR: [f64; 2] = [3248.0, 2436.0];
const PHONE: [f64; 2] = [4032.0, 3024.0];

const IPAD_11_3: (&str, &str) = ("ipad-11-3gen", "iPad Pro 11-inch (3rd generation)");
const IPAD_12_5: (&str, &str) = ("ipad-12.9-5gen", "iPad Pro 12.9-inch (5th generation)");
const IPAD_11_2: (&str, &str) = ("ipad-11-2gen", "iPad Pro 11-inch (2nd generation)");
const IPAD_12_4: (&str, &str) = ("ipad-12.9-4gen", "iPad Pro 12.9-inch (4th generation)");
const IPHONE_11: (&str, &str) = ("iphone-11-pro", "iPhone 11 Pro");

/// Device, version, AVFoundation's row, ARKit's row.
#[rustfmt::skip]
const TABLE: [((&str, &str), &str, Row, Row); 10] = [
    (IPAD_11_3, "v1",
        ([1011.80, 754.60], UWA, 1791.13, [1012.10, 754.53], 568.61, [321.23, 239.47]),
        ([1428.30, 1080.89], UWA_AR, 1925.71, [1426.63, 1080.95], 962.86, [713.06, 539.72])),
    (IPAD_11_3, "v2",
        ([1013.80, 757.30], UWA, 1784.44, [1014.24, 757.43], 566.49, [321.91, 240.39]),
        ([1428.80, 1078.69], UWA_AR, 1917.50, [1427.21, 1078.42], 958.75, [713.35, 538.46])),
    (IPAD_12_5, "ios14",
        ([1009.73, 759.42], UWA, 1781.78, [1009.89, 759.69], 565.64, [320.53, 242.10]),
        ([1426.73, 1077.07], UWA_AR, 1916.17, [1424.82, 1076.56], 958.08, [712.16, 537.53])),
    (IPAD_12_5, "ios15",
        ([1009.73, 759.42], UWA, 1780.13, [1009.89, 759.69], 565.12, [320.53, 242.10]),
        ([1426.73, 1077.07], UWA_AR, 1914.39, [1424.82, 1076.56], 957.19, [712.16, 537.53])),
    (IPAD_11_2, "v1",
        ([1543.98, 1147.17], SEVEN, 2878.39, [1543.98, 1147.17], 596.55, [319.60, 237.36]),
        ([1624.48, 1226.32], SEVEN_AR, 2878.39, [1624.48, 1226.32], 1276.13, [719.93, 542.96])),
    (IPAD_11_2, "v2",
        ([1541.02, 1155.53], SEVEN, 2882.66, [1541.02, 1155.53], 597.44, [318.98, 239.09]),
        ([1621.52, 1217.96], SEVEN_AR, 2882.66, [1621.52, 1217.96], 1278.02, [718.62, 539.26])),
    (IPAD_12_4, "v1",
        ([1538.43, 1151.34], SEVEN, 2885.64, [1538.43, 1151.34], 598.06, [318.45, 238.22]),
        ([1618.93, 1222.15], SEVEN_AR, 2885.64, [1618.93, 1222.15], 1279.35, [717.47, 541.12])),
    (IPAD_12_4, "v2",
        ([1535.93, 1157.79], SEVEN, 2872.52, [1535.93, 1157.79], 595.33, [317.93, 239.56]),
        ([1616.43, 1215.70], SEVEN_AR, 2872.51, [1616.43, 1215.70], 1273.52, [716.36, 538.26])),
    (IPHONE_11, "ios14",
        ([2026.13, 1508.71], PHONE, 2751.18, [2026.13, 1508.71], 437.29, [321.18, 239.05]),
        ([2026.63, 1514.78], PHONE, 2751.18, [2026.63, 1514.78], 982.56, [723.47, 540.31])),
    (IPHONE_11, "ios15",
        ([2026.13, 1508.71], PHONE, 2750.68, [2026.13, 1508.71], 436.61, [321.18, 239.05]),
        ([2026.63, 1514.78], PHONE, 2750.68, [2026.63, 1514.78], 982.38, [723.47, 540.31])),
];

/// All twenty rows, AVFoundation before ARKit.
pub(super) fn entries() -> Vec<Entry> {
    TABLE
        .iter()
        .flat_map(|&((device, product), version, av, ar)| {
            [(Api::AvFoundation, av), (Api::ArKit, ar)].map(
                |(api, (distortion_center, reference, focal_px, center, color_focal, color))| {
                    Entry {
                        device: device.to_owned(),
                        product: product.to_owned(),
                        version: version.to_owned(),
                        api,
                        sheet: Sheet {
                            reference,
                            focal_px,
                            center,
                            distortion_center: Some(distortion_center),
                            color_focal_px: Some(color_focal),
                            color_center: Some(color),
                        },
                        issues: issues(device, api),
                        source: "arXiv:2201.10865".to_owned(),
                    }
                },
            )
        })
        .collect()
}

/// The paper's issues 1 and 2; that the streams of the two older cameras are not rectified is this project's own
/// finding on the paper's published recordings (`docs/method`).
fn issues(device: &str, api: Api) -> Vec<KnownIssue> {
    match (device, api) {
        ("ipad-11-3gen" | "ipad-12.9-5gen", _) => vec![KnownIssue::FocalLength],
        ("ipad-11-2gen" | "ipad-12.9-4gen", Api::ArKit) => vec![KnownIssue::DepthZoom],
        ("ipad-12.9-4gen" | "iphone-11-pro", Api::AvFoundation) => vec![KnownIssue::NotRectified],
        _ => Vec::new(),
    }
}
