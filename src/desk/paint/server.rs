//! The server: who may ask, what is asked, and the answer.

use super::easel::Easel;
use super::kind::KindEasel;
use super::refusal::{Kind, Refusal};
use super::requests::read;
use super::subject::Subject;
use crate::desk::error::DeskError;
use crate::desk::html::{escaped, one_module};
use crate::session::Session;
use serde_json::Value;
use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::io::Read;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tiny_http::{Header, Method, Request, Response, Server};

/// Largest request, in bytes: the longest stroke has 0.7 MB.
const LARGEST_BODY: usize = 1 << 20;
/// Requests that are answered at the same time: two pages, each with a stroke and a look for news.
const THREADS: usize = 4;
/// The status of requests from another page or without the token.
const FORBIDDEN: u16 = 403;
/// How soon the server notices that it is to end.
const POLL: Duration = Duration::from_millis(100);
/// The header that proves that the sender is the page.
const TOKEN_HEADER: &str = "X-Overcoat-Token";

const PAGE: &str = include_str!("../pages/paint.html");
const STYLE: &str = concat!(include_str!("../pages/page.css"), include_str!("../pages/paint.css"));
const MODULES: [&str; 7] = [
    include_str!("../pages/pack.js"),
    include_str!("../pages/math.js"),
    include_str!("../pages/viewer.js"),
    include_str!("../pages/surface.js"),
    include_str!("../pages/outbox.js"),
    include_str!("../pages/keys.js"),
    include_str!("../pages/paint.js"),
];
/// Nothing is loaded from elsewhere, and nothing is sent elsewhere.
const POLICY: &str = "default-src 'none'; connect-src 'self'; img-src data:; script-src 'self'; style-src 'self' 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The server of a page on which garments, or a kind of them, are painted.
pub struct Painting {
    server: Server,
    easel: Box<dyn Subject>,
    port: u16,
    token: String,
    layer: Option<String>,
}

/// What is sent back.
struct Answer {
    status: u16,
    kind: &'static str,
    body: String,
}

impl Answer {
    fn json(status: u16, value: &Value) -> Self {
        Self { status, kind: "application/json; charset=utf-8", body: value.to_string() }
    }

    fn page(status: u16, body: String) -> Self {
        Self { status, kind: "text/html; charset=utf-8", body }
    }
}

impl Painting {
    /// Opens the session to paint its garments.
    ///
    /// **Errors** if the port is in use, or if there is no such layer.
    pub fn of_layers(dir: &Path, layer: Option<&str>, port: Option<u16>) -> Result<Self, DeskError> {
        if let Some(layer) = layer {
            Session::open(dir)?.painted_strokes(layer)?;
        }
        Self::begin(Box::new(Easel::begin(dir)?), layer, port)
    }

    /// Opens the session to paint the kind of garment `name`, which begins as `kind` is; they may be the same painted kind.
    ///
    /// **Errors** if the port is in use, if there is no such kind, or if `name` is a built-in one.
    pub fn of_kind(dir: &Path, kind: &str, name: &str, port: Option<u16>) -> Result<Self, DeskError> {
        Self::begin(Box::new(KindEasel::begin(dir, kind, name)?), None, port)
    }

    /// Opens a port of this machine: any free one, or that one.
    fn begin(easel: Box<dyn Subject>, layer: Option<&str>, port: Option<u16>) -> Result<Self, DeskError> {
        let port = port.unwrap_or(0);
        let unserved = |reason: String| DeskError::Port { port, reason };
        let server = Server::http(("127.0.0.1", port)).map_err(|e| unserved(e.to_string()))?;
        let address = server.server_addr().to_ip().ok_or_else(|| unserved("it is no address of a network".into()))?;
        // Keyed by the operating system's random numbers.
        let random = RandomState::new();
        let token = format!("{:016x}{:016x}", random.hash_one("overcoat"), random.hash_one("paint"));
        Ok(Self { server, easel, port: address.port(), token, layer: layer.map(String::from) })
    }

    /// The address of the page. Its token holds as long as this server runs.
    pub fn address(&self) -> String {
        let layer = self.layer.as_ref().map(|layer| format!("&layer={layer}")).unwrap_or_default();
        format!("http://127.0.0.1:{}/?token={}{layer}", self.port, self.token)
    }

    /// Answers until `ended`; returns the number of changes.
    pub fn serve(&self, ended: &AtomicBool) -> usize {
        std::thread::scope(|scope| {
            for _ in 0..THREADS {
                scope.spawn(|| {
                    while !ended.load(Ordering::Relaxed) {
                        if let Ok(Some(request)) = self.server.recv_timeout(POLL) {
                            self.respond(request);
                        }
                    }
                });
            }
            scope.spawn(|| self.easel.watch(ended));
        });
        self.easel.changes()
    }

    fn respond(&self, mut request: Request) {
        let answer = self.answer(&mut request).unwrap_or_else(|refusal| match request.url().starts_with("/api/") {
            true => Answer::json(refusal.status, &refusal.to_json()),
            false => Answer::page(
                refusal.status,
                format!(
                    "<!doctype html><html lang=\"en\"><title>overcoat paint</title><p>{}</p>",
                    escaped(&refusal.what)
                ),
            ),
        });
        let mut response = Response::from_data(answer.body).with_status_code(answer.status);
        let headers = [
            ("Content-Type", answer.kind),
            ("Content-Security-Policy", POLICY),
            ("Cache-Control", "no-store"),
            ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
        ];
        for (name, value) in headers {
            if let Ok(header) = Header::from_bytes(name, value) {
                response.add_header(header);
            }
        }
        let is_of_stranger = answer.status == FORBIDDEN;
        // Who is gone needs no answer.
        let respond = move || drop(request.respond(response));
        if is_of_stranger {
            // It reads what the sender has still to send, however slowly that comes; nobody else waits for it.
            std::thread::spawn(respond);
        } else {
            respond();
        }
    }

    fn answer(&self, request: &mut Request) -> Result<Answer, Refusal> {
        self.check_sender(request)?;
        let url = request.url().to_string();
        let (path, query) = url.split_once('?').unwrap_or((&url, ""));
        match (request.method(), path) {
            (Method::Get, "/") => {
                self.check_token(value_in(query, "token").as_deref())?;
                // The title last: it may hold anything.
                let page = PAGE.replace("{{ID}}", &self.easel.id()).replace("{{SURFACE}}", self.easel.surface());
                return Ok(Answer::page(200, page.replace("{{TITLE}}", &escaped(&self.easel.title()))));
            }
            (Method::Get, "/paint.js") => {
                let kind = "text/javascript; charset=utf-8";
                return Ok(Answer { status: 200, kind, body: one_module(&MODULES) });
            }
            (Method::Get, "/paint.css") => {
                return Ok(Answer { status: 200, kind: "text/css; charset=utf-8", body: STYLE.into() });
            }
            (_, path) if !path.starts_with("/api/") => return Err(nothing_there()),
            _ => {}
        }
        self.check_token(header(request, TOKEN_HEADER).as_deref())?;
        let layer = value_in(query, "layer");
        let named = || layer.clone().ok_or_else(|| Refusal::new(400, Kind::Refused, "this request names no layer"));
        let value = match (request.method(), path) {
            (Method::Get, "/api/news") => {
                self.easel.news(layer.as_deref(), value_in(query, "version").and_then(|v| v.parse().ok()))
            }
            (Method::Get, "/api/layer") => self.easel.layer(&named()?)?,
            (Method::Get, "/api/cut") => self.easel.cut(&named()?)?,
            (Method::Post, "/api/paint") => self.easel.paint(&read(&body(request)?)?)?,
            (Method::Post, "/api/undo") => self.easel.undo(&read(&body(request)?)?)?,
            (Method::Post, "/api/redo") => self.easel.redo(&read(&body(request)?)?)?,
            _ => return Err(nothing_there()),
        };
        Ok(Answer::json(200, &value))
    }

    /// Refuses other pages: those of another origin, and those that reach this machine under another name.
    fn check_sender(&self, request: &Request) -> Result<(), Refusal> {
        let own = ["127.0.0.1", "localhost"].map(|host| format!("{host}:{}", self.port));
        let stranger = |what: &str| Err(Refusal::new(FORBIDDEN, Kind::Stranger, what));
        match header(request, "Host") {
            Some(host) if own.contains(&host) => {}
            _ => return stranger("this server only answers to its own address, as `overcoat paint` prints it"),
        }
        match header(request, "Origin") {
            Some(origin) if !own.iter().any(|own| origin == format!("http://{own}")) => {
                stranger("another page may not paint this session")
            }
            _ => Ok(()),
        }
    }

    fn check_token(&self, token: Option<&str>) -> Result<(), Refusal> {
        match token == Some(self.token.as_str()) {
            true => Ok(()),
            false => Err(Refusal::new(
                FORBIDDEN,
                Kind::Stranger,
                "this address is not, or no longer, valid: open the one that `overcoat paint` has printed last",
            )),
        }
    }
}

fn nothing_there() -> Refusal {
    Refusal::new(404, Kind::Refused, "there is nothing at this address")
}

fn header(request: &Request, name: &str) -> Option<String> {
    let found = request.headers().iter().find(|header| header.field.as_str().as_str().eq_ignore_ascii_case(name))?;
    Some(found.value.as_str().to_string())
}

fn body(request: &mut Request) -> Result<Vec<u8>, Refusal> {
    let too_large = || Refusal::new(413, Kind::Refused, format!("a request has at most {LARGEST_BODY} bytes"));
    if request.body_length().is_some_and(|length| length > LARGEST_BODY) {
        return Err(too_large());
    }
    let mut body = Vec::new();
    let cut_off = |e: std::io::Error| Refusal::new(400, Kind::Later, format!("the request was cut off: {e}"));
    request.as_reader().take(LARGEST_BODY as u64 + 1).read_to_end(&mut body).map_err(cut_off)?;
    if body.len() > LARGEST_BODY { Err(too_large()) } else { Ok(body) }
}

/// A value of a query, with `%XX` read.
fn value_in(query: &str, name: &str) -> Option<String> {
    let raw = query.split('&').find_map(|part| part.strip_prefix(name)?.strip_prefix('='))?;
    let mut bytes = Vec::new();
    let mut rest = raw.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        let hex = (byte == b'%').then(|| std::str::from_utf8(after.get(..2)?).ok()).flatten();
        match hex.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(value) => {
                bytes.push(value);
                rest = &after[2..];
            }
            None => bytes.push(byte),
        }
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_from_a_query() {
        let query = "token=ab&layer=t%20shirt%C3%A9&version=3";
        assert_eq!(value_in(query, "layer").unwrap(), "t shirté");
        assert_eq!(value_in(query, "version").unwrap(), "3");
        assert_eq!(value_in(query, "tok"), None);
        assert_eq!(value_in("a=%zz%", "a").unwrap(), "%zz%");
    }
}
