//! The page: the files of `web/dist`, put into the library when it was built and served from memory, compressed.

use std::sync::LazyLock;

use axum::Router;
use axum::extract::Request;
use axum::http::{HeaderValue, header};
use axum::middleware::{Next, from_fn};
use axum::response::Response;
use memory_serve::CacheControl;

/// Every file of the page, `/` included.
pub(crate) fn router() -> Router {
    // Its files are unpacked once and never freed, so there is one for all gateways of this process.
    static ROUTER: LazyLock<Router> = LazyLock::new(|| {
        memory_serve::load!()
            // Off in debug builds otherwise, and then nobody would try it.
            .enable_brotli(true)
            .enable_gzip(true)
            .html_cache_control(CacheControl::NoCache)
            .cache_control(CacheControl::Short)
            .into_router()
            .layer(from_fn(keep_hashed))
    });
    ROUTER.clone()
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
