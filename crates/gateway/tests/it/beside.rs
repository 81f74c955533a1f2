//! What is served beside the gateway: below its own folder, by its own routes, behind the gateway's guard.

use axum::Router;
use axum::http::StatusCode;
use axum::routing::{get, put};
use busbar_gateway::{Beside, Options};

use crate::support::{Client, site, start_with};

async fn client(beside: Vec<Beside>) -> (busbar_gateway::Gateway, Client) {
    start_with(&site("tcp://127.0.0.1:1"), Options { beside, ..Options::default() }).await
}

fn other() -> Beside {
    let routes = Router::new()
        .route("/", get(async || "another page"))
        .route("/deep/{id}", put(async || "changed"))
        .fallback(async || (StatusCode::NOT_FOUND, "it says so itself"));
    Beside { folder: "other".into(), name: "Something else".into(), routes }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_beside_has_its_folder_and_the_page_knows_of_it() {
    let (_gateway, client) = client(vec![other()]).await;
    let site = client.get("/api/v1/site").await.json();
    assert_eq!(site["beside"], serde_json::json!([{ "name": "Something else", "path": "other/" }]));
    assert_eq!(client.get("/other/").await.body, "another page");
    assert_eq!(client.ask("PUT", "/other/deep/7", &[]).await.body, "changed");
    // Below whatever path a proxy puts the gateway.
    let moved = client.get("/other").await;
    assert_eq!((moved.status.as_u16(), moved.header("location")), (308, "other/"));
    assert!(client.get("/").await.body.contains("Busbar"), "the page stays where it is");
    client.ask("PUT", "/api/v1/site", &[]).await.problem(405);
}

#[tokio::test(flavor = "multi_thread")]
async fn it_is_guarded_as_the_gateway_is() {
    let (_gateway, client) = client(vec![other()]).await;
    let answer = client.ask("GET", "/other/", &[("host", "evil.example")]).await;
    assert!(answer.problem(421).contains("was asked for evil.example"));
    assert_eq!(client.get("/other/").await.header("x-content-type-options"), "nosniff");
    client.get("/other/nothing").await.problem(404);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_gateway_alone_has_nothing_beside_it() {
    let (_gateway, client) = client(Vec::new()).await;
    assert_eq!(client.get("/api/v1/site").await.json()["beside"], serde_json::json!([]));
    let problem = client.get("/imitation/").await.problem(404);
    assert!(problem.starts_with("there is nothing at /imitation/"), "{problem}");
}
