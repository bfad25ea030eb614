//! What answers to mouse, touch and keyboard.

use std::f64::consts::FRAC_PI_2;

use serde_json::Value;

use crate::{
    browser,
    driver::{Browser, ENTER, ESCAPE, HOME, LEFT, Pointer, RIGHT, TAB, UP},
    simulated_report,
};

/// Yaw, pitch, distance and target of the view in space.
fn view(browser: &Browser) -> Vec<f64> {
    // The drawing follows with the next frame of the screen.
    browser.script(
        "return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))",
    );
    let view = browser.script("return document.getElementById('space-view').dataset.view");
    view.as_str().expect("a view").split(' ').map(|v| v.parse().expect("a number")).collect()
}

fn text(browser: &Browser, selector: &str) -> String {
    let text =
        browser.script(&format!("return document.querySelector({selector:?})?.innerText ?? ''"));
    text.as_str().expect("a text").to_owned()
}

fn tip(browser: &Browser) -> String {
    text(browser, "#tip:not([hidden])")
}

fn value(browser: &Browser, selector: &str) -> f64 {
    let value =
        browser.script(&format!("return Number(document.querySelector({selector:?}).value)"));
    value.as_f64().expect("a number")
}

fn focus(browser: &Browser, selector: &str) {
    browser.script(&format!("document.querySelector({selector:?}).focus()"));
}

/// A picture of a canvas.
fn pixels(browser: &Browser, canvas: &str) -> Value {
    // Reading pixels themselves makes the browser grumble on its console.
    browser.script(&format!("return document.querySelector({canvas:?}).toDataURL()"))
}

fn space(browser: &Browser, pointer: Pointer) {
    let start = view(browser);
    browser.drag(pointer, "#space-view", [0.0, 0.0], [60.0, 20.0]);
    let turned = view(browser);
    assert!(
        turned[0] > start[0] + 0.2 && turned[1] > start[1] + 0.05,
        "{pointer:?}: {start:?} {turned:?}"
    );
    if pointer == Pointer::Touch {
        browser.pinch("#space-view", 60.0, 180.0);
        let near = view(browser);
        assert!(near[2] < 0.6 * turned[2], "two fingers apart come nearer: {turned:?} {near:?}");
    }
    browser.click(pointer, "#space-sides [data-side=edge]");
    let from_the_side = view(browser);
    assert!((from_the_side[0] - FRAC_PI_2).abs() < 1e-3, "{pointer:?}: {from_the_side:?}");
    assert_eq!(from_the_side[1], 0.0, "{pointer:?}");
    let before = pixels(browser, "#space-view");
    browser.click(pointer, "#space-state input[value='1']");
    browser.wait_for("document.getElementById('space-view').dataset.state === '1'");
    assert_ne!(
        pixels(browser, "#space-view"),
        before,
        "before and after the correction look alike"
    );
    assert!(text(browser, "#space-words").contains("after: own camera"));
    browser.click(pointer, "#space-colour input[value=distance]");
    assert_eq!(
        browser.script("return document.getElementById('space-scale').checkVisibility()"),
        true
    );
    browser.click(pointer, "#closeup-frames label:last-of-type input");
    let frame = text(browser, "#closeup-frames label:last-of-type");
    assert!(text(browser, "#space-words").starts_with(&format!("Frame {},", frame.trim())));
}

fn space_by_keyboard(browser: &Browser) {
    focus(browser, "#space-view");
    browser.keys(&[HOME]);
    let start = view(browser);
    browser.keys(&[RIGHT, RIGHT, UP, '+']);
    let turned = view(browser);
    assert!(
        turned[0] > start[0] && turned[1] < start[1] && turned[2] < start[2],
        "{start:?} {turned:?}"
    );
    browser.keys(&[HOME]);
    assert_eq!(view(browser), start);
    focus(browser, "#space-state input:checked");
    let state = "return document.querySelector('#space-state input:checked').value";
    let before = browser.script(state);
    browser.keys(&[LEFT]);
    assert_ne!(browser.script(state), before);
}

fn sliders(browser: &Browser, pointer: Pointer) {
    for figure in ["over", "edges"] {
        let slider = format!("#{figure} input[type=range]");
        let cut = || {
            browser.script(&format!(
                "return document.querySelector('#{figure} .stage').style.getPropertyValue('--cut')"
            ))
        };
        let stage = format!("#{figure} .stage");
        browser.drag(pointer, &stage, [0.0, 0.0], [-90.0, 0.0]);
        let (left, left_cut) = (value(browser, &slider), cut());
        assert!((5.0..45.0).contains(&left), "{pointer:?} {figure}: {left}");
        browser.drag(pointer, &stage, [0.0, 0.0], [90.0, 0.0]);
        let right = value(browser, &slider);
        assert!(right > left + 20.0 && cut() != left_cut, "{pointer:?} {figure}: {left} {right}");
        if pointer == Pointer::Mouse {
            browser.drag(pointer, &slider, [0.0, 0.0], [-80.0, 0.0]);
            assert!(value(browser, &slider) < right);
            focus(browser, &slider);
            let before = value(browser, &slider);
            browser.keys(&[RIGHT, RIGHT]);
            assert!(value(browser, &slider) > before, "by keyboard");
        }
    }
}

/// The error of every pixel instead of its depth, before and after the correction.
fn distances(browser: &Browser, pointer: Pointer) {
    let depth = pixels(browser, "#over canvas");
    browser.click(pointer, "#over input[value=distance]");
    let shown = "const all = document.querySelectorAll('#over .scale-of-colours');
                 return [...all].map((e) => e.checkVisibility()).join()";
    assert_eq!(browser.script(shown), "false,true");
    let before = pixels(browser, "#over canvas");
    assert_ne!(before, depth);
    let other = "#space-state input:not(:checked)";
    browser.click(pointer, other);
    assert_ne!(pixels(browser, "#over canvas"), before, "the correction changes distances");
    browser.click(pointer, other);
    assert_eq!(pixels(browser, "#over canvas"), before);
    browser.click(pointer, "#over input[value=depth]");
    assert_eq!(browser.script(shown), "true,false");
}

/// Each command that is shown is on the clipboard after one press.
fn copies(browser: &Browser) {
    let last = "const all = document.querySelectorAll('.next .copy'); return all[all.length - 1].dataset.copy";
    let command = browser.script(last);
    browser.click(Pointer::Mouse, ".next dd:last-of-type .copy");
    browser.wait_for(
        "[...document.querySelectorAll('.next .copy')].some((b) => b.textContent === 'Copied')",
    );
    assert!(command.as_str().expect("a command").starts_with("truedepth audit "), "{command}");
}

/// What has the focus can be seen to have it.
fn focus_is_visible(browser: &Browser) {
    browser.script("document.activeElement.blur(); scrollTo(0, 0)");
    let mut seen = std::collections::BTreeSet::new();
    for _ in 0..40 {
        browser.keys(&[TAB]);
        let focused = browser.script(
            "const e = document.activeElement; const s = getComputedStyle(e);
             const seen = s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) >= 2;
             return [seen, e.tagName + ' ' + e.className].join('|')",
        );
        let focused = focused.as_str().expect("a text").to_owned();
        assert!(focused.starts_with("true|"), "nobody sees the focus on {focused}");
        seen.insert(focused);
    }
    assert!(seen.len() > 5, "Tab leads through the page: {seen:?}");
}

fn gallery(browser: &Browser, pointer: Pointer) {
    let caption = || text(browser, "dialog[open] figcaption");
    assert_eq!(caption(), "");
    browser.click(pointer, ".frames li:nth-child(2) .zoom");
    let second = caption();
    assert!(second.contains("frame 1"), "{second}");
    if pointer == Pointer::Touch {
        browser.drag(pointer, "dialog .picture", [80.0, 0.0], [-80.0, 0.0]);
        assert!(caption().contains("frame 2"), "a swipe leafs on: {}", caption());
    } else {
        browser.click(pointer, "dialog .steps button:last-child");
        assert!(caption().contains("frame 2"), "{}", caption());
    }
    browser.keys(&[LEFT]);
    assert_eq!(caption(), second);
    browser.keys(&[ESCAPE]);
    assert_eq!(caption(), "");
    // The focus is back where it was: Enter opens the same frame again.
    browser.keys(&[ENTER]);
    assert_eq!(caption(), second);
    browser.keys(&[ESCAPE]);
    let rings =
        "return getComputedStyle(document.querySelector('.overlay-corners')).display !== 'none'";
    assert_eq!(browser.script(rings), true);
    browser.click(pointer, "#show-corners");
    assert_eq!(browser.script(rings), false);
    browser.click(pointer, "#show-corners");
}

fn hovering(browser: &Browser) {
    browser.hover("#over .stage", [40.0, 0.0]);
    assert!(tip(browser).contains("px: ") && tip(browser).contains(" m"), "{}", tip(browser));
    browser.click(Pointer::Mouse, "#space-sides [data-side=front]");
    view(browser);
    browser.hover("#space-view", [0.0, 0.0]);
    assert!(tip(browser).contains("mm deep"), "{}", tip(browser));
    browser.hover("#depth-frames .plot .mark", [0.0, 0.0]);
    assert!(tip(browser).contains("frame "), "{}", tip(browser));
    focus(browser, "#depth-error .plot");
    browser.keys(&[RIGHT]);
    let first = tip(browser);
    assert!(first.contains("corners"), "{first}");
    browser.keys(&[RIGHT]);
    assert_ne!(tip(browser), first);
    browser.keys(&[ESCAPE]);
    assert_eq!(tip(browser), "");
    browser.click(Pointer::Mouse, ".frames li:nth-child(1) .zoom");
    browser.hover("dialog .overlay-corners circle", [0.0, 0.0]);
    assert!(tip(browser).starts_with("corner "), "{}", tip(browser));
    browser.keys(&[ESCAPE]);
}

fn the_rest(browser: &Browser) {
    let paper = "return getComputedStyle(document.body).backgroundColor";
    let light = browser.script(paper);
    browser.click(Pointer::Mouse, "#theme");
    assert_ne!(browser.script(paper), light);
    browser.click(Pointer::Mouse, "#theme");
    browser.click(Pointer::Mouse, "#views details summary");
    assert_eq!(
        browser.script("return document.querySelector('#views tbody').checkVisibility()"),
        true
    );
}

/// On a fresh page the first thing that Tab reaches leads past its head.
fn first_tab(browser: &Browser) {
    browser.keys(&[TAB]);
    assert_eq!(text(browser, ":focus"), "Skip to the findings");
}

#[test]
fn mouse_touch_and_keyboard() {
    let Some(browser) = browser() else { return };
    let page = simulated_report("interaction");
    browser.media("light", "screen");
    for (width, height, pointer) in [(1280, 900, Pointer::Mouse), (390, 844, Pointer::Touch)] {
        browser.window(width, height, pointer);
        browser.open(&page);
        browser.wait_for("document.querySelector('#space-view')?.dataset.points > 0");
        if pointer == Pointer::Mouse {
            first_tab(&browser);
        }
        space(&browser, pointer);
        sliders(&browser, pointer);
        distances(&browser, pointer);
        gallery(&browser, pointer);
        if pointer == Pointer::Mouse {
            space_by_keyboard(&browser);
            hovering(&browser);
            the_rest(&browser);
            copies(&browser);
            focus_is_visible(&browser);
        }
        assert_eq!(browser.console(), [""; 0]);
    }
}
