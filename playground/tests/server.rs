//! The server on a real socket, and those who would bring it down.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use n3p_play::server::{LARGEST_BODY, Server, runtime};

/// A server on a port of its own, for as long as the tests run.
fn start() -> SocketAddr {
    let (tell, told) = std::sync::mpsc::channel();
    thread::spawn(move || {
        runtime().unwrap().block_on(async {
            let server = Server::listen(0).await.unwrap();
            tell.send(server.address()).unwrap();
            server.serve().await;
        });
    });
    told.recv().unwrap()
}

fn connect(server: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(server).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    stream.set_write_timeout(Some(Duration::from_secs(60))).unwrap();
    stream
}

/// What comes back, to the end of the connection.
fn rest(mut stream: &TcpStream) -> String {
    let mut bytes = Vec::new();
    // Who is refused while still sending may be cut off; what came before that counts.
    let _ = stream.read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}

fn send(server: SocketAddr, request: &[u8]) -> String {
    let mut stream = connect(server);
    let _ = stream.write_all(request);
    rest(&stream)
}

fn status(answer: &str) -> u16 {
    answer
        .split(' ')
        .nth(1)
        .and_then(|code| code.parse().ok())
        .unwrap_or_else(|| panic!("{answer:?}"))
}

fn with_headers(server: SocketAddr, line: &str, headers: &str, body: &str) -> String {
    let length = body.len();
    let request = format!(
        "{line} HTTP/1.1\r\n{headers}Content-Length: {length}\r\nConnection: close\r\n\r\n{body}"
    );
    send(server, request.as_bytes())
}

fn ask(server: SocketAddr, body: &str) -> String {
    let headers = format!("Host: {server}\r\nContent-Type: application/json\r\n");
    with_headers(server, "POST /answer", &headers, body)
}

/// The server still does what it is for.
fn assert_answers(server: SocketAddr) {
    let begun = Instant::now();
    let answer = ask(server, r#"{"catalogue":{}}"#);
    assert_eq!(status(&answer), 200, "{answer}");
    assert!(answer.contains("Reverse into a bay"));
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
}

#[test]
fn the_page_is_served_with_all_its_parts_and_nothing_from_elsewhere() {
    let server = start();
    let host = format!("Host: {server}\r\n");
    let page = with_headers(server, "GET /", &host, "");
    assert_eq!(status(&page), 200);
    assert!(page.contains("default-src 'none'") && page.contains("frame-ancestors 'none'"));
    assert!(!page.contains("http://") && !page.contains("https://"), "an outside resource");
    let parts: Vec<&str> =
        page.split("src=\"").skip(1).map(|s| s.split('"').next().unwrap()).collect();
    assert!(parts.len() > 5, "{parts:?}");
    for part in parts.into_iter().chain(["style.css"]) {
        let answer = with_headers(server, &format!("GET /{part}"), &host, "");
        assert_eq!(status(&answer), 200, "{part}");
        assert!(answer.contains("nosniff"));
    }
    assert_eq!(status(&with_headers(server, "GET /../Cargo.toml", &host, "")), 404);
    assert_eq!(status(&with_headers(server, "DELETE /", &host, "")), 405);
    assert_eq!(status(&with_headers(server, "GET /answer", &host, "")), 405);
    let by_name = format!("Host: localhost:{}\r\n", server.port());
    assert_eq!(status(&with_headers(server, "GET /", &by_name, "")), 200);
    assert!(server.ip().is_loopback());
}

#[test]
fn other_hosts_and_origins_are_refused() {
    let server = start();
    let json = "Content-Type: application/json\r\n";
    let body = r#"{"catalogue":{}}"#;
    let with = |headers: &str| {
        status(&with_headers(server, "POST /answer", &format!("{headers}{json}"), body))
    };
    assert_eq!(with(&format!("Host: {server}\r\nOrigin: http://{server}\r\n")), 200);
    assert_eq!(with(""), 421, "no host at all");
    for host in ["evil.example", "127.0.0.1", "127.0.0.1:1", "localhost.evil.example:80"] {
        assert_eq!(with(&format!("Host: {host}\r\n")), 421, "{host}");
    }
    for origin in
        ["http://evil.example", "null", "https://127.0.0.1:1", "http://localhost", "file://"]
    {
        assert_eq!(with(&format!("Host: {server}\r\nOrigin: {origin}\r\n")), 403, "{origin}");
    }
    // What a form of another page could send without asking.
    let form = format!("Host: {server}\r\nContent-Type: text/plain\r\n");
    assert_eq!(status(&with_headers(server, "POST /answer", &form, body)), 415);
    assert_answers(server);
}

#[test]
fn malformed_requests_end_in_a_refusal() {
    let server = start();
    let long = format!("GET / HTTP/1.1\r\nHost: {server}\r\nX: {}\r\n\r\n", "x".repeat(1_000_000));
    let many = format!("GET / HTTP/1.1\r\nHost: {server}\r\n{}\r\n", "X: y\r\n".repeat(5_000));
    let requests: [&[u8]; 9] = [
        b"\r\n\r\n\r\n",
        b"HELLO\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"\x00\x01\x02\xff\xfe\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        b"POST /answer HTTP/1.1\r\nContent-Length: -1\r\n\r\n",
        b"POST /answer HTTP/1.1\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\nzzzzz",
        long.as_bytes(),
        many.as_bytes(),
    ];
    for request in requests {
        let mut stream = connect(server);
        let _ = stream.write_all(request);
        let _ = stream.shutdown(std::net::Shutdown::Write);
        let answer = rest(&stream);
        assert!(answer.is_empty() || (400..=431).contains(&status(&answer)), "{answer}");
        assert_answers(server);
    }
    for body in ["", "{", "\u{feff}{}", "[[[[", r#"{"plan":{}}"#] {
        let answer = ask(server, body);
        assert_eq!(status(&answer), 200, "{answer}");
        assert!(answer.contains("error"), "{answer}");
    }
    let headers = format!(
        "POST /answer HTTP/1.1\r\nHost: {server}\r\nContent-Type: application/json\r\nContent-Length: 2\r\nConnection: close\r\n\r\n"
    );
    let answer = send(server, &[headers.as_bytes(), b"\xff\xfe"].concat());
    assert_eq!(status(&answer), 400, "{answer}");
}

#[test]
fn bodies_of_100_mb_are_refused_announced_or_not() {
    let server = start();
    let head = format!(
        "POST /answer HTTP/1.1\r\nHost: {server}\r\nContent-Type: application/json\r\nConnection: close\r\n"
    );
    let size = 100_000_000;
    let piece = vec![b' '; 1 << 20];
    // Announced: refused at once.
    let mut stream = connect(server);
    stream.write_all(format!("{head}Content-Length: {size}\r\n\r\n").as_bytes()).unwrap();
    let begun = Instant::now();
    let mut start_of_answer = [0; 12];
    stream.read_exact(&mut start_of_answer).unwrap();
    assert_eq!(&start_of_answer[9..], b"413");
    assert!(begun.elapsed() < Duration::from_secs(2));
    // Not announced: refused once it is too much, and not read to the end.
    let mut stream = connect(server);
    stream.write_all(format!("{head}Transfer-Encoding: chunked\r\n\r\n").as_bytes()).unwrap();
    let mut sent = 0;
    while sent < size {
        let chunk = [format!("{:x}\r\n", piece.len()).as_bytes(), &piece, b"\r\n"].concat();
        if stream.write_all(&chunk).is_err() {
            break;
        }
        sent += piece.len();
    }
    assert!(sent < size || rest(&stream).contains(" 413 "), "all was taken");
    assert!(sent >= LARGEST_BODY, "{sent}");
    assert_answers(server);
}

#[test]
fn slow_clients_are_cut_off_and_hold_nobody_up() {
    let server = start();
    // One byte a second of a head, and of a body; and one that says nothing; many of each.
    let head = format!(
        "POST /answer HTTP/1.1\r\nHost: {server}\r\nContent-Type: application/json\r\nContent-Length: 500\r\n\r\n"
    );
    let begun = Instant::now();
    let slow: Vec<_> = (0..60)
        .map(|i| {
            let head = head.clone();
            thread::spawn(move || {
                let mut stream = connect(server);
                if i % 3 == 1 {
                    stream.write_all(head.as_bytes()).unwrap();
                }
                while begun.elapsed() < Duration::from_secs(40) {
                    if i % 3 != 2 && stream.write_all(b"x").is_err() {
                        break;
                    }
                    stream.set_read_timeout(Some(Duration::from_secs(1))).unwrap();
                    // An answer, or the end.
                    if matches!(stream.read(&mut [0; 512]), Ok(0)) {
                        break;
                    }
                }
                begun.elapsed()
            })
        })
        .collect();
    thread::sleep(Duration::from_secs(2));
    assert_answers(server);
    for client in slow {
        let took = client.join().unwrap();
        assert!(took < Duration::from_secs(25), "{took:?}");
    }
    assert_answers(server);
}

#[test]
fn ten_thousand_requests_at_once_are_survived() {
    const CLIENTS: usize = 100;
    const EACH: usize = 100;
    let server = start();
    let plan = {
        let scene = include_str!("../examples/reverse.json");
        format!(r#"{{"plan":{{"scene":{scene},"methods":["n3p"]}}}}"#)
    };
    let request = format!(
        "POST /answer HTTP/1.1\r\nHost: {server}\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{plan}",
        plan.len()
    );
    let begun = Instant::now();
    let counts: Vec<[usize; 3]> = thread::scope(|scope| {
        let clients: Vec<_> = (0..CLIENTS)
            .map(|_| {
                scope.spawn(|| {
                    // All of a client's connections are open before the first is answered.
                    let open: Vec<TcpStream> = (0..EACH)
                        .filter_map(|_| {
                            let mut stream = TcpStream::connect(server).ok()?;
                            stream.set_read_timeout(Some(Duration::from_secs(60))).ok()?;
                            stream.write_all(request.as_bytes()).ok()?;
                            Some(stream)
                        })
                        .collect();
                    let mut counts = [0, 0, EACH - open.len()];
                    for stream in &open {
                        let answer = rest(stream);
                        match answer.split(' ').nth(1) {
                            Some("200") => counts[0] += 1,
                            Some("503") => counts[1] += 1,
                            _ => counts[2] += 1,
                        }
                    }
                    counts
                })
            })
            .collect();
        clients.into_iter().map(|client| client.join().unwrap()).collect()
    });
    let [answered, turned_away, lost] =
        counts.iter().fold([0; 3], |sum, one| [0, 1, 2].map(|i| sum[i] + one[i]));
    println!(
        "{answered} answered, {turned_away} turned away, {lost} lost, in {:?}",
        begun.elapsed()
    );
    assert_eq!(answered + turned_away + lost, CLIENTS * EACH);
    assert!(answered > 100, "{answered}");
    // Whoever was connected got an answer; a machine that allows few open files connects few.
    assert!(lost < CLIENTS * EACH / 2, "{lost}");
    assert!(begun.elapsed() < Duration::from_secs(120), "{:?}", begun.elapsed());
    assert_answers(server);
}

#[test]
fn the_program_says_what_is_wrong_with_its_arguments() {
    let run = |arguments: &[&str]| {
        let program = std::process::Command::new(env!("CARGO_BIN_EXE_n3p-play"))
            .args(arguments)
            .output()
            .unwrap();
        let said = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (program.status.code(), said(program.stdout), said(program.stderr))
    };
    let (code, usage, _) = run(&["--help"]);
    assert!(code == Some(0) && usage.contains("--port"), "{usage}");
    for wrong in [&["--port", "99999"][..], &["--port"], &["--host", "0.0.0.0"]] {
        let (code, _, said) = run(wrong);
        assert!(code == Some(2) && said.lines().count() == 2 && said.contains("--port"), "{said}");
    }
    let taken = start().port().to_string();
    let (code, _, said) = run(&["--port", &taken]);
    assert!(code == Some(1) && said.contains("--port 0"), "{said}");
}
