//! The architecture, executable. The text of the sources is read here, not their meaning: what these tests forbid
//! must be written the plain way (`crate::room::...`, `std::fs`, ...) to be seen, and house style asks for that.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// A file that needs more holds more than one idea.
const MAX_FILE_LINES: usize = 800;

/// As rustfmt's `max_width`, with room for the long words rustfmt does not break (URLs, formulas in comments).
const MAX_LINE_CHARS: usize = 120;

/// What the library never does, and the rooms that may nevertheless.
const FORBIDDEN: &[(&str, &[&str], &str)] = &[
    ("print!(", &[], "the library is silent"),
    ("println!(", &[], "the library is silent"),
    ("dbg!(", &[], "the library is silent"),
    ("stdout()", &[], "the library is silent"),
    ("stderr()", &[], "the library is silent"),
    ("process::", &[], "only a shell ends or starts a process"),
    ("std::env", &[], "the environment belongs to the shell"),
    ("env::", &[], "the environment belongs to the shell"),
    ("SystemTime", &[], "same input, same bytes out: no clock"),
    ("Instant", &[], "same input, same bytes out: no clock"),
    ("std::net", &[], "no network"),
    ("std::thread", &[], "threads come from `par`"),
    ("rayon", &["par"], "threads come from `par`"),
    ("feature = \"parallel\"", &["par"], "what runs on one core runs on all, by `par`"),
    ("std::fs", &["files"], "only `files` opens files"),
    ("File::", &["files"], "only `files` opens files"),
    ("super::super", &[], "say `crate::room::...`, so that the order of rooms can be checked"),
    ("HashMap", &[], "hash order must never reach a result; use BTreeMap"),
    ("HashSet", &[], "hash order must never reach a result; use BTreeSet"),
];

/// Methods whose last bits the platform decides; [`platforms_own`] sees them.
const TRANSCENDENTAL: &[&str] = &[
    "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "cbrt", "cos", "cosh", "exp",
    "exp2", "exp_m1", "hypot", "ln", "ln_1p", "log", "log10", "log2", "mul_add", "powf", "sin",
    "sin_cos", "sinh", "tan", "tanh",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All Rust files below `dir`, in order.
fn rust_files(dir: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<PathBuf> = fs::read_dir(dir)
        .unwrap_or_else(|e| panic!("{}: {e}", dir.display()))
        .map(|entry| entry.expect("a folder in our own tree lists").path())
        .collect();
    entries.sort();
    let mut files = Vec::new();
    for path in entries {
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The rooms, ground first.
fn rooms(lib: &str) -> Vec<&str> {
    lib.lines()
        .filter_map(|l| l.strip_prefix("pub ").unwrap_or(l).strip_prefix("mod ")?.strip_suffix(';'))
        .collect()
}

/// The source without comments, line by line as before.
fn without_comments(text: &str) -> String {
    text.lines()
        .map(|line| match line.find("//") {
            // A URL in a string is no comment.
            Some(at) if !line[..at].ends_with(':') => &line[..at],
            _ => line,
        })
        .collect::<Vec<_>>()
        .join("\n")
}

/// The source without comments and without the unit tests at its end.
fn product_code(text: &str) -> String {
    let code = without_comments(text);
    match code.find("#[cfg(test)]\nmod ") {
        Some(at) => code[..at].to_owned(),
        None => code,
    }
}

/// First path segments after every `crate::`, grouped imports included, with byte offsets.
fn uses(text: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        let rest = &text[at + "crate::".len()..];
        if rest.starts_with('{') {
            let (mut depth, mut segment_start) = (0, true);
            for (i, c) in rest.char_indices() {
                match c {
                    '{' => depth += 1,
                    '}' => depth -= 1,
                    _ => (),
                }
                if depth == 0 {
                    break;
                }
                if depth == 1 && segment_start && c.is_ascii_lowercase() {
                    found.push((at, ident(&rest[i..])));
                    segment_start = false;
                }
                if depth == 1 && (c == '{' || c == ',') {
                    segment_start = true;
                }
            }
        } else {
            found.push((at, ident(rest)));
        }
    }
    return found;

    fn ident(s: &str) -> &str {
        s.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').next().unwrap_or("")
    }
}

/// Lines (1-based) of `text` in which `word` begins a word.
fn lines_with(text: &str, word: &str) -> Vec<usize> {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.match_indices(word)
        .filter(|(at, _)| !text[..*at].ends_with(is_word))
        .map(|(at, _)| text[..at].matches('\n').count() + 1)
        .collect()
}

fn assert_none(faults: &[String]) {
    assert!(faults.is_empty(), "\n{}\n", faults.join("\n"));
}

/// Each room with its files.
fn rooms_with_files() -> Vec<(String, Vec<PathBuf>)> {
    let src = root().join("src");
    let lib = read(&src.join("lib.rs"));
    let rooms: Vec<_> = rooms(&lib)
        .into_iter()
        .map(|room| {
            // A room of one file needs no folder.
            let file = src.join(room).with_extension("rs");
            let files = if file.is_file() { vec![file] } else { rust_files(&src.join(room)) };
            (room.to_owned(), files)
        })
        .collect();
    assert!(rooms.len() > 10, "the `mod` lines of lib.rs are no longer understood");
    rooms
}

#[test]
fn rooms_use_only_rooms_above() {
    let rooms = rooms_with_files();
    let mut faults = Vec::new();
    for (i, (room, files)) in rooms.iter().enumerate() {
        for path in files {
            let text = without_comments(&read(path));
            for (at, used) in uses(&text) {
                if rooms.iter().position(|(r, _)| r == used).is_some_and(|other| other > i) {
                    let line = text[..at].matches('\n').count() + 1;
                    faults.push(format!(
                        "{}:{line}: `{room}` uses `{used}`, which stands below it in lib.rs",
                        path.display()
                    ));
                }
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn every_file_belongs_to_a_room() {
    let src = root().join("src");
    let in_rooms: usize = rooms_with_files().iter().map(|(_, files)| files.len()).sum();
    assert_eq!(rust_files(&src).len(), in_rooms + 1, "besides lib.rs every file stands in a room");
}

#[test]
fn the_library_touches_nothing_outside() {
    let mut faults = Vec::new();
    for (room, files) in rooms_with_files() {
        for path in files {
            let code = product_code(&read(&path));
            for (word, allowed, why) in FORBIDDEN {
                if allowed.contains(&room.as_str()) {
                    continue;
                }
                for line in lines_with(&code, word) {
                    faults.push(format!("{}:{line}: `{word}`: {why}", path.display()));
                }
            }
        }
    }
    assert_none(&faults);
}

/// Where the standard library's transcendental functions are used, as methods or by path (1-based lines): `powi` too,
/// unless its exponent is a small number, which makes it a few multiplications.
fn platforms_own(code: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices(['.', ':']) {
        let rest = &code[at + 1..];
        let name =
            &rest[..rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(0)];
        let after = &rest[name.len()..];
        let by_path = code[..at].ends_with("f64:") || code[..at].ends_with("f32:");
        let is_method = code.as_bytes()[at] == b'.' && after.starts_with('(');
        let small_power =
            ["(2)", "(3)", "(4)", "(-2)"].iter().any(|power| after.starts_with(power));
        if (is_method || by_path)
            && (TRANSCENDENTAL.contains(&name) || name == "powi" && !small_power)
        {
            found.push((code[..at].matches('\n').count() + 1, name.to_owned()));
        }
    }
    found
}

#[test]
fn transcendental_functions_come_from_math() {
    let mut faults = Vec::new();
    for (room, files) in rooms_with_files() {
        for path in files.iter().filter(|_| room != "math") {
            for (line, name) in platforms_own(&product_code(&read(path))) {
                faults.push(format!(
                    "{}:{line}: `{name}`: other bits elsewhere; use `math`",
                    path.display()
                ));
            }
        }
    }
    assert_none(&faults);
    let seen =
        platforms_own("x.sin()\nf64::exp\ny.powi(2) + y.powi(n)\nself.log.push(x.exponent())");
    assert_eq!(seen, [(1, "sin".to_owned()), (2, "exp".to_owned()), (3, "powi".to_owned())]);
}

/// A file of `files` that opens files stands behind the feature, by its `mod` line or by an attribute inside.
#[test]
fn files_are_opened_only_behind_the_feature() {
    let room = root().join("src/files");
    let door = read(&room.join("mod.rs"));
    let mut faults = Vec::new();
    for path in rust_files(&room) {
        let code = product_code(&read(&path));
        let name = path.file_stem().expect("a file has a name").to_string_lossy().into_owned();
        let gated = code.contains("feature = \"fs\"")
            || door.contains(&format!("#[cfg(feature = \"fs\")]\nmod {name};"))
            || door.contains(&format!("#[cfg(feature = \"fs\")]\npub mod {name};"));
        if !gated && (code.contains("std::fs") || code.contains("File::")) {
            faults.push(format!("{}: opens files without `feature = \"fs\"`", path.display()));
        }
    }
    assert_none(&faults);
}

#[test]
fn every_room_has_a_door() {
    for (room, files) in rooms_with_files() {
        let door = files
            .iter()
            .find(|f| f.ends_with(format!("{room}/mod.rs")) || f.ends_with(format!("{room}.rs")))
            .unwrap_or_else(|| panic!("src/{room}/mod.rs is missing"));
        let text = read(door);
        let first = text.lines().next().unwrap_or("");
        assert!(
            first.strip_prefix("//! ").is_some_and(|sentence| !sentence.is_empty()),
            "{}: begins with `//!` and a sentence that says what the room is",
            door.display()
        );
    }
}

#[test]
fn files_and_lines_stay_short() {
    let mut faults = Vec::new();
    for folder in ["src", "tests", "cli/src", "cli/tests"] {
        for path in rust_files(&root().join(folder)) {
            let text = read(&path);
            let n = text.lines().count();
            if n > MAX_FILE_LINES {
                faults.push(format!("{}: {n} lines, limit {MAX_FILE_LINES}", path.display()));
            }
            for (i, line) in text.lines().enumerate() {
                let chars = line.chars().count();
                if chars > MAX_LINE_CHARS {
                    faults.push(format!(
                        "{}:{}: {chars} characters, limit {MAX_LINE_CHARS}",
                        path.display(),
                        i + 1
                    ));
                }
            }
        }
    }
    assert_none(&faults);
}

#[test]
fn uses_sees_groups() {
    let text = "use crate::a::B;\nuse crate::{\n    c::{D, e},\n    f,\n};\nlet x = crate::g::h();";
    let seen: Vec<&str> = uses(text).into_iter().map(|(_, s)| s).collect();
    assert_eq!(seen, ["a", "c", "f", "g"]);
}

#[test]
fn words_are_found_where_they_begin() {
    assert_eq!(lines_with("a\nstd::fs::read\nmy_print!(x)\nprint!(x)", "print!("), [4]);
    assert_eq!(lines_with("a\nstd::fs::read", "std::fs"), [2]);
    assert_eq!(product_code("x // y\n#[cfg(test)]\nmod tests {"), "x \n");
    assert_eq!(without_comments("\"https://a\" // b"), "\"https://a\" // b"); // Errs on the strict side.
}
