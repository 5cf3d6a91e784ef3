//! `flexarm serve`: which files the server on the loopback interface gives, and how.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Stdio};

use crate::common::Place;

/// A running server, stopped when dropped.
struct Server {
    process: Child,
    address: String,
}

impl Drop for Server {
    fn drop(&mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }
}

impl Server {
    fn start(place: &Place) -> Self {
        let mut process = place
            .command(&["serve", "--no-open", "--json"])
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let said: serde_json::Value = serde_json::from_str(&line).unwrap();
        let url = said["url"].as_str().unwrap();
        let address = url.strip_prefix("http://").and_then(|rest| rest.strip_suffix('/')).unwrap().to_owned();
        assert_eq!(said["folder"], "./web");
        Self { process, address }
    }

    /// Returns the head and the body of the answer.
    fn ask(&self, method: &str, path: &str) -> (String, String) {
        let mut stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(std::time::Duration::from_secs(60))).unwrap();
        write!(stream, "{method} {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", self.address).unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        let (head, body) = text.split_once("\r\n\r\n").unwrap();
        (head.to_owned(), body.to_owned())
    }
}

#[test]
fn the_page_is_served_on_the_loopback_interface_and_nothing_beside_it() {
    let place = Place::new();
    std::fs::create_dir_all(place.path("web/assets")).unwrap();
    for (name, text) in [("index.html", "the page"), ("flexarm.wasm", "module"), ("assets/main.js", "script")] {
        place.write(&format!("web/{name}"), text);
    }
    let server = Server::start(&place);
    assert!(server.address.starts_with("127.0.0.1:"), "{}", server.address);
    for (path, kind, body) in [
        ("/", "text/html", "the page"),
        ("/flexarm.wasm?v=2", "application/wasm", "module"),
        ("/assets/main.js", "text/javascript", "script"),
    ] {
        let (head, got) = server.ask("GET", path);
        assert!(head.starts_with("HTTP/1.1 200") && head.contains(&format!("content-type: {kind}")), "{head}");
        assert_eq!(got, body);
    }
    let (head, body) = server.ask("HEAD", "/");
    assert!(head.starts_with("HTTP/1.1 200") && body.is_empty(), "{head}\n{body}");
    for missing in ["/../robot.toml", "/assets/../../robot.toml", "/assets", "/none"] {
        assert!(server.ask("GET", missing).0.starts_with("HTTP/1.1 404"), "{missing}");
    }
    assert!(server.ask("POST", "/").0.starts_with("HTTP/1.1 405"));
}

#[test]
fn a_browser_that_keeps_its_connections_open_gets_an_answer_on_each() {
    let place = Place::new();
    std::fs::create_dir(place.path("web")).unwrap();
    place.write("web/flexarm.wasm", "module");
    place.write("web/index.html", "the page");
    let server = Server::start(&place);
    let mut streams: Vec<_> = (0..32).map(|_| TcpStream::connect(&server.address).unwrap()).collect();
    for stream in &mut streams {
        stream.set_read_timeout(Some(std::time::Duration::from_secs(20))).unwrap();
        write!(stream, "GET / HTTP/1.1\r\nHost: {}\r\n\r\n", server.address).unwrap();
    }
    for stream in &mut streams {
        stream.read_exact(&mut [0; 12]).expect("an answer, with the other connections open");
    }
}

#[test]
fn a_port_in_use_gets_a_message_with_the_remedy() {
    let place = Place::new();
    std::fs::create_dir(place.path("web")).unwrap();
    place.write("web/flexarm.wasm", "module");
    let server = Server::start(&place);
    let (_, port) = server.address.split_once(':').unwrap();
    place.refused(&["serve", "--no-open", "--port", port], &[port, "in use", "without --port"]);
}

#[test]
fn a_client_that_does_not_read_its_answer_holds_up_no_other() {
    let place = Place::new();
    std::fs::create_dir(place.path("web")).unwrap();
    place.write("web/index.html", "the page");
    // More than the buffers of a connection.
    std::fs::File::create(place.path("web/flexarm.wasm")).unwrap().set_len(64 << 20).unwrap();
    let server = Server::start(&place);
    let mut silent = Vec::new();
    for _ in 0..8 {
        let mut stream = TcpStream::connect(&server.address).unwrap();
        write!(stream, "GET /flexarm.wasm HTTP/1.1\r\nHost: {}\r\n\r\n", server.address).unwrap();
        stream.read_exact(&mut [0; 12]).unwrap(); // the answer has begun
        silent.push(stream);
    }
    assert_eq!(server.ask("GET", "/").1, "the page");
}
