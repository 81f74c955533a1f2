//! Control of running imitations: what its API does, what it refuses, and who is let in.

use axum::Router;
use axum::body::Body;
use axum::http::{HeaderMap, Method, Request, StatusCode, header};
use busbar_emulator::control::{Control, Imitated, Token, router};
use busbar_emulator::{Config, Emulation, start_together};
use http_body_util::BodyExt;
use serde_json::{Value, json};
use tower::ServiceExt;

mod api;
mod guard;
mod refusals;

/// Two controllers under control.
struct Bench {
    emulation: Emulation,
    routes: Router,
}

/// One whole answer.
#[derive(Debug)]
struct Answer {
    status: StatusCode,
    headers: HeaderMap,
    body: String,
}

impl Bench {
    async fn new() -> Self {
        Self::with(None).await
    }

    async fn with(token: Option<Token>) -> Self {
        let config = |profile: &str, unit| Config { profile: profile.into(), unit, ..Config::default() };
        let configs = vec![config("datakom-d", 1), config("datakom-dkg705", 2)];
        let emulation =
            start_together(configs, vec!["rtu+tcp://127.0.0.1:0".parse().unwrap()]).await.unwrap();
        let routes = router(Control { imitated: imitated(&emulation), token, site: None });
        Self { emulation, routes }
    }

    async fn send(&self, request: Request<Body>) -> Answer {
        let (head, body) = self.routes.clone().oneshot(request).await.unwrap().into_parts();
        let body = body.collect().await.unwrap().to_bytes();
        Answer { status: head.status, headers: head.headers, body: String::from_utf8(body.into()).unwrap() }
    }

    async fn ask(&self, method: Method, path: &str, body: Option<Value>) -> Answer {
        let request = Request::builder().method(method).uri(at(path));
        self.send(match body {
            Some(body) => {
                let request = request.header(header::CONTENT_TYPE, "application/json");
                request.body(body.to_string().into()).unwrap()
            }
            None => request.body(Body::empty()).unwrap(),
        })
        .await
    }

    async fn get(&self, path: &str) -> Value {
        self.ask(Method::GET, path, None).await.json()
    }

    async fn put(&self, path: &str, body: Value) -> Answer {
        self.ask(Method::PUT, path, Some(body)).await
    }

    async fn delete(&self, path: &str) -> Answer {
        self.ask(Method::DELETE, path, None).await
    }

    /// Stops both clocks and lets so much time pass on both.
    async fn step(&self, seconds: f64) {
        for id in ["d", "dkg"] {
            self.put(&format!("{id}/clock"), json!({ "paused": true })).await.json();
            self.ask(Method::POST, &format!("{id}/steps"), Some(json!({ "seconds": seconds }))).await.json();
        }
    }

    /// One value as a client reads it.
    async fn value(&self, id: &str, name: &str) -> Value {
        self.get(&format!("{id}/values?name={name}")).await[0]["value"].clone()
    }
}

impl Answer {
    /// The body of a good answer.
    #[track_caller]
    fn json(&self) -> Value {
        assert_eq!(self.status, StatusCode::OK, "{}", self.body);
        serde_json::from_str(&self.body).unwrap()
    }

    /// The sentence of a problem.
    #[track_caller]
    fn problem(&self, status: u16) -> String {
        assert_eq!(self.status, status, "{}", self.body);
        assert_eq!(self.headers[header::CONTENT_TYPE], "application/problem+json");
        let problem: Value = serde_json::from_str(&self.body).unwrap();
        assert_eq!(problem["status"], status);
        problem["detail"].as_str().unwrap().to_owned()
    }
}

fn imitated(emulation: &Emulation) -> Vec<Imitated> {
    let ids = [("d", "Genset 1"), ("dkg", "Genset 2")];
    let named = ids.iter().zip(emulation.controllers()).map(|((id, name), controller)| Imitated {
        id: (*id).to_owned(),
        name: (*name).to_owned(),
        controller: controller.clone(),
    });
    named.collect()
}

/// The address of something of a controller.
fn at(path: &str) -> String {
    match path.strip_prefix('/') {
        Some(_) => path.to_owned(),
        None => format!("/api/v1/controllers/{path}"),
    }
}
