//! A user's own devices.

use serde::Deserialize;

use super::{Api, Entry, KnownIssue, Registry, Sheet};

/// A file of devices that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {why}")]
pub struct RegistryError {
    /// The file.
    pub file: String,
    /// What is wrong with it, and the remedy.
    pub why: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    device: Vec<Row>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    name: String,
    product: Option<String>,
    version: String,
    api: String,
    reference: [f64; 2],
    focal_px: f64,
    center_px: [f64; 2],
    distortion_center_px: Option<[f64; 2]>,
    color_focal_px: Option<f64>,
    color_center_px: Option<[f64; 2]>,
    #[serde(default)]
    issues: Vec<String>,
}

impl Registry {
    /// Adds the devices of a TOML file; they go before published ones of the same name.
    ///
    /// ```
    /// use truedepth::diagnose::Registry;
    ///
    /// let mut registry = Registry::published();
    /// registry.extend(
    ///     "mine.toml",
    ///     r#"
    /// [[device]]
    /// name = "my-ipad"                       # letters, digits, dots and hyphens
    /// version = "ios18"
    /// api = "av"                             # or "ar"
    /// reference = [4032.0, 3024.0]           # intrinsicMatrixReferenceDimensions
    /// focal_px = 2754.3                      # at the reference dimensions, as all that follows
    /// center_px = [2020.1, 1511.9]
    /// distortion_center_px = [2020.1, 1511.9]  # optional
    /// issues = ["not-rectified"]             # optional: depth-zoom, focal-length, not-rectified
    /// "#,
    /// )?;
    /// assert_eq!(registry.get("my-ipad/ios18/av").unwrap().sheet.focal_px, 2754.3);
    /// # Ok::<(), truedepth::diagnose::RegistryError>(())
    /// ```
    pub fn extend(&mut self, file: &str, text: &str) -> Result<(), RegistryError> {
        let fail = |why: String| RegistryError { file: file.to_owned(), why };
        let rows: File = toml::from_str(text).map_err(|e| {
            fail(format!("{}; `truedepth compare --help` shows the form", e.to_string().trim()))
        })?;
        for row in rows.device {
            let entry = entry(row).map_err(&fail)?;
            let name = entry.name();
            self.entries.retain(|other| !other.name().eq_ignore_ascii_case(&name));
            self.entries.push(entry);
        }
        Ok(())
    }
}

fn entry(row: Row) -> Result<Entry, String> {
    let word = |text: &str| {
        !text.is_empty()
            && text.len() <= 40
            && text.chars().all(|c| c.is_ascii_alphanumeric() || "._-".contains(c))
    };
    for text in [&row.name, &row.version] {
        if !word(text) {
            return Err(format!(
                "`{}` is no name: take up to 40 letters, digits, dots and hyphens",
                text.escape_debug()
            ));
        }
    }
    let name = &row.name;
    let api = match row.api.as_str() {
        "av" => Api::AvFoundation,
        "ar" => Api::ArKit,
        other => {
            return Err(format!(
                "{name}: api is `{}`, it must be \"av\" or \"ar\"",
                other.escape_debug()
            ));
        }
    };
    let [width, height] = row.reference;
    if !(1.0..=1e5).contains(&width) || !(1.0..=1e5).contains(&height) {
        return Err(format!(
            "{name}: reference is {width}x{height}; it must be 1 to 100000 pixels"
        ));
    }
    let focal_range = 0.04 * width.max(height)..=100.0 * width.max(height);
    if !focal_range.contains(&row.focal_px) {
        return Err(format!(
            "{name}: focal_px is {}; at {width}x{height} it must be {} to {}",
            row.focal_px,
            focal_range.start(),
            focal_range.end()
        ));
    }
    let places = [Some(row.center_px), row.distortion_center_px];
    for [x, y] in places.into_iter().flatten() {
        if !(x > -0.5 * width && x < 1.5 * width && y > -0.5 * height && y < 1.5 * height) {
            return Err(format!("{name}: ({x}, {y}) is no centre of an image of {width}x{height}"));
        }
    }
    let color = row.color_focal_px.iter().chain(row.color_center_px.iter().flatten());
    if let Some(number) = color.into_iter().find(|n| !(n.is_finite() && **n > 0.0)) {
        return Err(format!("{name}: {number} is no number of pixels"));
    }
    let issues = row
        .issues
        .iter()
        .map(|issue| {
            KnownIssue::ALL.into_iter().find(|known| known.name() == issue).ok_or_else(|| {
                format!(
                    "{name}: `{}` is no known issue; take {}",
                    issue.escape_debug(),
                    KnownIssue::ALL.map(KnownIssue::name).join(", ")
                )
            })
        })
        .collect::<Result<_, _>>()?;
    Ok(Entry {
        product: row.product.unwrap_or_else(|| row.name.clone()),
        device: row.name,
        version: row.version,
        api,
        sheet: Sheet {
            reference: row.reference,
            focal_px: row.focal_px,
            center: row.center_px,
            distortion_center: row.distortion_center_px,
            color_focal_px: row.color_focal_px,
            color_center: row.color_center_px,
        },
        issues,
        source: "your own file".to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "[[device]]\nname = \"x\"\nversion = \"1\"\napi = \"ar\"\nreference = [2880.0, 2160.0]\n\
                        focal_px = 1900.0\ncenter_px = [1440.0, 1080.0]\n";

    #[test]
    fn a_row_replaces_its_namesake_and_bad_rows_say_what_is_wrong() {
        let mut registry = Registry::published();
        registry.extend("f", GOOD).unwrap();
        registry.extend("f", &GOOD.replace("1900", "1901")).unwrap();
        assert_eq!(registry.entries().len(), 21);
        assert_eq!(registry.get("X/1/AR").unwrap().sheet.focal_px, 1901.0);
        for (from, to, word) in [
            ("\"ar\"", "\"both\"", "must be \"av\" or \"ar\""),
            ("1900.0", "19.0", "it must be"),
            ("1900.0", "nan", "it must be"),
            ("[1440.0, ", "[14400.0, ", "no centre"),
            ("\"x\"", "\"a/b\"", "no name"),
            ("focal_px", "focal", "unknown field"),
            ("api = \"ar\"", "api = \"ar\"\nissues = [\"zoom\"]", "depth-zoom"),
            ("2880.0", "0.0", "1 to 100000"),
        ] {
            let error = registry.extend("f.toml", &GOOD.replace(from, to)).unwrap_err().to_string();
            assert!(error.starts_with("f.toml: ") && error.contains(word), "{error}");
        }
    }
}
