//! The server of the page: loopback only, for the browser of whoever started it.
//!
//! It answers no page but its own (`Host` and `Origin`), and nobody can make it use much: bodies,
//! headers, connections, plans that wait and the time each may take are all limited.

use std::convert::Infallible;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::pin::pin;
use std::sync::Arc;
use std::thread::available_parallelism;
use std::time::Duration;

use http_body_util::{BodyExt, Full, LengthLimitError, Limited};
use hyper::body::{Body, Bytes, Incoming};
use hyper::header::{self, HeaderName, HeaderValue};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;
use tokio::time::{sleep, timeout};

use crate::ask::answer;

/// The largest body of a request, bytes: a scene of 200,000 corners has about ten million.
pub const LARGEST_BODY: usize = 20_000_000;
/// Connections that are served at a time; others wait to be accepted.
const CONNECTIONS: usize = 1024;
/// Bodies larger than this, bytes, or of a size that is not announced, and so many of them at a time: others are
/// turned away.
const LARGE_BODY: u64 = 256_000;
const LARGE_BODIES: usize = 8;
/// How long a request waits for a planner before it is turned away.
const TURN: Duration = Duration::from_secs(20);
/// How long a client may take for the head of a request, and for its body.
const HEAD: Duration = Duration::from_secs(5);
const BODY: Duration = Duration::from_secs(15);
/// After so long a connection takes no more requests, and after so much more it is closed.
const CONNECTION: Duration = Duration::from_secs(60);
const PARTING: Duration = Duration::from_secs(30);

/// The page: what is served where, and as what.
const PAGE: &[(&str, &str, &str)] = &[
    ("/", "text/html; charset=utf-8", include_str!("../page/index.html")),
    ("/style.css", "text/css; charset=utf-8", include_str!("../page/style.css")),
    ("/geometry.js", SCRIPT, include_str!("../../src/output/page/geometry.js")),
    ("/drawing.js", SCRIPT, include_str!("../../src/output/page/drawing.js")),
    ("/planner.js", SCRIPT, include_str!("../page/planner.js")),
    ("/scene.js", SCRIPT, include_str!("../page/scene.js")),
    ("/picture.js", SCRIPT, include_str!("../page/picture.js")),
    ("/edit.js", SCRIPT, include_str!("../page/edit.js")),
    ("/play.js", SCRIPT, include_str!("../page/play.js")),
    ("/tour.js", SCRIPT, include_str!("../page/tour.js")),
    ("/files.js", SCRIPT, include_str!("../page/files.js")),
    ("/app.js", SCRIPT, include_str!("../page/app.js")),
];
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// With every answer: nothing from elsewhere, nobody's frame, no guessing.
const HEADERS: [(HeaderName, &str); 5] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (header::CACHE_CONTROL, "no-store"),
];

/// A server that listens.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
}

impl Server {
    /// Listens on a port of the loopback interface; on any free one where it is 0.
    pub async fn listen(port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).await?;
        let address = listener.local_addr()?;
        Ok(Self { listener, address })
    }

    /// Where the page is.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Serves for ever.
    #[allow(clippy::missing_panics_doc, reason = "its semaphore is never closed")]
    pub async fn serve(self) -> Infallible {
        let room = Arc::new(Semaphore::new(CONNECTIONS));
        let house = Arc::new(House {
            port: self.address.port(),
            large: Semaphore::new(LARGE_BODIES),
            turns: Semaphore::new(planners()),
        });
        loop {
            let permit = Arc::clone(&room).acquire_owned().await.expect("it is never closed");
            match self.listener.accept().await {
                Ok((stream, _)) => {
                    let house = Arc::clone(&house);
                    tokio::spawn(async move {
                        house.attend(stream).await;
                        drop(permit);
                    });
                }
                // Too many open files, or a client that left: others may do better in a moment.
                Err(_) => sleep(Duration::from_millis(20)).await,
            }
        }
    }
}

/// Plans that are made at a time: one per core.
fn planners() -> usize {
    available_parallelism().map_or(1, usize::from)
}

/// The runtime of a server: one thread for the network, one per core for plans.
pub fn runtime() -> io::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .max_blocking_threads(planners())
        // What a thread has prepared is kept.
        .thread_keep_alive(Duration::from_secs(24 * 3600))
        .build()
}

/// What all connections share.
struct House {
    port: u16,
    large: Semaphore,
    turns: Semaphore,
}

type Answer = Response<Full<Bytes>>;

impl House {
    /// Serves one connection to its end.
    async fn attend(self: Arc<Self>, stream: TcpStream) {
        let service = service_fn(|request| {
            let house = Arc::clone(&self);
            async move { Ok::<_, Infallible>(house.respond(request).await) }
        });
        let connection = http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(HEAD)
            .max_buf_size(64 * 1024)
            .serve_connection(TokioIo::new(stream), service);
        let mut connection = pin!(connection);
        // How a connection ended concerns nobody here.
        if timeout(CONNECTION, connection.as_mut()).await.is_err() {
            connection.as_mut().graceful_shutdown();
            let _ = timeout(PARTING, connection).await;
        }
    }

    async fn respond(&self, request: Request<Incoming>) -> Answer {
        let mut answer = match self.refuse(&request) {
            Some(refused) => refused,
            None => self.serve(request).await,
        };
        for (name, value) in HEADERS {
            answer.headers_mut().insert(name, HeaderValue::from_static(value));
        }
        // Who was refused while still sending is not read to the end.
        if answer.status().is_client_error() {
            answer.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
        }
        answer
    }

    /// What is not meant for this server: a name that somebody made point here, a page from elsewhere.
    fn refuse(&self, request: &Request<Incoming>) -> Option<Answer> {
        let text = |name| request.headers().get(name).map(|v| v.to_str().unwrap_or("?"));
        let own = ["127.0.0.1", "localhost"].map(|host| format!("{host}:{}", self.port));
        let is_own = |host: &str| own.iter().any(|known| known == host);
        if !text(header::HOST).is_some_and(is_own) {
            return Some(plain(
                StatusCode::MISDIRECTED_REQUEST,
                "this server is for 127.0.0.1 alone\n",
            ));
        }
        let is_ours = |origin: &str| origin.strip_prefix("http://").is_some_and(is_own);
        if text(header::ORIGIN).is_some_and(|origin| !is_ours(origin)) {
            return Some(plain(StatusCode::FORBIDDEN, "this server answers no page but its own\n"));
        }
        None
    }

    async fn serve(&self, request: Request<Incoming>) -> Answer {
        let path = request.uri().path();
        if let Some((_, kind, text)) = PAGE.iter().find(|(known, ..)| *known == path) {
            return match *request.method() {
                Method::GET | Method::HEAD => with_kind(kind, Bytes::from_static(text.as_bytes())),
                _ => not_allowed("GET, HEAD"),
            };
        }
        if path != "/answer" {
            return plain(StatusCode::NOT_FOUND, "there is no such page\n");
        }
        if request.method() != Method::POST {
            return not_allowed("POST");
        }
        let kind = request.headers().get(header::CONTENT_TYPE).map(HeaderValue::as_bytes);
        if kind != Some(b"application/json") {
            return plain(StatusCode::UNSUPPORTED_MEDIA_TYPE, "expected application/json\n");
        }
        let busy = || plain(StatusCode::SERVICE_UNAVAILABLE, "too much at a time; try again\n");
        let body = request.into_body();
        let large = if body.size_hint().exact().is_some_and(|size| size <= LARGE_BODY) {
            None
        } else {
            match self.large.try_acquire() {
                Ok(permit) => Some(permit),
                Err(_) => return busy(),
            }
        };
        let asked = match read(body).await {
            Ok(asked) => asked,
            Err(refused) => return refused,
        };
        let Ok(Ok(_turn)) = timeout(TURN, self.turns.acquire()).await else { return busy() };
        let answered = spawn_blocking(move || answer(&asked)).await;
        drop(large);
        match answered {
            Ok(text) => with_kind("application/json", Bytes::from(text)),
            Err(_) => plain(StatusCode::INTERNAL_SERVER_ERROR, "the planner failed\n"),
        }
    }
}

/// The text of a body, or why there is none.
async fn read(body: Incoming) -> Result<String, Answer> {
    let too_large = || plain(StatusCode::PAYLOAD_TOO_LARGE, "expected at most 20 MB\n");
    if body.size_hint().lower() > LARGEST_BODY as u64 {
        return Err(too_large());
    }
    let collected = timeout(BODY, Limited::new(body, LARGEST_BODY).collect()).await;
    let bytes = match collected {
        Err(_) => return Err(plain(StatusCode::REQUEST_TIMEOUT, "the body took too long\n")),
        Ok(Err(e)) if e.is::<LengthLimitError>() => return Err(too_large()),
        Ok(Err(_)) => return Err(plain(StatusCode::BAD_REQUEST, "the body is not whole\n")),
        Ok(Ok(whole)) => whole.to_bytes(),
    };
    String::from_utf8(bytes.into())
        .map_err(|_| plain(StatusCode::BAD_REQUEST, "the body is not text (UTF-8)\n"))
}

fn with_kind(kind: &'static str, body: Bytes) -> Answer {
    let mut answer = Response::new(Full::new(body));
    answer.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(kind));
    answer
}

fn plain(status: StatusCode, text: &'static str) -> Answer {
    let mut answer = with_kind("text/plain; charset=utf-8", Bytes::from_static(text.as_bytes()));
    *answer.status_mut() = status;
    answer
}

fn not_allowed(allowed: &'static str) -> Answer {
    let mut answer = plain(StatusCode::METHOD_NOT_ALLOWED, "no such method here\n");
    answer.headers_mut().insert(header::ALLOW, HeaderValue::from_static(allowed));
    answer
}
