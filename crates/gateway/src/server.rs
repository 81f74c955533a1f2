//! The HTTP server: accepts connections, guards them, and ends them when the gateway ends.

use std::any::Any;
use std::net::{IpAddr, SocketAddr};
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::{Request, State};
use axum::http::uri::Authority;
use axum::http::{HeaderName, HeaderValue, Method, StatusCode, Uri, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use tower_http::set_header::SetResponseHeaderLayer;

use crate::api::{self, Problem};
use crate::hub::Hub;
use crate::page;
use crate::patience::Patient;
use crate::stop::Stop;

/// How long connections may take to end: one that never reads ends by nothing else than being cut off.
pub(crate) const FAREWELL: Duration = Duration::from_secs(2);

/// A client has this long to send the head of a request.
const HEAD_TIMEOUT: Duration = Duration::from_secs(10);

/// Most connections at a time. The rest wait in the system's queue, and the wires always find a file handle.
const MOST_CONNECTIONS: usize = 512;

/// Nothing but our own files is loaded, and no other page may show ours.
const POLICY: &str = "default-src 'self'; img-src 'self' data:; object-src 'none'; base-uri 'none'; \
                      form-action 'self'; frame-ancestors 'none'";

/// A reader that takes nothing for so long is gone, whatever its connection says.
const WRITE_TIMEOUT: Duration = Duration::from_secs(60);

/// Serves until the gateway ends.
pub(crate) async fn serve(listener: TcpListener, address: SocketAddr, hub: Arc<Hub>) {
    serve_at_most(MOST_CONNECTIONS, listener, address, hub).await;
}

async fn serve_at_most(most: usize, listener: TcpListener, address: SocketAddr, hub: Arc<Hub>) {
    let stop = hub.stop();
    let router = router(hub, address);
    let mut connections = JoinSet::new();
    let mut ended = stop.clone();
    loop {
        tokio::select! {
            biased;
            () = ended.requested() => break,
            Some(_) = connections.join_next() => {}
            accepted = listener.accept(), if connections.len() < most => match accepted {
                Ok((stream, _)) => { connections.spawn(connection(stream, router.clone(), stop.clone())); }
                Err(error) => {
                    // Out of file handles, most likely: it passes, and trying at once would only burn the processor.
                    tracing::warn!(%error, "cannot accept a connection");
                    sleep(Duration::from_millis(100)).await;
                }
            },
        }
    }
    drop(listener);
    let _ = timeout(FAREWELL, async { while connections.join_next().await.is_some() {} }).await;
    connections.shutdown().await;
}

async fn connection(stream: TcpStream, router: Router, mut stop: Stop) {
    // Events are small and late ones are of no use.
    let _ = stream.set_nodelay(true);
    let mut server = http1::Builder::new();
    server.timer(TokioTimer::new()).header_read_timeout(HEAD_TIMEOUT);
    let connection = server.serve_connection(
        TokioIo::new(Patient::new(stream, WRITE_TIMEOUT)),
        TowerToHyperService::new(router),
    );
    let mut connection = pin!(connection);
    let stopped = tokio::select! {
        result = connection.as_mut() => {
            if let Err(error) = result {
                tracing::debug!(%error, "a connection broke");
            }
            false
        }
        () = stop.requested() => true,
    };
    if stopped {
        connection.as_mut().graceful_shutdown();
        let _ = connection.await;
    }
}

/// Everything that is served.
fn router(hub: Arc<Hub>, address: SocketAddr) -> Router {
    let page = page::router(Arc::clone(&hub));
    let api = api::router(hub)
        .layer(CompressionLayer::new())
        .layer(header_unless_set(header::CACHE_CONTROL, "no-store"));
    guarded(Router::new().merge(api).merge(page), address.ip())
}

/// Routes behind everything that guards them and speaks for what they do not know.
fn guarded(routes: Router, address: IpAddr) -> Router {
    routes
        .fallback(nothing_here)
        .method_not_allowed_fallback(wrong_method)
        .layer(CatchPanicLayer::custom(panicked))
        .layer(from_fn_with_state(address, known_host))
        .layer(header_unless_set(header::CONTENT_SECURITY_POLICY, POLICY))
        .layer(header_unless_set(header::X_CONTENT_TYPE_OPTIONS, "nosniff"))
        .layer(header_unless_set(header::REFERRER_POLICY, "same-origin"))
}

fn header_unless_set(name: HeaderName, value: &'static str) -> SetResponseHeaderLayer<HeaderValue> {
    SetResponseHeaderLayer::if_not_present(name, HeaderValue::from_static(value))
}

async fn nothing_here(uri: Uri) -> Problem {
    let detail =
        format!("there is nothing at {}; the page is at /, the API at /api/v1/openapi.json", uri.path());
    Problem::new(StatusCode::NOT_FOUND, detail)
}

async fn wrong_method(method: Method, uri: Uri) -> Problem {
    let detail = format!("{} cannot be used with {method}; use GET", uri.path());
    Problem::new(StatusCode::METHOD_NOT_ALLOWED, detail)
}

/// One request's bug is that request's end, not the gateway's.
fn panicked(_: Box<dyn Any + Send>) -> Response {
    let detail = "this request met a bug in the gateway; the log has more";
    Problem::new(StatusCode::INTERNAL_SERVER_ERROR, detail).into_response()
}

/// A gateway for this machine alone answers to no other name: a page elsewhere could have its own name point here
/// (DNS rebinding) and read along.
async fn known_host(State(address): State<IpAddr>, request: Request, next: Next) -> Response {
    if !address.is_loopback() {
        return next.run(request).await;
    }
    match host(&request) {
        Some(host) if is_this_machine(&host) => next.run(request).await,
        host => {
            let asked = host.unwrap_or_else(|| "no host".to_owned());
            let detail = format!(
                "this gateway serves this machine only, as localhost, 127.0.0.1 or [::1], and was asked for {asked}; \
                 listen on another address to serve others"
            );
            Problem::new(StatusCode::MISDIRECTED_REQUEST, detail).into_response()
        }
    }
}

/// The host that the client believes it is talking to, without the port.
fn host(request: &Request) -> Option<String> {
    let authority = match request.uri().authority() {
        Some(authority) => authority.clone(),
        None => request.headers().get(header::HOST)?.to_str().ok()?.parse::<Authority>().ok()?,
    };
    Some(authority.host().to_owned())
}

fn is_this_machine(host: &str) -> bool {
    let literal = host.trim_start_matches('[').trim_end_matches(']');
    host.eq_ignore_ascii_case("localhost") || literal.parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback())
}

#[cfg(test)]
mod tests {
    use axum::body::Body;
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tower::ServiceExt;

    use super::*;

    fn asked(uri: &str, host: Option<&str>) -> Option<String> {
        let mut request = Request::builder().uri(uri);
        if let Some(host) = host {
            request = request.header(header::HOST, host);
        }
        super::host(&request.body(Body::empty()).unwrap())
    }

    #[test]
    fn only_names_of_this_machine_are_its_names() {
        for host in
            ["localhost", "LOCALHOST", "localhost:8080", "127.0.0.1:80", "127.0.0.1", "[::1]", "[::1]:8080"]
        {
            let asked = asked("/", Some(host)).unwrap();
            assert!(is_this_machine(&asked), "{host}");
        }
        for host in
            ["evil.example", "127.0.0.1.evil.example", "localhost.evil.example:8080", "10.0.0.7", "[::2]"]
        {
            let asked = asked("/", Some(host)).unwrap();
            assert!(!is_this_machine(&asked), "{host}");
        }
    }

    async fn get(routes: Router, address: &str, host: &str) -> Response {
        let request = Request::builder().uri("/").header(header::HOST, host).body(Body::empty()).unwrap();
        guarded(routes, address.parse().unwrap()).oneshot(request).await.unwrap()
    }

    #[tokio::test]
    async fn a_bug_in_a_handler_is_a_problem_and_no_more() {
        async fn bug() -> &'static str {
            panic!("a bug")
        }
        let response = get(Router::new().route("/", axum::routing::get(bug)), "127.0.0.1", "localhost").await;
        assert_eq!(response.status(), StatusCode::INTERNAL_SERVER_ERROR);
        assert_eq!(response.headers()[header::CONTENT_TYPE], "application/problem+json");
        assert_eq!(response.headers()[header::X_CONTENT_TYPE_OPTIONS], "nosniff");
    }

    #[tokio::test]
    async fn a_gateway_for_the_network_answers_to_any_name() {
        let routes = || Router::new().route("/", axum::routing::get(async || "ok"));
        for (address, host, status) in [
            ("0.0.0.0", "gateway.site.example", StatusCode::OK),
            ("::", "10.0.0.7:8080", StatusCode::OK),
            ("127.0.0.1", "gateway.site.example", StatusCode::MISDIRECTED_REQUEST),
            ("::1", "localhost", StatusCode::OK),
        ] {
            assert_eq!(get(routes(), address, host).await.status(), status, "{address} {host}");
        }
    }

    #[test]
    fn the_name_in_the_request_line_counts_before_the_header() {
        assert_eq!(asked("http://evil.example/", Some("localhost")).as_deref(), Some("evil.example"));
        assert_eq!(asked("/", None), None);
        assert_eq!(asked("/", Some("a b")), None);
    }

    #[tokio::test]
    async fn no_more_connections_than_allowed() {
        let (announcer, stop) = crate::stop::channel();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let hub = Arc::new(crate::testing::hub(&[], stop));
        let server = tokio::spawn(serve_at_most(1, listener, address, hub));
        let ask = async || {
            let mut stream = TcpStream::connect(address).await.unwrap();
            let request = format!("GET /healthz HTTP/1.1\r\nhost: {address}\r\n\r\n");
            stream.write_all(request.as_bytes()).await.unwrap();
            stream
        };
        let mut answer = [0; 15];
        let mut first = ask().await;
        first.read_exact(&mut answer).await.unwrap();
        assert_eq!(&answer, b"HTTP/1.1 200 OK");

        let mut second = ask().await;
        let soon = Duration::from_millis(50);
        assert!(timeout(soon, second.read_exact(&mut answer)).await.is_err(), "it waits for a place");
        drop(first);
        second.read_exact(&mut answer).await.unwrap();
        assert_eq!(&answer, b"HTTP/1.1 200 OK");
        announcer.announce();
        server.await.unwrap();
    }
}
