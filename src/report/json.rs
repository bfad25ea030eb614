//! JSON that is the same bytes on every machine and that a person can read.

use std::io;

use serde::Serialize;
use serde_json::ser::Formatter;

/// Digits kept of a number. Nine are far more than any measurement here deserves, and few enough that the last bits
/// of a platform's sine do not change the file.
const SIGNIFICANT_DIGITS: usize = 9;

/// What fits into so many columns stays on one line: a corner, a frame, a principal point.
const LINE: usize = 110;

/// The value as indented JSON with a final newline. Numbers carry nine significant digits; a number that is not
/// finite becomes `null`.
pub fn to_json<T: Serialize>(value: &T) -> String {
    let mut bytes = Vec::new();
    let mut serializer = serde_json::Serializer::with_formatter(&mut bytes, OneLine);
    value
        .serialize(&mut serializer)
        .expect("wire types have string keys and writing to memory does not fail");
    let one_line = String::from_utf8(bytes).expect("serde_json writes UTF-8");
    let mut text = String::with_capacity(one_line.len() * 2);
    lay_out(&one_line, 0, &mut text);
    text.push('\n');
    text
}

/// Everything on one line, with a blank after commas and colons, and with rounded numbers.
struct OneLine;

impl Formatter for OneLine {
    fn write_f64<W: ?Sized + io::Write>(&mut self, writer: &mut W, value: f64) -> io::Result<()> {
        // Rust prints the shortest text that reads back as the same number; whole numbers keep a `.0`.
        write!(writer, "{:?}", rounded(value))
    }

    fn begin_array_value<W: ?Sized + io::Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        writer.write_all(if first { b"" } else { b", " })
    }

    fn begin_object_key<W: ?Sized + io::Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        writer.write_all(if first { b"" } else { b", " })
    }

    fn begin_object_value<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b": ")
    }
}

/// Rounds to [`SIGNIFICANT_DIGITS`].
fn rounded(value: f64) -> f64 {
    let text = format!("{value:.*e}", SIGNIFICANT_DIGITS - 1);
    let rounded: f64 = text.parse().expect("what was printed as a number reads as one");
    if rounded == 0.0 { 0.0 } else { rounded } // Not −0.
}

/// Breaks a JSON value written on one line where it is too long.
fn lay_out(value: &str, depth: usize, text: &mut String) {
    let is_container = value.starts_with(['{', '[']);
    if !is_container || 2 * depth + value.len() <= LINE && depth > 0 {
        text.push_str(value);
        return;
    }
    text.push_str(&value[..1]);
    for (index, item) in items(&value[1..value.len() - 1]).into_iter().enumerate() {
        text.push_str(if index == 0 { "\n" } else { ",\n" });
        text.push_str(&"  ".repeat(depth + 1));
        // `"key": value`, or a value alone.
        let key = if value.starts_with('{') { key_length(item) } else { 0 };
        text.push_str(&item[..key]);
        lay_out(&item[key..], depth + 1, text);
    }
    text.push('\n');
    text.push_str(&"  ".repeat(depth));
    text.push_str(&value[value.len() - 1..]);
}

/// The parts of the inside of a container, as [`OneLine`] separates them.
fn items(inside: &str) -> Vec<&str> {
    let mut items = Vec::new();
    let (mut start, mut depth, mut in_string, mut escaped) = (0, 0, false, false);
    for (at, byte) in inside.bytes().enumerate() {
        match byte {
            _ if escaped => escaped = false,
            b'\\' => escaped = true,
            b'"' => in_string = !in_string,
            _ if in_string => (),
            b'{' | b'[' => depth += 1,
            b'}' | b']' => depth -= 1,
            b',' if depth == 0 => {
                items.push(&inside[start..at]);
                start = at + 2;
            }
            _ => (),
        }
    }
    if start < inside.len() {
        items.push(&inside[start..]);
    }
    items
}

/// Length of `"key": ` at the start of an item; keys of wire types need no escape.
fn key_length(item: &str) -> usize {
    item.find("\": ").map_or(0, |at| at + 3)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn numbers_are_rounded_and_finite() {
        let values = [1.0 / 3.0, 596.0, -1e-20, f64::NAN, f64::INFINITY, -0.0, 123456789.123];
        assert_eq!(
            to_json(&BTreeMap::from([("values", values)])),
            "{\n  \"values\": [0.333333333, 596.0, -1e-20, null, null, 0.0, 123456789.0]\n}\n"
        );
    }

    #[test]
    fn long_lines_break_and_strings_stay() {
        let long = "x".repeat(LINE);
        let value = serde_json::json!({
            "a": {"b": 1}, "c": [], "d": [{"e": "a, \"b\": [\\", "f": [1, 2]}, {"g": [long, {}]}], "h": {}
        });
        let text = to_json(&value);
        assert_eq!(serde_json::from_str::<serde_json::Value>(&text).unwrap(), value);
        let expected = format!(
            r#"{{
  "a": {{"b": 1}},
  "c": [],
  "d": [
    {{"e": "a, \"b\": [\\", "f": [1, 2]}},
    {{
      "g": [
        "{long}",
        {{}}
      ]
    }}
  ],
  "h": {{}}
}}
"#
        );
        assert_eq!(text, expected);
    }
}
