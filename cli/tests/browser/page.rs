//! What the page is before anybody touches it.

use std::path::Path;

use truedepth::report::FIGURES;

use crate::{
    browser,
    driver::{Browser, Pointer},
    folder, real_recordings, simulated_report, truedepth,
};

/// A simulated board is flat: there is no shape to show.
const NOT_SIMULATED: [&str; 1] = ["board-shape"];
/// Device and colour scheme.
const EVERY_WAY: [[&str; 2]; 4] =
    [["phone", "light"], ["phone", "dark"], ["desk", "light"], ["desk", "dark"]];
/// More than this nobody wants to send to a colleague.
const MAX_BYTES: u64 = 5_000_000;

fn assert_quiet(browser: &Browser) {
    assert_eq!(browser.console(), [""; 0], "on the console");
    let requests = browser.requests();
    let foreign: Vec<_> = requests.iter().filter(|url| !url.starts_with("file:")).collect();
    assert!(foreign.is_empty(), "asked for {foreign:?}");
    assert_eq!(requests.len(), 1, "the page itself and nothing else: {requests:?}");
}

/// Each figure has marks inside its drawing, words below it, and rows in its table.
fn assert_figures(browser: &Browser, absent: &[&str]) {
    let shown = browser.script(
        "return [...document.querySelectorAll('.evidence .figure')].map((f) => f.id).join(' ')",
    );
    let expected: Vec<&str> = FIGURES.into_iter().filter(|id| !absent.contains(id)).collect();
    assert_eq!(shown, expected.join(" "));
    for id in expected {
        let number = |what: &str| {
            let counted = browser.script(&format!(
                "const f = document.getElementById({id:?}); return f ? f.querySelectorAll({what:?}).length : -1;"
            ));
            counted.as_i64().expect("a number")
        };
        assert!(number(".plot .mark") >= 1, "{id} has no marks");
        assert!(number("tbody tr") >= 1, "{id} has no numbers");
        let caption = browser
            .script(&format!("return document.querySelector('#{id} figcaption').innerText.length"));
        assert!(caption.as_i64().expect("a number") > 40, "{id} has no caption");
    }
    // Drawn, not only there: pixels of more than one colour.
    for canvas in ["#space-view", "#over canvas", "#edges canvas"] {
        browser.wait_for(&format!(
            "(() => {{ const c = document.querySelector({canvas:?});
               const d = new Uint32Array(c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer);
               return new Set(d).size > 1; }})()"
        ));
    }
}

/// Nothing is cut off at the side of a phone, and everything that can be pressed can be hit by a finger.
fn assert_fits(browser: &Browser) {
    // Not innerWidth: a phone grows that with what is too wide.
    let wide = browser.script(
        "const e = document.documentElement; return [e.scrollWidth, e.clientWidth].join(' of ')",
    );
    let fits =
        browser.script("const e = document.documentElement; return e.scrollWidth <= e.clientWidth");
    assert_eq!(fits, true, "the page is {wide} px wide");
}

/// Every text stands out from what is behind it: at least 4.5 : 1, 3 : 1 where it is large (WCAG 2.2, 1.4.3).
fn assert_contrast(browser: &Browser, scheme: &str) {
    let faint = browser.script(
        r"
        const rgba = (text) => { const n = text.match(/[\d.]+/g).map(Number); return [...n.slice(0, 3), n[3] ?? 1]; };
        const light = ([r, g, b]) => {
          const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
          const [x, y, z] = [r, g, b].map((v) => linear(v / 255));
          return 0.2126 * x + 0.7152 * y + 0.0722 * z;
        };
        const behind = (element) => {
          for (let e = element; e; e = e.parentElement) {
            const colour = rgba(getComputedStyle(e).backgroundColor);
            if (colour[3] > 0.9) return colour;
          }
          return [255, 255, 255];
        };
        const faint = [];
        for (const element of document.body.querySelectorAll('*')) {
          const says = [...element.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
          if (!says || !element.checkVisibility() || element.closest('.overlay, script, style, noscript')) continue;
          const style = getComputedStyle(element);
          const ink = rgba(element.closest('svg') ? style.fill === 'none' ? style.color : style.fill : style.color);
          const [a, b] = [light(ink), light(behind(element))].sort((p, q) => q - p);
          const ratio = (a + 0.05) / (b + 0.05);
          const size = parseFloat(style.fontSize);
          const large = size >= 24 || (size >= 18.66 && style.fontWeight >= 700);
          const name = `${element.tagName}.${element.className.baseVal ?? element.className}`;
          const words = element.textContent.trim().slice(0, 40);
          if (ratio < (large ? 3 : 4.5)) faint.push(`${ratio.toFixed(2)} ${name} ${words}`);
        }
        return [...new Set(faint)].join('\n');
    ",
    );
    assert_eq!(faint, "", "too faint in {scheme}");
}

/// What a screen reader and a keyboard need: names for all that is looked at or pressed, headings in order, references
/// that lead somewhere, and meaning that does not hang on colour alone.
fn assert_accessible(browser: &Browser) {
    let wrong = browser.script(
        r"
        const wrong = [];
        const name = (e) => (e.getAttribute('aria-label') ?? '').trim() || e.textContent.trim();
        const show = (e) => `${e.tagName} ${e.id} ${e.outerHTML.slice(0, 90)}`;
        for (const e of document.querySelectorAll('img')) if (!e.alt.trim()) wrong.push('no alt: ' + show(e));
        for (const e of document.querySelectorAll('[role=img]')) {
          const labelled = e.getAttribute('aria-labelledby');
          const words = labelled ? document.getElementById(labelled)?.textContent : e.getAttribute('aria-label');
          if (!words?.trim()) wrong.push('no name: ' + show(e));
        }
        for (const e of document.querySelectorAll('button, a, summary')) {
          if (!name(e)) wrong.push('no name: ' + show(e));
        }
        for (const e of document.querySelectorAll('input')) {
          if (!(e.labels.length > 0 && e.labels[0].textContent.trim()) && !e.getAttribute('aria-label')) {
            wrong.push('no label: ' + show(e));
          }
        }
        for (const attribute of ['aria-labelledby', 'aria-describedby']) {
          for (const e of document.querySelectorAll(`[${attribute}]`)) {
            for (const id of e.getAttribute(attribute).split(' ')) {
              if (!document.getElementById(id)) wrong.push(`${attribute}=${id} leads nowhere`);
            }
          }
        }
        let level = 0;
        for (const e of document.querySelectorAll('h1, h2, h3, h4')) {
          const own = Number(e.tagName[1]);
          if (own > level + 1) wrong.push('a heading is skipped before ' + show(e));
          level = own;
        }
        for (const e of document.querySelectorAll('.chip')) {
          if (!e.textContent.trim()) wrong.push('colour only: ' + show(e));
        }
        // Far from zero a cell says so by its sign or its number.
        for (const figure of document.querySelectorAll('.figure:has(.heat)')) {
          const strong = figure.querySelectorAll(':is(.p2, .p3, .p4, .m2, .m3, .m4).mark').length;
          const said = figure.querySelectorAll('.heat :is(.sign, .in-cell)').length;
          if (said < strong) wrong.push(`colour only: ${figure.id} says ${said} of ${strong}`);
        }
        if (document.querySelectorAll('h1').length !== 1) wrong.push('not one h1');
        return wrong.join('\n');
    ",
    );
    assert_eq!(wrong, "");
}

/// All that can be asked of a page on a device.
fn check(browser: &Browser, page: &Path, [device, scheme]: [&str; 2], absent: &[&str]) {
    browser.media(scheme, "screen");
    let (width, height, pointer) = match device {
        "phone" => (390, 844, Pointer::Touch),
        _ => (1280, 900, Pointer::Mouse),
    };
    browser.window(width, height, pointer);
    browser.open(page);
    browser.wait_for("document.querySelector('#space-view')?.dataset.points > 0");
    assert_fits(browser);
    assert_figures(browser, absent);
    assert_contrast(browser, scheme);
    assert_accessible(browser);
    assert_quiet(browser);
}

/// At phone and desktop width, light and dark, and on paper.
fn look(browser: &Browser, page: &Path, name: &str, ways: &[[&str; 2]], absent: &[&str]) {
    for &[device, scheme] in ways {
        check(browser, page, [device, scheme], absent);
        browser.screenshot(&folder().join(format!("{name}-{device}-{scheme}.png")));
    }
    browser.media("light", "print");
    browser.window(794, 1123, Pointer::Mouse); // A4 at 96 dpi
    browser.screenshot(&folder().join(format!("{name}-print.png")));
}

/// What may go wrong with a page: a name, what is replaced, by what.
const BREAKAGES: [(&str, &str, &str); 10] = [
    ("a script that fails", "\"use strict\";", "\"use strict\"; throw new Error('broken');"),
    (
        "an image from elsewhere",
        "<main>",
        "<main><img alt=\"x\" src=\"https://example.com/x.png\">",
    ),
    ("a figure that is missing", "<figure id=\"coverage\"", "<figure id=\"gone\""),
    ("a figure without marks", "class=\"mark part\"", "class=\"part\""),
    ("faint letters", "--ink-2: light-dark(#5a5f68,", "--ink-2: light-dark(#b0b4ba,"),
    ("an image without words", " alt=\"Colour image", " data-alt=\"Colour image"),
    ("a slider without a name", " aria-label=\"How much of the picture shows depth, percent\"", ""),
    ("a name that leads nowhere", "id=\"space-title\"", "id=\"other-title\""),
    ("meaning by colour alone", "class=\"sign\"", "class=\"gone\""),
    ("a page wider than the phone", "</style>", "main { min-width: 60rem; }</style>"),
];

/// The checks see what they are there to see.
#[test]
fn what_is_broken_is_seen() {
    let Some(browser) = browser() else { return };
    let page = simulated_report("broken");
    let whole = std::fs::read_to_string(&page).expect("it was written");
    let copy = page.with_file_name("broken.html");
    let passes = |html: &str| {
        std::fs::write(&copy, html).expect("the folder can be written");
        // What an earlier page said is not this one's.
        browser.console();
        browser.requests();
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            check(&browser, &copy, ["phone", "light"], &NOT_SIMULATED);
        }))
        .is_ok()
    };
    assert!(passes(&whole), "the whole page");
    for (name, from, to) in BREAKAGES {
        let broken = whole.replace(from, to);
        assert_ne!(broken, whole, "{name}: nothing to break");
        assert!(!passes(&broken), "nobody saw {name}");
    }
}

#[test]
fn simulated() {
    let Some(browser) = browser() else { return };
    let page = simulated_report("page");
    look(&browser, &page, "simulated", &EVERY_WAY, &NOT_SIMULATED);
    let bytes = std::fs::metadata(&page).expect("it was written").len();
    assert!(bytes < MAX_BYTES, "{bytes} bytes");
}

#[test]
fn real() {
    let (Some(recordings), Some(browser)) = (real_recordings(), browser()) else { return };
    for (recording, name) in [("iPhone11Pro_iOS14", "iphone"), ("iPadPro12_5gen_iOS15", "ipad")] {
        let report = folder().join(name);
        std::fs::remove_dir_all(&report).ok();
        let recording = recordings.join(recording);
        let [recording, out] = [&recording, &report].map(|path| path.to_str().expect("UTF-8"));
        truedepth(&["audit", recording, "-o", out]);
        let page = report.join("report.html");
        look(&browser, &page, name, &EVERY_WAY[1..3], &[]);
        let bytes = std::fs::metadata(&page).expect("it was written").len();
        assert!(bytes < MAX_BYTES, "{name}: {bytes} bytes");
        println!("{name}: report.html takes {:.2} MB", bytes as f64 / 1e6);
    }
}
