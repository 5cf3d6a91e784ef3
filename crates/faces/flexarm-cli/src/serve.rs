//! `flexarm serve`: serves the web page, on which the program runs as WebAssembly, on this machine.

use std::fs::File;
use std::net::Ipv4Addr;
use std::path::{Component, Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use tiny_http::{Header, Method, Request, Response, Server};

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
    let server = Server::http((Ipv4Addr::LOCALHOST, args.port)).map_err(|error| {
        Failure::Usage(format!("port {} cannot be opened: {error}; without --port, a free one is taken", args.port))
    })?;
    let url = format!("http://{}/", server.server_addr());
    let json = || to_json(&serde_json::json!({ "url": url, "folder": folder.display().to_string() }));
    answer(terminal, json, || format!("{url}: the page of {}; Ctrl-C ends it\n", folder.display()));
    if !args.no_open {
        open_in_browser(url.as_ref());
    }
    for request in server.incoming_requests() {
        let folder = folder.clone();
        // A client that does not read its answer holds up its own thread only. Without a thread the
        // request is dropped, which answers it with status 500.
        let _ = std::thread::Builder::new().spawn(move || respond(request, &folder));
    }
    Ok(ExitCode::SUCCESS)
}

/// Answers with a file of the folder, compressed if there is one beside it and the browser takes it,
/// or with a status that says why not.
fn respond(request: Request, folder: &Path) {
    let open = |path: &Path| File::open(path).ok().filter(|file| file.metadata().is_ok_and(|found| found.is_file()));
    let takes_gzip = request.headers().iter().any(|header| {
        header.field.equiv("Accept-Encoding")
            && header.value.as_str().split([',', ';']).any(|word| word.trim() == "gzip")
    });
    let file = requested(request.url()).and_then(|path| {
        let path = folder.join(path);
        let packed = path.with_added_extension("gz");
        let packed = open(&packed).filter(|_| takes_gzip);
        let is_packed = packed.is_some();
        Some((packed.or_else(|| open(&path))?, path, is_packed))
    });
    let header = |field: &str, value: &str| Header::from_bytes(field, value).expect("the header is ASCII");
    // The browser may be gone.
    let _ = match file {
        _ if !matches!(request.method(), Method::Get | Method::Head) => request.respond(Response::empty(405)),
        Some((file, path, is_packed)) => {
            let answer = Response::from_file(file)
                .with_header(header("Content-Type", content_type(&path)))
                .with_header(header("Vary", "Accept-Encoding"))
                .with_header(header("Cache-Control", "no-cache"));
            let packed = header("Content-Encoding", "gzip");
            request.respond(if is_packed { answer.with_header(packed) } else { answer })
        }
        None => request.respond(Response::empty(404)),
    };
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
