//! Who is let in.

use std::net::SocketAddr;

use axum::body::Body;
use axum::http::{Method, Request, header};
use busbar_emulator::control::{Control, ServeError, Token, serve};
use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use super::{Bench, at, imitated};

const SECRET: &str = "nobody-guesses-this";

#[tokio::test]
async fn with_a_token_nobody_is_let_in_without_it() {
    let bench = Bench::with(Some(Token::new(SECRET).unwrap())).await;
    let show = async |shown: Option<&str>| {
        let mut request = Request::builder().method(Method::PUT).uri(at("dkg/levers/mains"));
        request = request.header(header::CONTENT_TYPE, "application/json");
        if let Some(shown) = shown {
            request = request.header(header::AUTHORIZATION, shown);
        }
        bench.send(request.body(json!({ "position": "failed" }).to_string().into()).unwrap()).await
    };
    for wrong in [
        "",
        "Bearer",
        "Bearer nobody-guesses-thi",
        "Bearer nobody-guesses-this!",
        "Basic nobody-guesses-this",
    ] {
        let answer = show(Some(wrong)).await;
        assert!(answer.problem(401).contains("started with"), "{wrong}");
        assert_eq!(answer.headers[header::WWW_AUTHENTICATE], "Bearer");
    }
    show(None).await.problem(401);
    bench.ask(Method::GET, "/api/v1/controllers", None).await.problem(401);
    assert_eq!(show(Some(&format!("bearer {SECRET}"))).await.json()["position"], "failed");
    // The page has to ask for the token, and says nothing about the plant.
    for open in ["/", "/page.js", "/openapi.json"] {
        assert_eq!(bench.ask(Method::GET, open, None).await.status, 200, "{open}");
    }
}

#[tokio::test]
async fn nothing_listens_beyond_this_machine_without_a_token() {
    let bench = Bench::new().await;
    let control = |token| Control { imitated: imitated(&bench.emulation), token, site: None };
    for address in ["0.0.0.0:0", "[::]:0", "192.0.2.1:0", "[::ffff:192.0.2.1]:0"] {
        let address: SocketAddr = address.parse().unwrap();
        let error = serve(address, control(None)).await.unwrap_err();
        assert_eq!(error, ServeError::NoToken { address });
    }
    serve("127.0.0.1:0".parse().unwrap(), control(None)).await.unwrap().stop().await;
}

async fn status(address: SocketAddr, head: &str) -> String {
    let mut stream = TcpStream::connect(address).await.unwrap();
    stream.write_all(format!("GET /api/v1/controllers {head}\r\n\r\n").as_bytes()).await.unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await.unwrap();
    answer.split(' ').nth(1).unwrap().to_owned()
}

#[tokio::test]
async fn a_page_elsewhere_cannot_rebind_its_name() {
    let bench = Bench::new().await;
    let control = Control { imitated: imitated(&bench.emulation), ..Control::default() };
    let server = serve("127.0.0.1:0".parse().unwrap(), control).await.unwrap();
    for (host, expected) in [
        ("Host: localhost", "200"),
        ("Host: 127.0.0.1:80", "200"),
        ("Host: [::1]:80", "200"),
        ("Host: evil.example", "421"),
        ("Host: 127.0.0.1.evil.example", "421"),
        ("Host: localhost\r\nHost: localhost", "400"),
        ("Accept: */*", "400"),
    ] {
        let head = format!("HTTP/1.1\r\n{host}\r\nConnection: close");
        assert_eq!(status(server.address(), &head).await, expected, "{host}");
    }
    server.stop().await;
}

#[tokio::test]
async fn nobody_waits_for_a_body_that_is_not_taken() {
    let bench = Bench::new().await;
    let request = Request::builder().method(Method::PUT).uri(at("d/clock"));
    let request = request.header(header::CONTENT_TYPE, "application/json");
    let request = request.header(header::CONTENT_LENGTH, "99999999999");
    let told = bench.send(request.body(Body::from("{}")).unwrap()).await.problem(413);
    assert!(told.contains("8192 bytes"), "{told}");
}

#[tokio::test]
async fn the_page_loads_nothing_from_elsewhere() {
    let bench = Bench::new().await;
    let page = bench.ask(Method::GET, "/", None).await;
    let policy = page.headers[header::CONTENT_SECURITY_POLICY].to_str().unwrap();
    assert!(policy.contains("default-src 'none'") && policy.contains("frame-ancestors 'none'"), "{policy}");
    assert!(!page.body.contains("<!--site-->") && !page.body.contains("Operator"), "{}", page.body);
    for file in ["style.css", "page.js", "plant.js"] {
        let answer =
            bench.send(Request::builder().uri(format!("/{file}")).body(Body::empty()).unwrap()).await;
        assert_eq!(answer.status, 200);
        assert_eq!(answer.headers[header::X_CONTENT_TYPE_OPTIONS], "nosniff");
        // Addresses stay relative, and but for the name of SVG none is of another host.
        let addresses = answer.body.replace("http://www.w3.org/2000/svg", "");
        assert!(!addresses.contains("://") && !addresses.contains("'/api"), "{file}");
    }
}
