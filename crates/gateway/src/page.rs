//! The page: the files of `web/dist`, put into the library when it was built and served from memory, compressed. The
//! document itself is written for each reader, with the site as it stands.

mod first;
mod tiles;

use std::sync::{Arc, LazyLock};

use axum::Router;
use axum::extract::{Request, State};
use axum::http::{HeaderValue, header};
use axum::middleware::{Next, from_fn};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::get;
use jiff::Timestamp;
use memory_serve::CacheControl;

use crate::hub::Hub;

/// `index.html` as it was built.
const DOCUMENT: &str = include_str!(concat!(env!("OUT_DIR"), "/index.html"));

/// Where the site goes.
const PLACE: &str = "<!--first-->";

/// Every file of the page, but for the document at `/`.
pub(crate) fn files() -> Router {
    // Its files are unpacked once and never freed, so there is one for all gateways of this process.
    static FILES: LazyLock<Router> = LazyLock::new(|| {
        memory_serve::load!()
            .index_file(None)
            // Off in debug builds otherwise, and then nobody would try it.
            .enable_brotli(true)
            .enable_gzip(true)
            .html_cache_control(CacheControl::NoCache)
            .cache_control(CacheControl::Short)
            .into_router()
            .layer(from_fn(keep_hashed))
    });
    FILES.clone()
}

/// The document at `/`.
pub(crate) fn document(hub: Arc<Hub>) -> Router {
    Router::new().route("/", get(written)).with_state(hub)
}

/// The document with the site in it; it is another one each time, so nobody is asked to remember it.
async fn written(State(hub): State<Arc<Hub>>) -> Response {
    let body = DOCUMENT.replacen(PLACE, &first::html(&hub, Timestamp::now()), 1);
    ([(header::CACHE_CONTROL, "no-cache")], Html(body)).into_response()
}

/// Vite puts a hash of the content into the names under `/assets`: those never change.
async fn keep_hashed(request: Request, next: Next) -> Response {
    let hashed = request.uri().path().starts_with("/assets/");
    let mut response = next.run(request).await;
    if hashed && response.status().is_success() {
        let value = HeaderValue::from_static("max-age=31536000, immutable");
        response.headers_mut().insert(header::CACHE_CONTROL, value);
    }
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_document_has_one_place_for_the_site() {
        assert_eq!(DOCUMENT.matches(PLACE).count(), 1);
    }
}
