//! `flexarm serve`: serves the web page, on which the program runs as WebAssembly, on this machine.
//!
//! Start at [`run`]; [`requested`] turns an address into a path inside the folder. Local requests
//! only. Not here: the page itself (`web/`).

use std::net::{Ipv4Addr, TcpListener};
use std::path::{Component, Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use oxhttp::Server;
use oxhttp::model::header::{ACCEPT_ENCODING, CACHE_CONTROL, CONTENT_ENCODING, CONTENT_TYPE, VARY};
use oxhttp::model::{Body, Method, Request, Response, StatusCode};

use crate::failure::Failure;
use crate::shipped;
use crate::terminal::{Terminal, answer, to_json};
use crate::view::open_in_browser;

#[derive(Debug, Args)]
pub(crate) struct ServeArgs {
    /// Port on the loopback interface; 0 takes a free one
    #[arg(long, default_value_t = 0, value_name = "N")]
    port: u16,
    /// Do not open the browser
    #[arg(long)]
    no_open: bool,
}

/// Serves the page until the process is stopped. Only programs on this machine reach it.
pub(crate) fn run(terminal: &Terminal, args: &ServeArgs) -> Result<ExitCode, Failure> {
    let folder = shipped::web_page()?;
    // Bound twice: port 0 gets its number, and a port in use is refused here.
    let address = TcpListener::bind((Ipv4Addr::LOCALHOST, args.port)).and_then(|listener| listener.local_addr());
    let refused = |error| {
        Failure::Usage(format!("port {} cannot be opened: {error}; without --port, a free one is taken", args.port))
    };
    let address = address.map_err(refused)?;
    let served = folder.clone();
    let server = Server::new(move |request| respond(request, &served)).bind(address).spawn().map_err(refused)?;
    let url = format!("http://{address}/");
    let json = || to_json(&serde_json::json!({ "url": url, "folder": folder.display().to_string() }));
    answer(terminal, json, || format!("{url}: the page of {}; Ctrl-C ends it\n", folder.display()));
    if !args.no_open {
        open_in_browser(url.as_ref());
    }
    server.join().map_err(refused)?;
    Ok(ExitCode::SUCCESS)
}

/// Answers with a file of the folder, compressed if there is one beside it and the browser takes it,
/// or with a status that says why not.
fn respond(request: &Request<Body>, folder: &Path) -> Response<Body> {
    let status = |status: StatusCode| {
        let mut response = Response::new(Body::empty());
        *response.status_mut() = status;
        response
    };
    if !matches!(*request.method(), Method::GET | Method::HEAD) {
        return status(StatusCode::METHOD_NOT_ALLOWED);
    }
    let accepted = request.headers().get_all(ACCEPT_ENCODING).iter().filter_map(|value| value.to_str().ok());
    let takes_gzip = accepted.flat_map(|value| value.split([',', ';'])).any(|word| word.trim() == "gzip");
    let Some(path) = requested(request.uri().path()).map(|path| folder.join(path)) else {
        return status(StatusCode::NOT_FOUND);
    };
    let packed = takes_gzip.then(|| std::fs::read(path.with_added_extension("gz")).ok()).flatten();
    let response = Response::builder()
        .header(CONTENT_TYPE, content_type(&path))
        .header(VARY, "Accept-Encoding")
        .header(CACHE_CONTROL, "no-cache");
    let response = if packed.is_some() { response.header(CONTENT_ENCODING, "gzip") } else { response };
    match packed.or_else(|| std::fs::read(&path).ok()) {
        // The server would send a body after HEAD too.
        Some(bytes) => response
            .body(if request.method() == Method::HEAD { Body::empty() } else { Body::from(bytes) })
            .expect("the headers are ASCII"),
        None => status(StatusCode::NOT_FOUND),
    }
}

/// Returns the path of a file below the folder that an address names.
pub fn requested(url: &str) -> Option<PathBuf> {
    let path = url.split(['?', '#']).next()?.strip_prefix('/')?;
    let path = PathBuf::from(if path.is_empty() { "index.html" } else { path });
    path.components().all(|part| matches!(part, Component::Normal(_))).then_some(path)
}

fn content_type(path: &Path) -> &'static str {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript",
        Some("css") => "text/css",
        Some("json") => "application/json",
        Some("wasm") => "application/wasm",
        _ => "application/octet-stream",
    }
}
