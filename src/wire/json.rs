//! JSON that is the same bytes on every machine and that a person can read.

use std::io;

use serde::Serialize;
use serde_json::ser::{Formatter, PrettyFormatter};

/// Digits kept of a number. Nine are far more than any measurement here deserves, and few enough that the last bits
/// of a platform's sine do not change the file.
const SIGNIFICANT_DIGITS: usize = 9;

/// The value as indented JSON with a final newline, lists on one line with what is in them. Numbers carry nine
/// significant digits; a number that is not finite becomes `null`.
pub(super) fn to_json<T: Serialize>(value: &T) -> String {
    let mut bytes = Vec::new();
    let layout = Layout { objects: PrettyFormatter::new() };
    value
        .serialize(&mut serde_json::Serializer::with_formatter(&mut bytes, layout))
        .expect("documents have string keys and writing to memory does not fail");
    bytes.push(b'\n');
    String::from_utf8(bytes).expect("serde_json writes UTF-8")
}

struct Layout {
    objects: PrettyFormatter<'static>,
}

impl Formatter for Layout {
    fn write_f64<W: ?Sized + io::Write>(&mut self, writer: &mut W, value: f64) -> io::Result<()> {
        // Rust prints the shortest text that reads back as the same number; whole numbers keep a `.0`.
        write!(writer, "{:?}", rounded(value))
    }

    fn begin_array_value<W: ?Sized + io::Write>(
        &mut self,
        to: &mut W,
        first: bool,
    ) -> io::Result<()> {
        to.write_all(if first { b"" } else { b", " })
    }

    fn begin_object<W: ?Sized + io::Write>(&mut self, to: &mut W) -> io::Result<()> {
        self.objects.begin_object(to)
    }

    fn end_object<W: ?Sized + io::Write>(&mut self, to: &mut W) -> io::Result<()> {
        self.objects.end_object(to)
    }

    fn begin_object_key<W: ?Sized + io::Write>(
        &mut self,
        to: &mut W,
        first: bool,
    ) -> io::Result<()> {
        self.objects.begin_object_key(to, first)
    }

    fn begin_object_value<W: ?Sized + io::Write>(&mut self, to: &mut W) -> io::Result<()> {
        self.objects.begin_object_value(to)
    }

    fn end_object_value<W: ?Sized + io::Write>(&mut self, to: &mut W) -> io::Result<()> {
        self.objects.end_object_value(to)
    }
}

/// Rounds to [`SIGNIFICANT_DIGITS`].
fn rounded(value: f64) -> f64 {
    let text = format!("{value:.*e}", SIGNIFICANT_DIGITS - 1);
    let rounded: f64 = text.parse().expect("what was printed as a number reads as one");
    if rounded == 0.0 { 0.0 } else { rounded } // Not −0.
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_and_finite() {
        let values = [1.0 / 3.0, 596.0, -1e-20, f64::NAN, f64::INFINITY, -0.0, 123456789.123];
        let text = to_json(&serde_json::json!({"e": {}, "l": []}));
        assert_eq!(text, "{\n  \"e\": {},\n  \"l\": []\n}\n");
        assert_eq!(
            to_json(&std::collections::BTreeMap::from([("values", values)])),
            "{\n  \"values\": [0.333333333, 596.0, -1e-20, null, null, 0.0, 123456789.0]\n}\n"
        );
    }
}
