//! `paint`: strokes sent as a page sends them, over HTTP; what the files and the session are afterwards.
#![cfg(unix)]

use crate::common::{built_outfit, built_quick_session, fingerprint, overcoat, overcoat_ok};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A running server, which is stopped when it is dropped.
struct Server {
    child: Child,
    port: u16,
    token: String,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A response: status and body.
type Reply = (u16, Value);

impl Server {
    fn start(session: &Path, args: &[&str]) -> Self {
        Self::run(session, &[&["paint", "--no-browser"], args].concat())
    }

    fn run(session: &Path, args: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_overcoat"))
            .args(args)
            .current_dir(session)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let (_, after) = line.split_once("http://127.0.0.1:").unwrap_or_else(|| panic!("{line}"));
        let (port, token) = after.trim().split_once("/?token=").unwrap();
        let token = token.split('&').next().unwrap().to_string();
        Self { child, port: port.parse().unwrap(), token }
    }

    /// Sends a request and reads the reply.
    fn send(&self, method: &str, path: &str, headers: &str, body: &[u8]) -> Reply {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        let head =
            format!("{method} {path} HTTP/1.1\r\nConnection: close\r\nContent-Length: {}\r\n{headers}\r\n", body.len());
        stream.write_all(head.as_bytes()).unwrap();
        // The server may have answered a request that is too large before it was sent as a whole.
        let _ = stream.write_all(body);
        let mut reply = Vec::new();
        stream.read_to_end(&mut reply).unwrap();
        let text = String::from_utf8_lossy(&reply);
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or_else(|| panic!("{text}"));
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        let body =
            if head.to_lowercase().contains("transfer-encoding: chunked") { unchunked(body) } else { body.into() };
        (status, serde_json::from_str(&body).unwrap_or(Value::String(body)))
    }

    fn headers(&self) -> String {
        format!("Host: 127.0.0.1:{}\r\nX-Overcoat-Token: {}\r\n", self.port, self.token)
    }

    fn get(&self, path: &str) -> Reply {
        self.send("GET", path, &self.headers(), b"")
    }

    fn post(&self, path: &str, body: &Value) -> Reply {
        self.send("POST", path, &self.headers(), body.to_string().as_bytes())
    }

    fn layer(&self) -> Value {
        let (status, layer) = self.get("/api/layer?layer=tshirt");
        assert_eq!(status, 200, "{layer}");
        layer
    }

    /// The news of a layer: what all pages are told, and its labels.
    fn news(&self, layer: &str) -> (Value, Value) {
        let (_, mut news) = self.get(&format!("/api/news?layer={layer}"));
        let of_layer = news["layers"].as_array().unwrap().iter().find(|one| one["name"] == layer).unwrap().clone();
        (of_layer, news["labels"].take())
    }

    fn paint(&self, stroke: &Value) -> Value {
        let (status, answer) = self.post("/api/paint", stroke);
        assert_eq!(status, 200, "{answer}");
        answer
    }
}

fn unchunked(mut body: &str) -> String {
    let mut whole = String::new();
    while let Some((size, after)) = body.split_once("\r\n") {
        let size = usize::from_str_radix(size.trim(), 16).unwrap_or(0);
        if size == 0 {
            break;
        }
        whole += &after[..size];
        body = &after[size + 2..];
    }
    whole
}

/// A stroke on the chest that erases, 6 cm wide: the mesh is coarse.
fn stroke(id: &str, layer: &Value, op: &str) -> Value {
    let middle = &layer["middle"];
    let (x, y, z) = (middle[0].as_f64().unwrap(), middle[1].as_f64().unwrap(), middle[2].as_f64().unwrap());
    let points = json!([[x + 0.03, y + 0.3, z + 0.11], [x - 0.03, y + 0.3, z + 0.11]]);
    let strokes = json!([{ "op": op, "radius": 0.06, "points": points }]);
    json!({ "id": id, "layer": "tshirt", "scan": layer["scan"], "strokes": strokes })
}

fn step(id: &str, stroke: &str) -> Value {
    json!({ "id": id, "layer": "tshirt", "stroke": stroke })
}

fn brush_file(session: &Path) -> PathBuf {
    session.join("paint/tshirt.jsonl")
}

fn lines(session: &Path) -> usize {
    std::fs::read_to_string(brush_file(session)).map_or(0, |text| text.lines().count())
}

#[test]
fn strokes_change_labels_and_file_and_are_taken_back_to_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let recipe = || std::fs::read_to_string(session.join("recipe.toml")).unwrap();
    let unpainted = recipe();
    let server = Server::start(&session, &["tshirt"]);
    let layer = server.layer();
    assert_eq!(layer["news"]["strokes"], 0);
    let one = server.paint(&stroke("one", &layer, "erase"));
    assert!(one["labels"] != layer["labels"] && one["was_there"] == false, "{}", one["news"]);
    assert_eq!((&one["news"]["strokes"], &one["news"]["last"]), (&json!(1), &json!("one")));
    let first = std::fs::read(brush_file(&session)).unwrap();
    assert!(recipe().contains("paint/tshirt.jsonl"));

    // A retry is applied once; a second stroke is a line more.
    let again = server.paint(&stroke("one", &layer, "erase"));
    assert!(again["was_there"] == true && again["labels"] == one["labels"]);
    assert_eq!(std::fs::read(brush_file(&session)).unwrap(), first);
    let two = server.paint(&stroke("two", &layer, "add"));
    assert!(two["labels"] != one["labels"] && lines(&session) == 2);

    // Undo names its stroke; a late copy of it, or of the stroke, changes nothing.
    assert_eq!(server.post("/api/undo", &step("u0", "one")).0, 422);
    let undone = server.post("/api/undo", &step("u1", "two")).1;
    assert_eq!((&undone["labels"], &undone["news"]["redo"]), (&one["labels"], &json!("two")));
    assert_eq!(std::fs::read(brush_file(&session)).unwrap(), first);
    server.post("/api/undo", &step("u1", "two"));
    assert!(server.paint(&stroke("two", &layer, "add"))["was_there"] == true);
    assert_eq!(std::fs::read(brush_file(&session)).unwrap(), first);
    let redone = server.post("/api/redo", &step("r1", "two")).1;
    assert_eq!(redone["labels"], two["labels"]);
    assert_eq!(server.post("/api/undo", &step("u2", "two")).0, 200);

    // The file is a mask like any other: a replay gives the same artefacts.
    drop(server);
    overcoat_ok(&session, &["build", "-q"]);
    overcoat_ok(dir.path(), &["replay", "alice", "--into", "again", "-q"]);
    let of_cut = |session: &Path| {
        let state: Value = serde_json::from_slice(&std::fs::read(session.join("session.json")).unwrap()).unwrap();
        let steps = state["steps"].as_array().unwrap();
        let shirt = steps.iter().find(|step| step["name"] == "tshirt").unwrap();
        ["segment", "cut", "figure"].map(|stage| shirt["stages"][stage]["output"].clone())
    };
    assert_eq!(of_cut(&session), of_cut(&dir.path().join("again")));

    // Another server knows the strokes; without any the session is as before.
    let server = Server::start(&session, &[]);
    assert!(server.paint(&stroke("one", &layer, "erase"))["was_there"] == true);
    let (_, nothing) = server.post("/api/undo", &step("u3", "one"));
    assert_eq!(nothing["labels"], layer["labels"], "{nothing}");
    assert!(!brush_file(&session).exists() && recipe() == unpainted);
}

#[test]
fn strangers_and_senseless_requests_are_refused_in_a_sentence() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let server = Server::start(&session, &[]);
    let layer = server.layer();
    let before = fingerprint(&session);
    let host = format!("Host: 127.0.0.1:{}\r\n", server.port);
    let token = format!("X-Overcoat-Token: {}\r\n", server.token);
    let good = stroke("one", &layer, "erase");
    let mut other_layer = good.clone();
    other_layer["layer"] = json!("coat");
    let mut other_scan = good.clone();
    other_scan["scan"] = json!("0000");
    let mut in_the_air = good.clone();
    in_the_air["strokes"][0]["points"] = json!([[9, 9, 9]]);
    let mut all = good.clone();
    all["strokes"][0]["radius"] = json!(0.9);
    let whole = format!("{host}{token}");
    let body = |value: &Value| value.to_string().into_bytes();
    for (headers, path, body, status, says) in [
        (
            format!("{host}X-Overcoat-Token: 00\r\n"),
            "/api/paint",
            body(&good),
            403,
            "open the one that `overcoat paint`",
        ),
        (host.clone(), "/api/paint", body(&good), 403, "open the one"),
        (format!("{whole}Origin: http://evil.example\r\n"), "/api/paint", body(&good), 403, "another page may not"),
        (format!("Host: evil.example\r\n{token}"), "/api/paint", body(&good), 403, "only answers to its own address"),
        (whole.clone(), "/api/paint", body(&other_layer), 410, "there is no step 'coat'"),
        (whole.clone(), "/api/paint", body(&other_scan), 409, "was replaced meanwhile"),
        (whole.clone(), "/api/paint", body(&in_the_air), 422, "line 1 of the brush mask: it touches nothing"),
        (whole.clone(), "/api/paint", body(&all), 422, "nothing of the garment 'tshirt' is left"),
        (whole.clone(), "/api/paint", b"{\"id\":".to_vec(), 400, "cannot be understood"),
        (whole.clone(), "/api/paint", vec![b' '; 100_000_000], 413, "at most 1048576 bytes"),
        (whole.clone(), "/api/../recipe.toml", Vec::new(), 404, "nothing at this address"),
    ] {
        let (code, answer) = server.send("POST", path, &headers, &body);
        let error = answer["error"].as_str().unwrap_or_else(|| panic!("{answer}"));
        assert!(code == status && error.contains(says) && !error.contains('\n'), "{code} {error}");
    }
    let (code, page) = server.send("GET", "/?token=00", &host, b"");
    assert!(code == 403 && page.as_str().unwrap().contains("open the one"), "{page}");
    let (code, page) = server.send("GET", &format!("/?token={}", server.token), &host, b"");
    assert!(code == 200 && page.as_str().unwrap().contains("<title>alice: paint</title>"), "{page}");
    assert_eq!(server.send("GET", "/../recipe.toml", &host, b"").0, 404);
    let mut after = fingerprint(&session);
    after.retain(|path, _| before.contains_key(path));
    assert_eq!(after, before);
    assert!(!brush_file(&session).exists());

    // The port is in use.
    let answer = overcoat(&session, &["paint", "--no-browser", "--port", &server.port.to_string()]);
    assert!(answer.code == 2 && answer.stderr.contains("cannot be served on port"), "{answer:?}");
    let answer = overcoat(&session, &["paint", "coat", "--no-browser"]);
    assert!(answer.code == 2 && answer.stderr.contains("there is no step 'coat'"), "{answer:?}");
}

#[test]
fn other_commands_and_edits_meanwhile_lose_no_stroke() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let server = Server::start(&session, &[]);
    let layer = server.layer();
    let one = server.paint(&stroke("one", &layer, "erase"));
    // A build from the command line meanwhile.
    overcoat_ok(&session, &["build", "-q"]);
    let two = server.paint(&stroke("two", &layer, "add"));
    assert_eq!(lines(&session), 2);
    // `undo` of the session takes the last stroke back; the file follows with the next stroke.
    overcoat_ok(&session, &["undo", "-q"]);
    let three = server.paint(&stroke("three", &layer, "clear"));
    let text = std::fs::read_to_string(brush_file(&session)).unwrap();
    assert!(text.contains("\"one\"") && !text.contains("\"two\"") && text.contains("\"three\""), "{text}");
    assert!(one["labels"] != two["labels"] && three["labels"] != one["labels"]);
    assert_eq!(three["labels"], layer["labels"], "what was painted is cleared");
    // A line that somebody adds, or that a stopped server had not applied yet, counts.
    std::fs::write(brush_file(&session), text.replace("\"three\"", "\"four\"").replace("clear", "add")).unwrap();
    let five = server.paint(&stroke("five", &layer, "erase"));
    assert_eq!(five["news"]["strokes"], 3);
    assert!(server.paint(&stroke("four", &layer, "add"))["was_there"] == true);
    // A layer that is removed meanwhile.
    overcoat_ok(&session, &["step", "remove", "tshirt", "-q"]);
    let (code, answer) = server.post("/api/paint", &stroke("six", &layer, "add"));
    assert!(code == 410 && answer["error"].as_str().unwrap().contains("there is no step 'tshirt'"), "{code} {answer}");
    assert_eq!(lines(&session), 3);
}

#[test]
fn a_stroke_on_one_garment_of_an_outfit_shows_the_other_as_it_is_then() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_outfit(dir.path(), "alice");
    let server = Server::start(&session, &["tshirt"]);
    let shirt = server.layer();
    let skirt = |layer: &Value| {
        let others = layer["others"].as_array().unwrap().iter();
        others.filter(|other| other["name"] == "skirt").map(|other| other["labels"].clone()).next().unwrap()
    };
    let before = skirt(&shirt);
    // Cloth of the skirt, below the hip.
    let mut stroke = stroke("one", &shirt, "add");
    for point in stroke["strokes"][0]["points"].as_array_mut().unwrap() {
        point[1] = json!(point[1].as_f64().unwrap() - 0.42);
    }
    server.paint(&stroke);
    assert!(server.news("skirt").0["verdict"].is_null(), "it is out of date");
    let began = Instant::now();
    while ["skirt", "tshirt"].iter().any(|layer| server.news(layer).0["verdict"].is_null()) {
        assert!(began.elapsed() < Duration::from_secs(120), "no verdict");
        std::thread::sleep(Duration::from_millis(100));
    }
    let (news, labels) = server.news("skirt");
    assert!(labels != before && labels.is_string(), "the stroke takes from the skirt: {news}");
    assert_eq!(labels, skirt(&server.layer()), "a page that is opened now shows the same");
    assert!(news["hems"].as_u64().unwrap() > 0, "{news}");
    drop(server);
    assert_eq!(overcoat_ok(&session, &["status", "--json"]).json()["up_to_date"], true);
}

/// The covered vertices of a kind, in hexadecimal, and the rest of its file.
fn kind_file(session: &Path, name: &str) -> Option<(String, String)> {
    let text = std::fs::read_to_string(session.join(format!("templates/{name}.toml"))).ok()?;
    let (rest, covered) = text.split_once("covered = ").unwrap();
    Some((covered.into(), rest.into()))
}

#[test]
fn a_kind_painted_on_the_body_is_saved_undone_and_refused_like_a_garment() {
    let dir = tempfile::tempdir().unwrap();
    overcoat_ok(dir.path(), &["new", "bob"]);
    let session = dir.path().join("bob");
    let start =
        |args: &[&str]| Server::run(&session, &[&["templates", "paint", "--page", "--no-browser"], args].concat());
    for (args, says) in [
        (&["tshirt", "--page"][..], "'tshirt' is a built-in kind of garment"),
        (&["tshrt", "--page"], "tshirt"),
        (&["hair", "--page", "--name", "beard"], "grows on the body"),
        (&["tshirt", "--page", "--name", "vest"], "'vest' is a built-in kind of garment"),
        (&["tshirt", "--page", "--name", "a/b"], "cannot be the name"),
        (&["tshirt", "--name", "singlet", "out.ply"], "cannot be used with"),
        (&["tshirt", "out.ply", "--page"], "cannot be used with"),
        (&["tshirt"], "OUT.ply"),
    ] {
        let answer = overcoat(&session, &[&["templates", "paint"], args].concat());
        assert!(answer.code == 2 && answer.stderr.contains(says), "{args:?} {answer:?}");
    }

    let server = start(&["tshirt", "--name", "singlet"]);
    let show = |server: &Server| server.get("/api/layer?layer=singlet").1;
    let begin = show(&server);
    assert_eq!((&begin["news"]["hems"], &begin["news"]["last"]), (&json!(4), &Value::Null));
    assert!(kind_file(&session, "singlet").is_none(), "nothing is saved before something is painted");
    // Around the right upper arm, where the sleeve ends.
    let on_arm = |id: &str, op: &str| {
        let strokes = json!([{ "op": op, "radius": 0.1, "points": [[0.3, 1.38, 0.0], [0.5, 1.38, 0.0]] }]);
        json!({ "id": id, "layer": "singlet", "scan": begin["scan"], "strokes": strokes })
    };
    let painted = server.paint(&on_arm("a", "erase"));
    assert!(painted["labels"] != begin["labels"] && painted["news"]["last"] == "a", "{painted}");
    let (erased, text) = kind_file(&session, "singlet").unwrap();
    assert!(text.contains("otherwise like tshirt"), "{text}");
    assert_eq!(server.paint(&on_arm("a", "erase"))["was_there"], true);
    let again = server.paint(&on_arm("b", "clear"));
    assert_eq!(again["labels"], begin["labels"], "as it was found");
    let step = |id: &str, stroke: &str| json!({ "id": id, "layer": "singlet", "stroke": stroke });
    assert_eq!(server.post("/api/undo", &step("u", "b")).1["labels"], painted["labels"]);
    assert_eq!(server.post("/api/undo", &step("v", "b")).0, 409, "the last stroke is another one");
    assert_eq!(server.post("/api/redo", &step("r", "b")).1["labels"], begin["labels"]);
    assert_eq!(server.post("/api/undo", &step("w", "b")).1["labels"], painted["labels"]);
    assert_eq!(kind_file(&session, "singlet").unwrap().0, erased);

    // Nothing covered, off the body, another layer, another body: nothing changes.
    let before = fingerprint(&session);
    let wrong = |change: &dyn Fn(&mut Value)| {
        let mut request = on_arm("c", "erase");
        change(&mut request);
        let (code, answer) = server.post("/api/paint", &request);
        (code, answer["error"].as_str().unwrap_or_default().to_string())
    };
    let (code, error) = wrong(&|request| request["strokes"][0]["points"] = json!([[9, 9, 9]]));
    assert!(code == 422 && error.contains("it touches nothing"), "{code} {error}");
    assert_eq!(wrong(&|request| request["layer"] = json!("tshirt")).0, 410);
    assert_eq!(wrong(&|request| request["scan"] = json!("0000")).0, 409);
    assert_eq!(fingerprint(&session), before);

    // Another command takes the last change back; the page follows, and a stroke comes on top of what is there then.
    overcoat_ok(&session, &["undo"]);
    let deadline = Instant::now() + Duration::from_secs(20);
    while server.news("singlet").1 != begin["labels"] {
        assert!(Instant::now() < deadline, "the page does not follow");
        std::thread::sleep(Duration::from_millis(50));
    }
    server.paint(&on_arm("d", "erase"));
    assert_eq!(kind_file(&session, "singlet").unwrap().0, erased);
    drop(server);

    // Later, the painted kind is painted further under its own name.
    let server = start(&["singlet"]);
    assert_eq!(show(&server)["labels"], painted["labels"]);
    drop(server);
    let shown = overcoat_ok(&session, &["templates", "show", "singlet", "--json"]).json();
    assert_eq!(shown["template"]["painted"], true);
}
