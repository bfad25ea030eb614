//! Dictionaries of one's own, in OpenCV's YAML form.

use super::{Dictionary, Error};

/// Sides of a marker that fit: a code has 64 bits, and below 3 there are not two markers to tell apart.
const SIDES: std::ops::RangeInclusive<usize> = 3..=8;

/// Ten times OpenCV's largest dictionary; what asks for more is no dictionary.
const MAX_MARKERS: usize = 10_000;

impl Dictionary {
    /// True for a name that is that of a file: it ends in `.yml` or `.yaml`.
    pub fn is_file(name: &str) -> bool {
        name.rsplit_once('.').is_some_and(|(_, extension)| {
            extension.eq_ignore_ascii_case("yml") || extension.eq_ignore_ascii_case("yaml")
        })
    }

    /// A dictionary in the form that OpenCV's `Dictionary::readDictionary` reads and `writeDictionary` writes; `file`
    /// is the name of its file, without folders, and becomes that of the dictionary.
    ///
    /// ```text
    /// %YAML:1.0
    /// nmarkers: 35
    /// markersize: 6
    /// maxCorrectionBits: 3
    /// marker_0: "101011111011111001001001101100000000"
    /// ```
    ///
    /// Bits stand row by row from the top left, 1 is white, the black border is left out. Refused, with the line: a
    /// side other than 3 to 8, more than 10000 markers, a marker that is missing, stands twice or has another number
    /// of bits, keys that OpenCV does not write. `maxCorrectionBits` may be missing and is not used: the detector
    /// weighs all markers together and corrects none by itself. Of YAML no more is understood than OpenCV writes:
    /// one key and value per line, comments, and the lines that begin and end a document.
    pub fn from_opencv_yaml(file: &str, text: &str) -> Result<Self, Error> {
        let fail = |line: usize, why: String| Error::DictionaryFile {
            file: file.escape_debug().to_string(),
            line,
            why,
        };
        let is_plain = !file.contains(|c: char| c.is_control() || "/\\:\"".contains(c));
        if !Self::is_file(file) || !is_plain {
            let why = "not the name of a dictionary's file; it must end in .yml or .yaml and have none of / \\ : \"";
            return Err(fail(1, why.to_owned()));
        }

        let (mut n_markers, mut bits) = (None, None);
        let mut markers: Vec<(usize, usize, &str)> = Vec::new(); // line, id, bits
        let mut n_lines = 0;
        for (index, whole) in text.lines().enumerate() {
            n_lines = index + 1;
            let content = whole.split('#').next().unwrap_or_default().trim();
            if content.is_empty() || content.starts_with('%') || matches!(content, "---" | "...") {
                continue;
            }
            let (key, value) =
                content.split_once(':').map(|(key, value)| (key.trim(), value.trim())).ok_or_else(
                    || fail(n_lines, format!("`{}` is not `key: value`", shown(content))),
                )?;
            let value =
                value.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(value);
            let number = |range: std::ops::RangeInclusive<usize>| {
                value.parse().ok().filter(|n| range.contains(n)).ok_or_else(|| {
                    let (low, high) = (range.start(), range.end());
                    let value = shown(value);
                    fail(
                        n_lines,
                        format!("{key} is `{value}`; it takes a number from {low} to {high}"),
                    )
                })
            };
            let once = |slot: Option<usize>| match slot {
                Some(_) => Err(fail(n_lines, format!("{key} stands here a second time"))),
                None => Ok(()),
            };
            match key {
                "nmarkers" => {
                    once(n_markers)?;
                    n_markers = Some(number(1..=MAX_MARKERS)?);
                }
                "markersize" => {
                    once(bits)?;
                    bits = Some(number(SIDES)?);
                }
                "maxCorrectionBits" => {
                    number(0..=SIDES.end() * SIDES.end())?;
                }
                _ => {
                    let id = key
                        .strip_prefix("marker_")
                        .and_then(|id| id.parse().ok())
                        .ok_or_else(|| {
                            let key = shown(key);
                            fail(
                                n_lines,
                                format!(
                                    "unknown key `{key}`; known are nmarkers, markersize, \
                                               maxCorrectionBits, marker_0, marker_1, ..."
                                ),
                            )
                        })?;
                    markers.push((n_lines, id, value));
                }
            }
        }

        let missing = |key: &str| fail(n_lines.max(1), format!("the file ends without {key}"));
        let n_markers = n_markers.ok_or_else(|| missing("nmarkers"))?;
        let bits = bits.ok_or_else(|| missing("markersize"))?;
        let mut codes: Vec<Option<u64>> = vec![None; n_markers];
        for (line, id, value) in markers {
            let slot = codes.get_mut(id).ok_or_else(|| {
                fail(line, format!("marker_{id} is beyond nmarkers, which is {n_markers}"))
            })?;
            if slot.is_some() {
                return Err(fail(line, format!("marker_{id} stands here a second time")));
            }
            let n_bits = bits * bits;
            if value.len() != n_bits || value.contains(|c| c != '0' && c != '1') {
                let why = format!(
                    "marker_{id} takes {n_bits} digits 0 or 1 ({bits}x{bits}), not `{}`",
                    shown(value)
                );
                return Err(fail(line, why));
            }
            *slot = Some(value.bytes().fold(0, |code, bit| code << 1 | u64::from(bit == b'1')));
        }
        let codes = codes
            .into_iter()
            .enumerate()
            .map(|(id, code)| code.ok_or_else(|| missing(&format!("marker_{id}"))))
            .collect::<Result<_, _>>()?;
        Ok(Self { name: file.to_owned(), bits, codes })
    }

    /// The dictionary in OpenCV's YAML form; [`from_opencv_yaml`](Self::from_opencv_yaml) reads it back.
    pub fn to_opencv_yaml(&self) -> String {
        // OpenCV refuses a file without this line.
        let mut text = String::from("%YAML:1.0\n---\n");
        text +=
            &format!("nmarkers: {}\nmarkersize: {}\nmaxCorrectionBits: 0\n", self.len(), self.bits);
        for (id, code) in self.codes.iter().enumerate() {
            text += &format!("marker_{id}: \"{code:0width$b}\"\n", width = self.bits * self.bits);
        }
        text
    }
}

/// What stood in a file, fit for a message.
fn shown(text: &str) -> String {
    let start: String = text.chars().take(80).collect();
    start.escape_debug().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    const MINE: &str = "%YAML:1.0\n---\nnmarkers: 2\nmarkersize: 3\nmaxCorrectionBits: 1\n\
                        marker_0: \"110000001\"\nmarker_1: 011001010 # bare\n...\n";

    #[test]
    fn every_dictionary_reads_back() {
        for name in Dictionary::NAMES {
            let mut dictionary = Dictionary::predefined(name).unwrap();
            dictionary.name = "mine.yml".to_owned();
            let text = dictionary.to_opencv_yaml();
            assert_eq!(Dictionary::from_opencv_yaml("mine.yml", &text), Ok(dictionary), "{name}");
        }
    }

    #[test]
    fn bits_stand_row_by_row() {
        let mine = Dictionary::from_opencv_yaml("mine.yml", MINE).unwrap();
        assert_eq!((mine.name(), mine.bits(), mine.len()), ("mine.yml", 3, 2));
        assert_eq!(mine.code(1), Some(0b011_001_010));
        assert!(mine.is_white(0, 1, 1) && mine.is_white(0, 1, 2) && !mine.is_white(0, 1, 3));
        assert!(mine.is_white(0, 3, 3) && !mine.is_white(0, 2, 1));
        let eight = format!("nmarkers: 1\nmarkersize: 8\nmarker_0: \"{}\"\n", "1".repeat(64));
        let eight = Dictionary::from_opencv_yaml("8.yaml", &eight).unwrap();
        assert_eq!(eight.code(0), Some(u64::MAX));
    }

    #[test]
    fn bad_files_name_the_line() {
        for (from, to, line, expected) in [
            ("markersize: 3", "markersize: 9", 4, "from 3 to 8"),
            ("markersize: 3", "markersize: 2", 4, "from 3 to 8"),
            ("nmarkers: 2", "nmarkers: 0", 3, "from 1 to 10000"),
            ("nmarkers: 2", "nmarkers: 10001", 3, "from 1 to 10000"),
            ("nmarkers: 2", "nmarkers: two", 3, "`two`"),
            ("nmarkers: 2", "nmarkers: 3", 8, "without marker_2"),
            ("nmarkers: 2", "nmarkers: 1", 7, "beyond nmarkers"),
            ("nmarkers: 2\n", "", 7, "without nmarkers"),
            ("markersize: 3\n", "", 7, "without markersize"),
            ("markersize: 3", "nmarkers: 3", 4, "second time"),
            ("marker_1", "marker_0", 7, "second time"),
            ("011001010", "01100101", 7, "9 digits"),
            ("011001010", "01100101x", 7, "9 digits"),
            ("011001010", "01100101\u{1b}", 7, "\\u{1b}"),
            ("marker_1", "maker_1", 7, "unknown key"),
            ("marker_1:", "marker_1", 7, "key: value"),
        ] {
            let text = MINE.replace(from, to);
            let error = Dictionary::from_opencv_yaml("mine.yml", &text).unwrap_err().to_string();
            let start = format!("mine.yml, line {line}: ");
            assert!(error.starts_with(&start) && error.contains(expected), "{to}: {error}");
            assert!(!error.contains('\u{1b}'), "{error}");
        }
        for name in ["mine.toml", "a/mine.yml", "a\\mine.yml", "a:mine.yml", "\"mine\".yml", "yml"]
        {
            assert!(Dictionary::from_opencv_yaml(name, MINE).is_err(), "{name}");
        }
        assert!(Dictionary::from_opencv_yaml("mine.yml", "").is_err());
    }
}
