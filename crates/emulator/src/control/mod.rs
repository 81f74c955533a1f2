//! Control of imitated controllers while they run: an HTTP API with its OpenAPI document, and a page that draws each
//! plant and has its switches.
//!
//! [`router`] is all of it, to be mounted below any path of a server that knows who may ask; [`serve`] is a server of
//! its own for one program. What a caller can do wrong is answered with one sentence: RFC 9457 problems.

mod alarms;
mod clock;
mod document;
mod guard;
mod page;
mod pins;
mod plant;
mod problem;
mod server;
mod site;
mod token;
mod types;
mod values;

use std::sync::Arc;

use axum::Router;
use axum::middleware::from_fn_with_state;

pub use document::openapi;
pub use problem::Problem;
pub use server::{ServeError, Server, may_listen, serve};
pub use site::Imitated;
pub use token::{Token, TokenError};

use site::Site;

/// What is to be controlled, and by whom.
#[derive(Clone, Debug, Default)]
pub struct Control {
    /// The controllers, in the order in which people are shown them.
    pub imitated: Vec<Imitated>,
    /// Where there is one, the API answers nobody who does not show it.
    pub token: Option<Token>,
    /// Where the operator's page of the same site is, seen from this one: `../`.
    pub site: Option<String>,
}

/// The API and the page. Addresses in it are relative: it can be mounted below any path that ends with `/`.
pub fn router(control: Control) -> Router {
    let Control { imitated, token, site } = control;
    let api = Router::from(document::routes()).with_state(Arc::new(Site::new(imitated)));
    let api = match token {
        Some(token) => api.layer(from_fn_with_state(token, guard::token_shown)),
        None => api,
    };
    guard::guarded(Router::new().merge(api).merge(document::router()).merge(page::router(site.as_deref())))
}
