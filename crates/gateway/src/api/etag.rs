//! Entity tags: who has an answer already is told so instead of getting it again.

use std::hash::{DefaultHasher, Hasher};

use axum::body::{Body, to_bytes};
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::Problem;

/// Puts a weak tag on every good JSON answer and answers 304 to a request that names it.
///
/// Weak, for it is the same whichever way the answer is compressed on its way out.
pub(crate) async fn tagged(request: Request, next: Next) -> Response {
    let known: Vec<HeaderValue> = request.headers().get_all(header::IF_NONE_MATCH).iter().cloned().collect();
    let response = next.run(request).await;
    if response.status() != StatusCode::OK || !is_json(response.headers()) {
        return response;
    }
    let (mut head, body) = response.into_parts();
    // Every JSON answer is in memory whole already.
    let Ok(bytes) = to_bytes(body, usize::MAX).await else {
        let detail = "the answer could not be put together; the log has more";
        return Problem::new(StatusCode::INTERNAL_SERVER_ERROR, detail).into_response();
    };
    let tag = tag(&bytes);
    let matched = known.iter().filter_map(|list| list.to_str().ok()).any(|list| matches(list, &tag));
    if let Ok(value) = HeaderValue::from_str(&tag) {
        head.headers.insert(header::ETAG, value);
    }
    if matched {
        head.status = StatusCode::NOT_MODIFIED;
        head.headers.remove(header::CONTENT_TYPE);
        head.headers.remove(header::CONTENT_LENGTH);
        return Response::from_parts(head, Body::empty());
    }
    Response::from_parts(head, Body::from(bytes))
}

fn is_json(headers: &HeaderMap) -> bool {
    headers.get(header::CONTENT_TYPE).is_some_and(|kind| kind.as_bytes() == b"application/json")
}

/// The tag of a body. Another release may hash otherwise; its clients then ask for everything once.
fn tag(body: &[u8]) -> String {
    let mut hasher = DefaultHasher::new();
    hasher.write(body);
    format!("W/\"{:016x}\"", hasher.finish())
}

/// Whether a list of `If-None-Match` names the tag, by weak comparison. A list that is none names nothing.
fn matches(list: &str, tag: &str) -> bool {
    if list.trim() == "*" {
        return true;
    }
    let opaque = |tag: &str| tag.strip_prefix("W/").unwrap_or(tag).to_owned();
    let mut rest = list;
    loop {
        rest = rest.trim_start_matches([' ', '\t', ',']);
        let quoted = rest.strip_prefix("W/").unwrap_or(rest);
        let Some(end) = quoted.strip_prefix('"').and_then(|inner| inner.find('"')) else { return false };
        let (found, after) = quoted.split_at(end + 2);
        if found == opaque(tag) {
            return true;
        }
        rest = after;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tag_follows_the_content() {
        assert_eq!(tag(b"[]"), tag(b"[]"));
        assert_ne!(tag(b"[]"), tag(b"[ ]"));
        let tag = tag(b"");
        assert!(tag.len() == 20 && tag.starts_with("W/\"") && tag.ends_with('"'), "{tag}");
    }

    #[test]
    fn lists_are_read_as_the_standard_says() {
        let tag = "W/\"0011\"";
        for list in
            ["*", " * ", "W/\"0011\"", "\"0011\"", "\"a\", W/\"0011\"", "\"a,b\",\"0011\"", ", ,\"0011\" ,"]
        {
            assert!(matches(list, tag), "{list}");
        }
        for list in [
            "",
            "0011",
            "\"0012\"",
            "\"00\", \"11\"",
            "\"0011",
            "w/\"0011\"",
            "\"a\" \"",
            "W/*",
            "\"x,\"0011\"",
        ] {
            assert!(!matches(list, tag), "{list}");
        }
    }
}
