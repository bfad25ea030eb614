//! What answers to mouse, touch and keyboard.

use std::f64::consts::FRAC_PI_2;

use serde_json::Value;

use crate::{
    browser,
    driver::{Browser, ENTER, ESCAPE, HOME, LEFT, Pointer, RIGHT, TAB, UP, wait_until},
    simulated_report,
};

/// Yaw, pitch, distance and target of the view in space.
fn view(browser: &Browser) -> Vec<f64> {
    browser.next_frame();
    let view = browser.script("return document.getElementById('space-view').dataset.view");
    view.as_str().expect("a view").split(' ').map(|v| v.parse().expect("a number")).collect()
}

fn text(browser: &Browser, selector: &str) -> String {
    let text =
        browser.script(&format!("return document.querySelector({selector:?})?.innerText ?? ''"));
    text.as_str().expect("a text").to_owned()
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
    let turned = wait_until(|| view(browser), |v| v[0] > start[0] + 0.2 && v[1] > start[1] + 0.05);
    if pointer == Pointer::Touch {
        browser.pinch("#space-view", 60.0, 180.0);
        wait_until(|| view(browser), |near| near[2] < 0.6 * turned[2]);
    }
    browser.click(pointer, "#space-sides [data-side=edge]");
    wait_until(|| view(browser), |v| (v[0] - FRAC_PI_2).abs() < 1e-3 && v[1] == 0.0);
    let before = pixels(browser, "#space-view");
    browser.click(pointer, "#space-state input[value='1']");
    browser.wait_for("document.getElementById('space-view').dataset.state === '1'");
    // Before and after the correction do not look alike.
    wait_until(|| pixels(browser, "#space-view"), |after| *after != before);
    wait_until(|| text(browser, "#space-words"), |words| words.contains("after: own camera"));
    browser.click(pointer, "#space-colour input[value=distance]");
    browser.wait_for("document.getElementById('space-scale').checkVisibility()");
    browser.click(pointer, "#closeup-frames label:last-of-type input");
    let frame = text(browser, "#closeup-frames label:last-of-type");
    let begins = format!("Frame {},", frame.trim());
    wait_until(|| text(browser, "#space-words"), |words| words.starts_with(&begins));
}

fn space_by_keyboard(browser: &Browser) {
    focus(browser, "#space-view");
    browser.keys(&[HOME]);
    let start = view(browser);
    browser.keys(&[RIGHT, RIGHT, UP, '+']);
    wait_until(|| view(browser), |v| v[0] > start[0] && v[1] < start[1] && v[2] < start[2]);
    browser.keys(&[HOME]);
    wait_until(|| view(browser), |v| *v == start);
    focus(browser, "#space-state input:checked");
    let state = "return document.querySelector('#space-state input:checked').value";
    let before = browser.script(state);
    browser.keys(&[LEFT]);
    wait_until(|| browser.script(state), |after| *after != before);
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
        let left = wait_until(|| value(browser, &slider), |left| (5.0..45.0).contains(left));
        let left_cut = cut();
        browser.drag(pointer, &stage, [0.0, 0.0], [90.0, 0.0]);
        let right = wait_until(|| value(browser, &slider), |right| *right > left + 20.0);
        wait_until(cut, |right_cut| *right_cut != left_cut);
        if pointer == Pointer::Mouse {
            browser.drag(pointer, &slider, [0.0, 0.0], [-80.0, 0.0]);
            let before = wait_until(|| value(browser, &slider), |moved| *moved < right);
            focus(browser, &slider);
            browser.keys(&[RIGHT, RIGHT]);
            wait_until(|| value(browser, &slider), |by_keyboard| *by_keyboard > before);
        }
    }
}

/// The error of every pixel instead of its depth, before and after the correction.
fn distances(browser: &Browser, pointer: Pointer) {
    let depth = pixels(browser, "#over canvas");
    browser.click(pointer, "#over input[value=distance]");
    let shown = "const all = document.querySelectorAll('#over .scale-of-colours');
                 return [...all].map((e) => e.checkVisibility()).join()";
    wait_until(|| browser.script(shown), |shown| *shown == "false,true");
    let before = wait_until(|| pixels(browser, "#over canvas"), |before| *before != depth);
    let other = "#space-state input:not(:checked)";
    browser.click(pointer, other);
    // The correction changes distances.
    wait_until(|| pixels(browser, "#over canvas"), |after| *after != before);
    browser.click(pointer, other);
    wait_until(|| pixels(browser, "#over canvas"), |again| *again == before);
    browser.click(pointer, "#over input[value=depth]");
    wait_until(|| browser.script(shown), |shown| *shown == "true,false");
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
    let second = wait_until(caption, |caption| caption.contains("frame 1"));
    if pointer == Pointer::Touch {
        browser.drag(pointer, "dialog .picture", [80.0, 0.0], [-80.0, 0.0]);
    } else {
        browser.click(pointer, "dialog .steps button:last-child");
    }
    wait_until(caption, |caption| caption.contains("frame 2"));
    browser.keys(&[LEFT]);
    wait_until(caption, |caption| *caption == second);
    browser.keys(&[ESCAPE]);
    wait_until(caption, String::is_empty);
    // The focus is back where it was: Enter opens the same frame again.
    browser.keys(&[ENTER]);
    wait_until(caption, |caption| *caption == second);
    browser.keys(&[ESCAPE]);
    wait_until(caption, String::is_empty);
    let rings =
        "return getComputedStyle(document.querySelector('.overlay-corners')).display !== 'none'";
    assert_eq!(browser.script(rings), true);
    for shown in [false, true] {
        browser.click(pointer, "#show-corners");
        wait_until(|| browser.script(rings), |rings| *rings == shown);
    }
}

fn hovering(browser: &Browser) {
    let tip = || text(browser, "#tip:not([hidden])");
    browser.hover("#over .stage", [40.0, 0.0]);
    wait_until(tip, |tip| tip.contains("px: ") && tip.contains(" m"));
    browser.click(Pointer::Mouse, "#space-sides [data-side=front]");
    view(browser);
    browser.hover("#space-view", [0.0, 0.0]);
    wait_until(tip, |tip| tip.contains("mm deep"));
    browser.hover("#depth-frames .plot .mark", [0.0, 0.0]);
    wait_until(tip, |tip| tip.contains("frame "));
    focus(browser, "#depth-error .plot");
    browser.next_frame(); // What has the focus is scrolled to, and that hides the tip.
    browser.keys(&[RIGHT]);
    let first = wait_until(tip, |tip| tip.contains("corners"));
    browser.keys(&[RIGHT]);
    wait_until(tip, |tip| tip.contains("corners") && *tip != first);
    browser.keys(&[ESCAPE]);
    wait_until(tip, String::is_empty);
    browser.click(Pointer::Mouse, ".frames li:nth-child(1) .zoom");
    browser.wait_for("document.querySelector('dialog[open] .overlay-corners circle')");
    browser.hover("dialog .overlay-corners circle", [0.0, 0.0]);
    wait_until(tip, |tip| tip.starts_with("corner "));
    browser.keys(&[ESCAPE]);
    wait_until(|| text(browser, "dialog[open] figcaption"), String::is_empty);
}

fn the_rest(browser: &Browser) {
    let paper = "return getComputedStyle(document.body).backgroundColor";
    let light = browser.script(paper);
    browser.click(Pointer::Mouse, "#theme");
    wait_until(|| browser.script(paper), |dark| *dark != light);
    browser.click(Pointer::Mouse, "#theme");
    wait_until(|| browser.script(paper), |again| *again == light);
    browser.click(Pointer::Mouse, "#views details summary");
    browser.wait_for("document.querySelector('#views tbody').checkVisibility()");
}

/// On a fresh page the first thing that Tab reaches leads past its head.
fn first_tab(browser: &Browser) {
    browser.keys(&[TAB]);
    wait_until(|| text(browser, ":focus"), |focused| focused == "Skip to the findings");
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
