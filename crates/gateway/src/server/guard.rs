//! What stands before every route: who may ask, how much at a time, and a sentence for whatever went wrong.

use std::any::Any;
use std::net::IpAddr;
use std::sync::Arc;

use axum::Router;
use axum::body::{Body, HttpBody, to_bytes};
use axum::extract::{Request, State};
use axum::http::uri::Authority;
use axum::http::{HeaderName, HeaderValue, Method, StatusCode, Uri, Version, header};
use axum::middleware::{Next, from_fn, from_fn_with_state, map_response};
use axum::response::{IntoResponse, Response};
use tokio::sync::Semaphore;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::set_header::SetResponseHeaderLayer;

use super::held::{Pieces, holding};
use super::limits::Limits;
use super::streams::{Peer, Streams};
use crate::api::{EVENTS, Problem};
use crate::hub::Hub;

/// Nothing but our own files is loaded, and no other page may show ours.
const POLICY: &str = "default-src 'self'; img-src 'self' data:; object-src 'none'; base-uri 'none'; \
                      form-action 'self'; frame-ancestors 'none'";

/// No address of ours is nearly as long; a list of ids in a query may be.
const LONGEST_ADDRESS: usize = 8 * 1_024;

/// Who the gateway is.
#[derive(Debug, Clone)]
pub(crate) struct Known {
    /// Where it listens.
    pub(crate) address: IpAddr,
    /// Knows the names that a proxy on this machine may ask for.
    pub(crate) hub: Arc<Hub>,
}

/// Routes behind everything that guards them and speaks for what they do not know.
pub(crate) fn guarded(routes: Router, known: Known) -> Router {
    routes
        .fallback(nothing_here)
        .method_not_allowed_fallback(wrong_method)
        .layer(CatchPanicLayer::custom(panicked))
        .layer(from_fn_with_state(known, known_host))
        .layer(from_fn(short_address))
        .layer(map_response(in_a_sentence))
        .layer(header_unless_set(header::CONTENT_SECURITY_POLICY, POLICY))
        .layer(header_unless_set(header::X_CONTENT_TYPE_OPTIONS, "nosniff"))
        .layer(header_unless_set(header::REFERRER_POLICY, "same-origin"))
}

pub(crate) fn header_unless_set(
    name: HeaderName,
    value: &'static str,
) -> SetResponseHeaderLayer<HeaderValue> {
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

/// Whatever a library answers by itself becomes a problem like our own; its other headers stay.
async fn in_a_sentence(response: Response) -> Response {
    let status = response.status();
    let told = response.headers().get(header::CONTENT_TYPE).is_some_and(|kind| kind == Problem::CONTENT_TYPE);
    if told || !(status.is_client_error() || status.is_server_error()) {
        return response;
    }
    let (mut head, _) = response.into_parts();
    head.headers.remove(header::CONTENT_LENGTH);
    head.headers.remove(header::CONTENT_ENCODING);
    let detail = "the request cannot be answered; /api/v1/openapi.json says what there is to ask for";
    let (own, body) = Problem::new(status, detail).into_response().into_parts();
    head.headers.extend(own.headers);
    Response::from_parts(head, body)
}

async fn short_address(request: Request, next: Next) -> Response {
    let length = request.uri().path_and_query().map_or(0, |address| address.as_str().len());
    if length <= LONGEST_ADDRESS {
        return next.run(request).await;
    }
    let detail = format!(
        "the address has {length} characters, {LONGEST_ADDRESS} at most are taken; ask for less at a time"
    );
    Problem::new(StatusCode::URI_TOO_LONG, detail).into_response()
}

/// A gateway for this machine alone answers to no other name than it was told: a page elsewhere could have its own
/// name point here (DNS rebinding) and read along.
async fn known_host(State(known): State<Known>, request: Request, next: Next) -> Response {
    let host = host(&request);
    if host.is_none() && request.version() == Version::HTTP_11 {
        let detail = "the request has no Host header, or more than one, or one that names no host; send one";
        return Problem::new(StatusCode::BAD_REQUEST, detail).into_response();
    }
    if !known.address.to_canonical().is_loopback() {
        return next.run(request).await;
    }
    match host {
        Some(host) if is_this_machine(&host) || known.answers_to(&host) => next.run(request).await,
        host => {
            let asked = host.unwrap_or_else(|| "no host".to_owned());
            let detail = format!(
                "this gateway serves this machine only, as localhost, 127.0.0.1 or [::1], and was asked for {asked}; \
                 listen on another address to serve others, or name the host of a proxy under [server] hosts"
            );
            Problem::new(StatusCode::MISDIRECTED_REQUEST, detail).into_response()
        }
    }
}

impl Known {
    fn answers_to(&self, host: &str) -> bool {
        self.hub.table().hosts.iter().any(|known| known.eq_ignore_ascii_case(host))
    }
}

/// The host that the client believes it is talking to, without the port.
fn host(request: &Request) -> Option<String> {
    let mut headers = request.headers().get_all(header::HOST).iter();
    let (header, more) = (headers.next(), headers.next());
    let authority = match request.uri().authority() {
        Some(authority) => authority.clone(),
        None => header?.to_str().ok()?.parse::<Authority>().ok()?,
    };
    (more.is_none() && !authority.host().is_empty()).then(|| authority.host().to_owned())
}

fn is_this_machine(host: &str) -> bool {
    let literal = host.trim_start_matches('[').trim_end_matches(']');
    host.eq_ignore_ascii_case("localhost") || literal.parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback())
}

/// Counts the readers of the event stream: one more than there is room for is told to come back.
pub(crate) async fn counted(State(streams): State<Arc<Streams>>, request: Request, next: Next) -> Response {
    if request.uri().path() != EVENTS || request.method() != Method::GET {
        return next.run(request).await;
    }
    match streams.take(Peer::in_request(request.extensions())) {
        Some(place) => place.hold(next.run(request).await),
        None => busy(
            "as many readers as there is room for have the event stream open; try again, or ask for the values",
        ),
    }
}

/// Room for answers that wait to be taken, by KiB.
pub(crate) fn waiting(limits: &Limits) -> Arc<Semaphore> {
    Arc::new(Semaphore::new(limits.waiting_kib))
}

/// Answers that are not weighed: whether the gateway lives can be asked even when there is no room.
const LIGHT: u64 = 1_024;

/// Weighs answers that are in memory whole: clients that ask and do not read must not fill it.
pub(crate) async fn weighed(State(room): State<Arc<Semaphore>>, request: Request, next: Next) -> Response {
    let response = next.run(request).await;
    let Some(length) = response.body().size_hint().exact().filter(|length| *length > LIGHT) else {
        return response;
    };
    let kib = u32::try_from(length.div_ceil(1_024)).unwrap_or(u32::MAX);
    let Ok(taken) = room.try_acquire_many_owned(kib) else {
        return busy("too many answers wait for clients that do not take them; try again");
    };
    let (head, body) = response.into_parts();
    match to_bytes(body, usize::MAX).await {
        Ok(bytes) => holding(Response::from_parts(head, Body::new(Pieces(bytes))), taken),
        Err(_) => panicked(Box::new(())),
    }
}

fn busy(detail: &str) -> Response {
    let problem = Problem::new(StatusCode::SERVICE_UNAVAILABLE, detail);
    ([(header::RETRY_AFTER, HeaderValue::from_static("5"))], problem).into_response()
}

#[cfg(test)]
mod tests {
    use tower::ServiceExt;

    use super::*;
    use crate::table::Table;

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
        let hosts = vec!["power.example.org".to_owned()];
        let table = Table { hosts, ..crate::testing::table(&[]) };
        let hub = Arc::new(Hub::new(table, crate::stop::channel().1));
        let known = Known { address: address.parse().unwrap(), hub };
        guarded(routes, known).oneshot(request).await.unwrap()
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
    async fn a_gateway_for_this_machine_answers_to_its_names_alone() {
        let routes = || Router::new().route("/", axum::routing::get(async || "ok"));
        for (address, host, status) in [
            ("0.0.0.0", "gateway.site.example", StatusCode::OK),
            ("::", "10.0.0.7:8080", StatusCode::OK),
            ("127.0.0.1", "gateway.site.example", StatusCode::MISDIRECTED_REQUEST),
            ("::1", "localhost", StatusCode::OK),
            ("::ffff:127.0.0.1", "gateway.site.example", StatusCode::MISDIRECTED_REQUEST),
            ("127.0.0.1", "power.example.org", StatusCode::OK),
            ("127.0.0.1", "POWER.example.org:443", StatusCode::OK),
            ("127.0.0.1", "x.power.example.org", StatusCode::MISDIRECTED_REQUEST),
        ] {
            assert_eq!(get(routes(), address, host).await.status(), status, "{address} {host}");
        }
    }

    #[test]
    fn the_name_in_the_request_line_counts_before_the_header() {
        assert_eq!(asked("http://evil.example/", Some("localhost")).as_deref(), Some("evil.example"));
        assert_eq!(asked("/", None), None);
        assert_eq!(asked("/", Some("a b")), None);
        let twice =
            Request::builder().uri("/").header(header::HOST, "localhost").header(header::HOST, "localhost");
        assert_eq!(super::host(&twice.body(Body::empty()).unwrap()), None);
    }
}
