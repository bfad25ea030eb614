//! Marker dictionaries.

use super::Error;

/// A set of square binary markers. Codes hold the bits row by row from the top left, first bit highest, white = 1,
/// without the black border of one cell that surrounds every marker.
#[derive(Clone, Debug, PartialEq)]
pub struct Dictionary {
    pub(super) name: String,
    pub(super) bits: usize,
    pub(super) codes: Vec<u64>,
}

/// name, file, prefix length: OpenCV's smaller dictionaries are prefixes of the largest of their family.
macro_rules! predefined {
    ($($name:literal, $file:literal, $n:literal;)*) => {
        const PREDEFINED: &[(&str, &str, usize)] =
            &[$(($name, include_str!(concat!("dictionaries/", $file, ".hex")), $n)),*];
        impl Dictionary {
            /// The names of OpenCV's predefined dictionaries, without the prefix `DICT_`.
            pub const NAMES: &[&str] = &[$($name),*];
        }
    };
}

predefined! {
    "4X4_50", "4x4", 50;
    "4X4_100", "4x4", 100;
    "4X4_250", "4x4", 250;
    "4X4_1000", "4x4", 1000;
    "5X5_50", "5x5", 50;
    "5X5_100", "5x5", 100;
    "5X5_250", "5x5", 250;
    "5X5_1000", "5x5", 1000;
    "6X6_50", "6x6", 50;
    "6X6_100", "6x6", 100;
    "6X6_250", "6x6", 250;
    "6X6_1000", "6x6", 1000;
    "7X7_50", "7x7", 50;
    "7X7_100", "7x7", 100;
    "7X7_250", "7x7", 250;
    "7X7_1000", "7x7", 1000;
    "ARUCO_ORIGINAL", "aruco_original", 1024;
    "APRILTAG_16h5", "apriltag_16h5", 30;
    "APRILTAG_25h9", "apriltag_25h9", 35;
    "APRILTAG_36h10", "apriltag_36h10", 2320;
    "APRILTAG_36h11", "apriltag_36h11", 587;
    "ARUCO_MIP_36h12", "aruco_mip_36h12", 250;
}

impl Dictionary {
    /// One of OpenCV's predefined dictionaries, by its name with or without the prefixes `DICT_` and `ARUCO_`, in any
    /// case.
    pub fn predefined(name: &str) -> Result<Self, Error> {
        let bare =
            name.strip_prefix("DICT_").or_else(|| name.strip_prefix("dict_")).unwrap_or(name);
        let (name, text, n) = PREDEFINED
            .iter()
            .find(|(known, ..)| {
                let short = known.strip_prefix("ARUCO_").unwrap_or(known);
                [*known, short].iter().any(|name| name.eq_ignore_ascii_case(bare))
            })
            .ok_or_else(|| Error::Dictionary(name.to_owned()))?;
        let mut lines = text.lines();
        let header = lines.next().expect("the tables shipped with the library have a header");
        let bits = header
            .split_whitespace()
            .nth(2)
            .and_then(|size| size.split('x').next()?.parse().ok())
            .expect("the header tells the size");
        let codes = lines
            .take(*n)
            .map(|line| {
                u64::from_str_radix(line, 16)
                    .expect("the tables shipped with the library are hexadecimal")
            })
            .collect();
        Ok(Self { name: (*name).to_owned(), bits, codes })
    }

    /// The name, without the prefix `DICT_`; of a dictionary of one's own, the name of its file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Bits along one side of a marker, border not counted.
    pub fn bits(&self) -> usize {
        self.bits
    }

    /// How many markers there are.
    pub fn len(&self) -> usize {
        self.codes.len()
    }

    /// True for a dictionary without markers.
    pub fn is_empty(&self) -> bool {
        self.codes.is_empty()
    }

    /// The code of marker `id`; `None` beyond the last.
    pub fn code(&self, id: usize) -> Option<u64> {
        self.codes.get(id).copied()
    }

    /// True where the cell at (`row`, `column`) of marker `id` is white; the border (row or column 0 and `bits + 1`)
    /// is black. Panics beyond the last marker or outside the (bits + 2)² cells.
    pub fn is_white(&self, id: usize, row: usize, column: usize) -> bool {
        let n = self.bits;
        assert!(row < n + 2 && column < n + 2, "cell ({row}, {column}) of a {n}x{n} marker");
        if row == 0 || column == 0 || row == n + 1 || column == n + 1 {
            return false;
        }
        self.codes[id] >> (n * n - 1 - ((row - 1) * n + column - 1)) & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_predefined_dictionary_reads() {
        for (name, (_, _, n)) in Dictionary::NAMES.iter().zip(PREDEFINED) {
            let dictionary = Dictionary::predefined(name).unwrap();
            assert_eq!(dictionary.len(), *n, "{name}");
            let limit = 1u128 << (dictionary.bits() * dictionary.bits());
            assert!((0..*n).all(|i| u128::from(dictionary.code(i).unwrap()) < limit), "{name}");
        }
        assert!(Dictionary::predefined("DICT_aruco_original").is_ok());
        for name in ["MIP_36h12", "dict_mip_36H12"] {
            assert_eq!(Dictionary::predefined(name).unwrap().name(), "ARUCO_MIP_36h12");
        }
        assert!(Dictionary::predefined("8X8_50").is_err());
    }

    /// The original ArUco code writes ten bits of id as five words, two bits each, of this Hamming-like code
    /// (Garrido-Jurado et al. 2014, section 2; the table is `FiducidalMarkers.cpp` of ArUco 1.x).
    #[test]
    fn aruco_original_follows_its_code() {
        let dictionary = Dictionary::predefined("ARUCO_ORIGINAL").unwrap();
        let words = [0b10000, 0b10111, 0b01001, 0b01110];
        for id in 0..1024 {
            let code = (0..5).fold(0, |code, row| code << 5 | words[id >> (8 - 2 * row) & 3]);
            assert_eq!(dictionary.code(id), Some(code), "marker {id}");
        }
    }
}
