//! What stands before every route: who may ask, and a sentence for whatever is not there.

use std::any::Any;
use std::net::IpAddr;

use axum::Router;
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::uri::Authority;
use axum::http::{HeaderName, HeaderValue, Method, StatusCode, Uri, Version, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::set_header::SetResponseHeaderLayer;

use super::problem::{LARGEST_BODY, Problem};
use super::token::Token;

/// Nothing but our own files is loaded, and no other page may show ours.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const BEARER: &[u8] = b"Bearer ";

/// Routes with what holds for each of their answers.
pub(super) fn guarded(routes: Router) -> Router {
    routes
        .fallback(nothing_here)
        .method_not_allowed_fallback(wrong_method)
        .layer(DefaultBodyLimit::max(LARGEST_BODY))
        .layer(header_unless_set(header::CACHE_CONTROL, "no-store"))
        .layer(header_unless_set(header::CONTENT_SECURITY_POLICY, POLICY))
        .layer(header_unless_set(header::X_CONTENT_TYPE_OPTIONS, "nosniff"))
        .layer(header_unless_set(header::REFERRER_POLICY, "same-origin"))
}

/// The same for a server of its own: one for this machine alone answers to no other name. A page elsewhere could have
/// its own name point here (DNS rebinding).
pub(super) fn hosted(routes: Router, address: IpAddr) -> Router {
    routes
        .layer(CatchPanicLayer::custom(panicked))
        .layer(from_fn_with_state(address.to_canonical(), known_host))
}

/// Lets nobody in who does not show the token.
pub(super) async fn token_shown(State(token): State<Token>, request: Request, next: Next) -> Response {
    let shown = request.headers().get(header::AUTHORIZATION).map(HeaderValue::as_bytes);
    let shown = shown.and_then(|shown| {
        let (scheme, rest) = shown.split_at_checked(BEARER.len())?;
        scheme.eq_ignore_ascii_case(BEARER).then_some(rest)
    });
    if shown.is_some_and(|shown| token.is(shown)) {
        return next.run(request).await;
    }
    let detail = match shown {
        Some(_) => "the token is another one; send the one that this imitation was started with",
        None => {
            "a token is needed; send the one that this imitation was started with, as Authorization: Bearer"
        }
    };
    let problem = Problem::new(StatusCode::UNAUTHORIZED, detail);
    ([(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"))], problem).into_response()
}

async fn nothing_here(uri: Uri) -> Problem {
    let detail = format!("there is nothing at {}; openapi.json lists what there is", uri.path());
    Problem::new(StatusCode::NOT_FOUND, detail)
}

async fn wrong_method(method: Method, uri: Uri) -> Problem {
    let detail =
        format!("{} cannot be used with {method}; openapi.json lists what can be done with it", uri.path());
    Problem::new(StatusCode::METHOD_NOT_ALLOWED, detail)
}

/// One request's bug is that request's end, not the imitation's.
fn panicked(_: Box<dyn Any + Send>) -> Response {
    let detail = "this request met a bug in the imitation; the log has more";
    Problem::new(StatusCode::INTERNAL_SERVER_ERROR, detail).into_response()
}

fn header_unless_set(name: HeaderName, value: &'static str) -> SetResponseHeaderLayer<HeaderValue> {
    SetResponseHeaderLayer::if_not_present(name, HeaderValue::from_static(value))
}

async fn known_host(State(address): State<IpAddr>, request: Request, next: Next) -> Response {
    let host = host(&request);
    if host.is_none() && request.version() == Version::HTTP_11 {
        let detail = "the request has no Host header, or more than one, or one that names no host; send one";
        return Problem::new(StatusCode::BAD_REQUEST, detail).into_response();
    }
    if !address.is_loopback() || host.as_deref().is_some_and(is_this_machine) {
        return next.run(request).await;
    }
    let asked = host.unwrap_or_else(|| "no host".to_owned());
    let detail = format!(
        "this control serves this machine only, as localhost, 127.0.0.1 or [::1], and was asked for {asked}"
    );
    Problem::new(StatusCode::MISDIRECTED_REQUEST, detail).into_response()
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
