//! The page: three small files, put into the library when it is built.

use axum::Router;
use axum::body::Bytes;
use axum::http::{HeaderValue, header};
use axum::routing::get;

/// Its files: address, type and content.
const FILES: [(&str, &str, &str); 4] = [
    ("/", "text/html; charset=utf-8", include_str!("../../page/index.html")),
    ("/style.css", "text/css; charset=utf-8", include_str!("../../page/style.css")),
    ("/page.js", "text/javascript; charset=utf-8", include_str!("../../page/page.js")),
    ("/plant.js", "text/javascript; charset=utf-8", include_str!("../../page/plant.js")),
];

/// Where the way to the operator's page goes.
const SITE: &str = "<!--site-->";

/// Its files; the document leads to `site`, if there is one.
pub(super) fn router(site: Option<&str>) -> Router {
    let link = site.map(|site| format!("<a href=\"{site}\">Operator’s page</a>")).unwrap_or_default();
    FILES.into_iter().fold(Router::new(), |router, (path, kind, content)| {
        let content = Bytes::from(content.replace(SITE, &link));
        let headers = [
            (header::CONTENT_TYPE, HeaderValue::from_static(kind)),
            (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
        ];
        router.route(path, get(async move || (headers, content)))
    })
}
