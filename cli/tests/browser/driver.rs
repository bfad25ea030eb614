//! A real browser, driven through chromedriver by the WebDriver protocol (<https://www.w3.org/TR/webdriver2/>): JSON
//! over HTTP on this machine. Only what these tests need.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    path::Path,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use serde_json::{Value, json};

/// Where Debian and others put the browser.
const BROWSERS: [&str; 4] =
    ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// How long a page may take to do what is expected of it. Only a failing test ever waits so long.
const PATIENCE: Duration = Duration::from_secs(20);

/// Asks until the answer is as expected: a page answers to what is done to it when it gets round to it.
#[track_caller]
pub(crate) fn wait_until<T: std::fmt::Debug>(
    ask: impl Fn() -> T,
    expected: impl Fn(&T) -> bool,
) -> T {
    let deadline = Instant::now() + PATIENCE;
    loop {
        let answer = ask();
        if expected(&answer) {
            return answer;
        }
        assert!(Instant::now() < deadline, "{} s, and still {answer:?}", PATIENCE.as_secs());
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Key codes of the protocol (17.4.2).
pub(crate) const TAB: char = '\u{e004}';
pub(crate) const HOME: char = '\u{e011}';
pub(crate) const LEFT: char = '\u{e012}';
pub(crate) const UP: char = '\u{e013}';
pub(crate) const RIGHT: char = '\u{e014}';
pub(crate) const ESCAPE: char = '\u{e00c}';
pub(crate) const ENTER: char = '\u{e007}';

/// A browser with one window. Ends with its driver when dropped.
pub(crate) struct Browser {
    driver: Child,
    port: u16,
    session: String,
}

/// What points at the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pointer {
    Mouse,
    Touch,
}

impl Pointer {
    const fn name(self) -> &'static str {
        match self {
            Self::Mouse => "mouse",
            Self::Touch => "touch",
        }
    }
}

/// The program of this name in the search path.
fn program(name: &str) -> Option<std::path::PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(name)).find(|path| path.is_file())
}

impl Browser {
    /// Starts chromedriver and a headless browser; `Err` says what is missing on this machine.
    pub(crate) fn start() -> Result<Self, String> {
        let binary = BROWSERS.into_iter().find_map(program).ok_or("no Chromium in the PATH")?;
        let driver = program("chromedriver").ok_or("no chromedriver in the PATH")?;
        let mut driver = Command::new(driver)
            .arg("--port=0")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|e| format!("chromedriver does not start: {e}"))?;
        let stdout = driver.stdout.take().expect("it is piped");
        let port = BufReader::new(stdout).lines().map_while(Result::ok).find_map(|line| {
            let (_, port) = line.split_once("started successfully on port ")?;
            port.trim_end_matches('.').parse().ok()
        });
        let port = port.expect("chromedriver says on which port it listens");
        let mut browser = Self { driver, port, session: String::new() };
        let answer = browser.call(
            "POST",
            "/session",
            &json!({"capabilities": {"alwaysMatch": {
                "browserName": "chrome",
                "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"},
                "goog:chromeOptions": {"binary": binary, "args": [
                    "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
                    "--disable-background-networking", "--disable-component-update", "--disable-sync",
                    "--disable-dev-shm-usage", "--hide-scrollbars", "--force-color-profile=srgb",
                ]},
            }}}),
        );
        browser.session = answer["sessionId"].as_str().expect("a session has a name").to_owned();
        Ok(browser)
    }

    /// One request of the protocol; its `value`.
    #[track_caller]
    fn call(&self, method: &str, path: &str, body: &Value) -> Value {
        let body = if method == "POST" { body.to_string() } else { String::new() };
        let mut stream =
            TcpStream::connect(("127.0.0.1", self.port)).expect("chromedriver listens");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a minute is a time");
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n\
             Content-Length: {}\r\nConnection: close\r\n\r\n{body}",
            body.len()
        )
        .expect("chromedriver reads");
        let mut answer = Vec::new();
        // Some versions keep the line open in spite of `Connection: close`: read what the header announces.
        let mut reader = BufReader::new(stream);
        let mut length = 0;
        loop {
            let mut line = String::new();
            reader.read_line(&mut line).expect("a header");
            let line = line.trim_end().to_ascii_lowercase();
            if let Some(value) = line.strip_prefix("content-length:") {
                length = value.trim().parse().expect("a length");
            }
            if line.is_empty() {
                break;
            }
        }
        reader.take(length).read_to_end(&mut answer).expect("a body");
        let answer: Value = serde_json::from_slice(&answer).expect("JSON");
        let value = answer["value"].clone();
        assert!(value["error"].is_null(), "{method} {path}: {value}");
        value
    }

    #[track_caller]
    fn post(&self, path: &str, body: &Value) -> Value {
        self.call("POST", &format!("/session/{}{path}", self.session), body)
    }

    /// A command of Chromium's own protocol.
    fn devtools(&self, command: &str, parameters: &Value) -> Value {
        self.post("/goog/cdp/execute", &json!({"cmd": command, "params": parameters}))
    }

    /// Opens a file and waits until it has loaded.
    pub(crate) fn open(&self, path: &Path) {
        self.post("/url", &json!({"url": format!("file://{}", path.display())}));
    }

    /// What a piece of script returns.
    #[track_caller]
    pub(crate) fn script(&self, script: &str) -> Value {
        self.post("/execute/sync", &json!({"script": script, "args": []}))
    }

    /// Waits until an expression is true.
    #[track_caller]
    pub(crate) fn wait_for(&self, expression: &str) {
        let is = format!("return Boolean({expression}) || {expression:?}");
        wait_until(|| self.script(&is), |answer| *answer == true);
    }

    /// Waits until the screen has been drawn anew: what has been scrolled has told so, what draws has drawn.
    pub(crate) fn next_frame(&self) {
        self.script(
            "return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))",
        );
    }

    /// The size of the window and whether it is a phone's.
    pub(crate) fn window(&self, width: usize, height: usize, pointer: Pointer) {
        let is_phone = pointer == Pointer::Touch;
        self.devtools(
            "Emulation.setDeviceMetricsOverride",
            &json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": is_phone}),
        );
        self.devtools("Emulation.setTouchEmulationEnabled", &json!({"enabled": is_phone}));
    }

    /// `light` or `dark`; `screen` or `print`.
    pub(crate) fn media(&self, scheme: &str, media: &str) {
        let features = json!([{"name": "prefers-color-scheme", "value": scheme}]);
        self.devtools("Emulation.setEmulatedMedia", &json!({"media": media, "features": features}));
    }

    /// Puts the first element of a selector into the middle of the window; its centre there.
    #[track_caller]
    pub(crate) fn center_of(&self, selector: &str) -> [f64; 2] {
        self.script(&format!(
            "document.querySelector({selector:?}).scrollIntoView({{block: 'center', behavior: 'instant'}})"
        ));
        // The event of scrolling comes with the next frame, and hides tips: a pointer must not be quicker.
        self.next_frame();
        let place = self.script(&format!(
            "const b = document.querySelector({selector:?}).getBoundingClientRect();
             return [b.x + b.width / 2, b.y + b.height / 2];"
        ));
        [0, 1].map(|axis| place[axis].as_f64().expect("a number"))
    }

    /// Presses a pointer down on an element, off its centre by `from`, moves it to `to` and lets it go.
    #[track_caller]
    pub(crate) fn drag(&self, pointer: Pointer, selector: &str, from: [f64; 2], to: [f64; 2]) {
        let [x, y] = self.center_of(selector);
        let at = |[dx, dy]: [f64; 2], ms: u32| {
            let (x, y) = ((x + dx).round(), (y + dy).round());
            json!({"type": "pointerMove", "duration": ms, "x": x, "y": y})
        };
        let middle = [0, 1].map(|axis| f64::midpoint(from[axis], to[axis]));
        let actions = json!([
            at(from, 0), {"type": "pointerDown", "button": 0}, at(middle, 60), at(to, 60),
            {"type": "pointerUp", "button": 0},
        ]);
        self.act(pointer, &[actions]);
    }

    /// Two fingers on an element that move apart along x, from `from` to `to` pixels.
    #[track_caller]
    pub(crate) fn pinch(&self, selector: &str, from: f64, to: f64) {
        let [x, y] = self.center_of(selector);
        let finger = |side: f64| {
            let at = |apart: f64, ms: u32| {
                let x = (x + side * apart / 2.0).round();
                json!({"type": "pointerMove", "duration": ms, "x": x, "y": y.round()})
            };
            json!([
                at(from, 0), {"type": "pointerDown", "button": 0}, at(to, 80), {"type": "pointerUp", "button": 0},
            ])
        };
        self.act(Pointer::Touch, &[finger(-1.0), finger(1.0)]);
    }

    /// Moves the mouse over an element, off its centre by `by`.
    #[track_caller]
    pub(crate) fn hover(&self, selector: &str, [dx, dy]: [f64; 2]) {
        let [x, y] = self.center_of(selector);
        let (x, y) = ((x + dx).round(), (y + dy).round());
        // Two moves: the first may only enter.
        let moves = [0.0, 1.0]
            .map(|step| json!({"type": "pointerMove", "duration": 20, "x": x + step, "y": y}));
        self.act(Pointer::Mouse, &[json!(moves)]);
    }

    #[track_caller]
    pub(crate) fn click(&self, pointer: Pointer, selector: &str) {
        self.drag(pointer, selector, [0.0; 2], [0.0; 2]);
    }

    #[track_caller]
    fn act(&self, pointer: Pointer, fingers: &[Value]) {
        let sources: Vec<Value> = fingers
            .iter()
            .enumerate()
            .map(|(index, actions)| {
                json!({
                    "type": "pointer", "id": format!("{}{index}", pointer.name()),
                    "parameters": {"pointerType": pointer.name()}, "actions": actions,
                })
            })
            .collect();
        self.post("/actions", &json!({"actions": sources}));
        self.call("DELETE", &format!("/session/{}/actions", self.session), &Value::Null);
    }

    /// Presses keys one after the other on what has the focus.
    #[track_caller]
    pub(crate) fn keys(&self, keys: &[char]) {
        let actions: Vec<Value> = keys
            .iter()
            .flat_map(|key| {
                ["keyDown", "keyUp"].map(|kind| json!({"type": kind, "value": key.to_string()}))
            })
            .collect();
        self.post(
            "/actions",
            &json!({"actions": [{"type": "key", "id": "keys", "actions": actions}]}),
        );
    }

    /// A PNG of the whole page at the window's width.
    pub(crate) fn screenshot(&self, path: &Path) {
        let options = json!({"format": "png", "captureBeyondViewport": true});
        let shot = self.devtools("Page.captureScreenshot", &options);
        let png = from_base64(shot["data"].as_str().expect("base64"));
        std::fs::write(path, png).expect("target/ can be written");
    }

    /// What the page said on its console since the last call, warnings and errors first of all.
    pub(crate) fn console(&self) -> Vec<String> {
        self.log("browser").into_iter().map(|entry| entry["message"].to_string()).collect()
    }

    /// Addresses that were asked for since the last call, without `data:`.
    pub(crate) fn requests(&self) -> Vec<String> {
        self.log("performance")
            .into_iter()
            .filter_map(|entry| {
                let message: Value = serde_json::from_str(entry["message"].as_str()?).ok()?;
                let event = &message["message"];
                let is_request = event["method"] == "Network.requestWillBeSent";
                let url = event["params"]["request"]["url"].as_str()?;
                (is_request && !url.starts_with("data:")).then(|| url.to_owned())
            })
            .collect()
    }

    fn log(&self, kind: &str) -> Vec<Value> {
        let entries = self.post("/se/log", &json!({"type": kind}));
        entries.as_array().cloned().unwrap_or_default()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Without this the browser would outlive its driver. A panic here would hide the one that matters.
        if let Ok(mut stream) = TcpStream::connect(("127.0.0.1", self.port)) {
            let session = &self.session;
            let head = format!(
                "DELETE /session/{session} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"
            );
            stream.write_all(head.as_bytes()).ok();
            stream.set_read_timeout(Some(Duration::from_secs(5))).ok();
            stream.read_to_end(&mut Vec::new()).ok();
        }
        self.driver.kill().ok();
        self.driver.wait().ok();
    }
}

/// RFC 4648, section 4, of well-formed text.
fn from_base64(text: &str) -> Vec<u8> {
    let value = |letter: u8| match letter {
        b'A'..=b'Z' => letter - b'A',
        b'a'..=b'z' => letter - b'a' + 26,
        b'0'..=b'9' => letter - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    for group in text.trim_end_matches('=').as_bytes().chunks(4) {
        let bits = group.iter().fold(0u32, |bits, letter| bits << 6 | u32::from(value(*letter)));
        let bits = bits << (6 * (4 - group.len()));
        bytes.extend_from_slice(&bits.to_be_bytes()[1..group.len()]);
    }
    bytes
}
