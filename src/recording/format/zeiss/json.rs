//! Arrays of records in JSON, with the place of whatever is wrong in them.

use std::{
    fmt,
    io::{BufReader, Read},
    marker::PhantomData,
};

use serde::{
    Deserialize, Deserializer,
    de::{DeserializeOwned, DeserializeSeed, SeqAccess, Visitor},
};

use crate::{files, recording::Error};

/// All records of a file that is one JSON array.
pub(super) fn records<T: DeserializeOwned>(file: &str, bytes: &[u8]) -> Result<Vec<T>, Error> {
    let mut records = Vec::new();
    parse_records(file, bytes, &mut |record| {
        records.push(record);
        Ok(())
    })?;
    Ok(records)
}

/// How an array of records ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// With its `]`.
    Closed,
    /// After a whole record, without the `]`: whoever wrote it was stopped between two records.
    Open,
}

/// Hands the records of a file that is one JSON array to `each`, one after the other, so that never more than one lies
/// in memory. Where the file is no such array, `whole` is asked for its bytes to tell the place.
pub(super) fn each_record<T: DeserializeOwned>(
    file: &str,
    reader: impl Read,
    whole: impl FnOnce() -> Result<Vec<u8>, Error>,
    each: &mut Each<'_, T>,
) -> Result<End, Error> {
    let (mut n, mut stopped) = (0, None);
    let mut deserializer = serde_json::Deserializer::from_reader(BufReader::new(reader));
    let records = Records { each, n: &mut n, stopped: &mut stopped };
    let result = records.deserialize(&mut deserializer).and_then(|()| deserializer.end());
    match (result, stopped) {
        (Ok(()), _) => Ok(End::Closed),
        (Err(_), Some(why)) => Err(why),
        (Err(error), None) => {
            let unreadable = |why| files::Error::File { file: file.to_owned(), why }.into();
            if error.is_io() {
                return Err(unreadable(error.to_string()));
            }
            let whole = whole()?;
            let ends_whole = whole.trim_ascii_end().ends_with(b"}");
            if error.is_eof() && ends_whole && n > 0 && is_array(&whole) {
                return Ok(End::Open);
            }
            parse_records::<T>(file, &whole, &mut |_| Ok(()))?;
            Err(unreadable("changed while it was read".into()))
        }
    }
}

/// Whether records, with an end of our own, are an array: the last record is whole.
fn is_array(records: &[u8]) -> bool {
    let end = b"]".as_slice();
    let mut closed = serde_json::Deserializer::from_reader(records.chain(end));
    serde::de::IgnoredAny::deserialize(&mut closed).and_then(|_| closed.end()).is_ok()
}

/// What is done with each record; its error ends the reading.
type Each<'a, T> = dyn FnMut(T) -> Result<(), Error> + 'a;

fn parse_records<T: DeserializeOwned>(
    file: &str,
    bytes: &[u8],
    each: &mut Each<'_, T>,
) -> Result<(), Error> {
    let (mut n, mut stopped) = (0, None);
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    let records = Records { each, n: &mut n, stopped: &mut stopped };
    let result = records.deserialize(&mut deserializer).and_then(|()| deserializer.end());
    // The array may also end before its last record: then the next one is what is cut.
    result.map_err(|error| stopped.unwrap_or_else(|| locate(file, bytes, n + 1, &error)))
}

fn locate(file: &str, bytes: &[u8], record: usize, error: &serde_json::Error) -> Error {
    let file = file.to_owned();
    if error.is_eof() {
        return Error::MetadataCut { file, record, bytes: bytes.len() };
    }
    let (line, column) = (error.line(), error.column());
    let why = error.to_string();
    let why = why.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&why);
    let text = bytes.split(|&b| b == b'\n').nth(line.saturating_sub(1)).unwrap_or_default();
    let text = shorten(String::from_utf8_lossy(text).trim());
    Error::Metadata { file, record, line, column, why: shorten(why), text }
}

/// Files are untrusted: what is quoted from them must not fill the screen or steer the terminal.
fn shorten(text: &str) -> String {
    let mut short: String = text.chars().filter(|c| !c.is_control()).take(120).collect();
    if text.chars().nth(120).is_some() {
        short.push('…');
    }
    short
}

/// Takes the elements of an array one by one, so that those before an error are counted.
struct Records<'a, 'b, T> {
    each: &'a mut Each<'b, T>,
    n: &'a mut usize,
    stopped: &'a mut Option<Error>,
}

impl<'de, T: Deserialize<'de>> DeserializeSeed<'de> for Records<'_, '_, T> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de, T: Deserialize<'de>> Visitor<'de> for Records<'_, '_, T> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an array of records, `[{...},{...}]`")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        while let Some(record) = seq.next_element()? {
            if let Err(why) = (self.each)(record) {
                *self.stopped = Some(why);
                return Err(serde::de::Error::custom("stopped"));
            }
            *self.n += 1;
        }
        Ok(())
    }
}

/// Numbers as the app writes tuples: a string `"(565.12317, 0.0, 320.60107)"`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tuple<const N: usize>(pub(super) [f64; N]);

impl<'de, const N: usize> Deserialize<'de> for Tuple<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_str(TupleVisitor(PhantomData::<[f64; N]>))
    }
}

struct TupleVisitor<T>(PhantomData<T>);

impl<const N: usize> Visitor<'_> for TupleVisitor<[f64; N]> {
    type Value = Tuple<N>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{N} finite numbers in a string, \"(1.0, 2.0, ...)\"")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Tuple<N>, E> {
        parse(text)
            .map(Tuple)
            .ok_or_else(|| E::invalid_value(serde::de::Unexpected::Str(text), &self))
    }
}

fn parse<const N: usize>(text: &str) -> Option<[f64; N]> {
    let inner = text.trim().strip_prefix('(')?.strip_suffix(')')?;
    let mut numbers = [0.0; N];
    let mut parts = inner.split(',');
    for number in &mut numbers {
        *number = parts.next()?.trim().parse().ok().filter(|v: &f64| v.is_finite())?;
    }
    parts.next().is_none().then_some(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize, PartialEq)]
    struct Record {
        #[serde(rename = "K")]
        k: Tuple<2>,
        #[serde(rename = "N")]
        n: f64,
    }

    #[test]
    fn tuples() {
        for (text, expected) in [
            ("(1.5, -2)", Some([1.5, -2.0])),
            (" ( 1e2 ,3 ) ", Some([100.0, 3.0])),
            ("(1.0)", None),
            ("(1, 2, 3)", None),
            ("(1, nan)", None),
            ("(1, inf)", None),
            ("(1, 1e999)", None),
            ("1, 2", None),
            ("(1, )", None),
            ("", None),
            ("(1, 2", None),
        ] {
            assert_eq!(parse::<2>(text), expected, "{text}");
        }
    }

    #[test]
    fn whoever_takes_records_may_stop() {
        let file = br#"[{"K": "(1, 2)", "N": 3}, {"K": "(1, 2)", "N": 4}, !"#;
        let mut seen = Vec::new();
        let enough = Error::NoImages { path: "enough".into() };
        let result = each_record("f", &file[..], || unreachable!(), &mut |record: Record| {
            seen.push(record.n);
            if record.n == 4.0 { Err(enough.clone()) } else { Ok(()) }
        });
        assert_eq!((result, seen), (Err(enough), vec![3.0, 4.0]));
    }

    #[test]
    fn every_error_has_its_place() {
        let good = r#"{"K": "(1, 2)", "N": 3, "unknown": [{}]}"#;
        assert_eq!(records::<Record>("f", b"[]").unwrap(), []);
        let two = records::<Record>("f", format!("[\n{good},{good}\n]\n").as_bytes()).unwrap();
        assert_eq!(two[1], Record { k: Tuple([1.0, 2.0]), n: 3.0 });

        let deep = "[".repeat(100_000);
        // What stands after one good record, and what the message must say.
        for (text, expected) in [
            (",{\"K\": \"(1, 2)\",\n\"N\": NaN}]", &["f, record 2, line 3", "\"N\": NaN"][..]),
            (
                ",{\"K\": \"(1, 2)\",\n\"N\": \"3\"}]",
                &["record 2, line 3", "string \"3\"", "`\"N\": \"3\"}]`"],
            ),
            (
                ",{\"N\": 3,\n\"K\": \"(nan, 2)\"}]",
                &["record 2, line 3", "2 finite numbers", "\"(nan, 2)\""],
            ),
            (",{\"K\": \"(1, 2)\",\n\"N\": 1e999}]", &["record 2, line 3", "out of range"]),
            (",{\"N\": 3}]", &["record 2, line 2", "missing field `K`"]),
            (",{\"K\": \"(1, 2)\", \"N\": 1, \"N\": 2}]", &["record 2", "duplicate field `N`"]),
            (",7]", &["record 2", "integer `7`"]),
            (
                ",{\"K\": \"(1, 2)\",\n\"N\"",
                &["f ends in the middle of record 2 (byte 62)", "keep its 1 whole"],
            ),
            (",", &["in the middle of record 2"]),
            ("] x", &["record 2, line 2", "trailing characters"]),
            ("} ]", &["record 2", "expected `,` or `]`"]),
            (deep.as_str(), &["record 2"]),
        ] {
            let file = format!("[\n{good}{text}").into_bytes();
            let error = records::<Record>("f", &file).unwrap_err();
            let whole = || Ok(file.clone());
            let piecewise =
                each_record("f", file.as_slice(), whole, &mut |_: Record| Ok(())).unwrap_err();
            assert_eq!(piecewise, error, "read record by record");
            let message = error.to_string();
            for part in expected {
                assert!(message.contains(part), "{text:.40}: {message}");
            }
            assert!(
                message.contains("copy it from") || message.contains("copy the file"),
                "{message}"
            );
        }
        for (text, expected) in
            [("", "record 1"), ("{}", "an array of records"), ("\u{1b}[2J", "line 1")]
        {
            let message = records::<Record>("f", text.as_bytes()).unwrap_err().to_string();
            assert!(message.contains(expected) && !message.contains('\u{1b}'), "{message}");
        }
    }
}
