//! What HTTP clients get that ask for the wrong thing, and how the right one is guarded.

use crate::support::Bench;

#[tokio::test(flavor = "multi_thread")]
async fn the_site_is_described() {
    let bench = Bench::new().await;
    let site = bench.client.get("/api/v1/site").await.json();
    assert_eq!((&site["name"], &site["version"]), (&"Bench".into(), &env!("CARGO_PKG_VERSION").into()));
    assert!(site["started"].is_string());
    let devices = bench.client.get("/api/v1/devices").await.json();
    assert_eq!((&site["devices"][0]["id"], &devices[0]["id"]), (&"gen1".into(), &"gen1".into()));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_not_there_is_told_in_a_sentence() {
    let bench = Bench::new().await;
    for path in [
        "/api/v1/devices/gen9",
        "/api/v1/devices/gen9/points",
        "/api/v1/devices/gen9/values",
        "/api/v1/devices/gen9/joined",
        "/api/v1/events?device=gen9",
    ] {
        let problem = bench.client.get(path).await.problem(404);
        assert_eq!(problem, "there is no device gen9; this site has gen1", "{path}");
    }
    for path in ["/api/v1/nothing", "/api", "/nothing.js", "/../etc/passwd", "/api/v1/devices/gen1/values/1"]
    {
        let problem = bench.client.get(path).await.problem(404);
        assert!(problem.starts_with("there is nothing at /"), "{path}: {problem}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bad_query_is_told_in_a_sentence() {
    let bench = Bench::new().await;
    let values = "/api/v1/devices/gen1/values";
    for (query, expected) in [
        ("?group=gen", "gen1 has no group gen; it has state, alarms, "),
        ("?point=genset_l1_voltage,speed", "gen1 has no point speed; see /api/v1/devices/gen1/points"),
        ("?points=engine_speed", "the query is not understood: points: unknown field `points`"),
    ] {
        let problem = bench.client.get(&format!("{values}{query}")).await.problem(400);
        assert!(problem.starts_with(expected), "{query}: {problem}");
    }
    bench.client.get("/api/v1/events?devices=gen1").await.problem(400);
}

#[tokio::test(flavor = "multi_thread")]
async fn values_can_be_chosen() {
    let bench = Bench::new().await;
    let of =
        async |query: &str| bench.client.get(&format!("/api/v1/devices/gen1/values{query}")).await.json();
    let all = of("").await;
    let state = of("?group=state").await;
    assert_eq!(state.as_array().unwrap().len(), 3);
    assert!(all.as_array().unwrap().len() > 100);
    let two = of("?point=unit_mode,genset_l1_voltage").await;
    assert_eq!(
        (&two[0]["id"], &two[1]["id"]),
        (&"genset_l1_voltage".into(), &"unit_mode".into()),
        "by address"
    );
    assert_eq!(of("?group=state&point=genset_l1_voltage").await, serde_json::json!([]));
}

#[tokio::test(flavor = "multi_thread")]
async fn points_can_be_chosen_by_signal() {
    let bench = Bench::new().await;
    let points = "/api/v1/devices/gen1/points";
    let of = async |query: &str| bench.client.get(&format!("{points}{query}")).await.json();
    let two = of("?signal=breaker.genset.closed,genset.power.active,src1.frequency").await;
    let groups = two["groups"].as_array().unwrap();
    assert_eq!(groups.len(), 2, "the groups that have none are left out: {two}");
    assert_eq!(groups[0]["points"][0]["id"], "genset_active_power");
    let flags = &groups[1]["points"][0];
    assert_eq!(flags["bits"].as_array().unwrap().len(), 1, "of an array only the bit that was asked for");
    assert_eq!(flags["bits"][0]["signal"], "breaker.genset.closed");
    let none = of("?signal=").await;
    assert_eq!((&none["groups"], &none["joined"]), (&serde_json::json!([]), &serde_json::json!([])));
    assert_eq!(two["manual"], "D-300 / 500 / 700 Modbus Application Manual, V5.6 (25.04.2016)");
    bench.client.get(&format!("{points}?signals=fuel.level")).await.problem(400);
}

#[tokio::test(flavor = "multi_thread")]
async fn nothing_can_be_changed() {
    let bench = Bench::new().await;
    for method in ["POST", "PUT", "PATCH", "DELETE"] {
        for path in ["/api/v1/site", "/api/v1/devices/gen1", "/api/v1/events", "/"] {
            let answer = bench.client.ask(method, path, &[]).await;
            assert_eq!(answer.problem(405), format!("{path} cannot be used with {method}; use GET"));
            assert_eq!(answer.header("allow"), "GET,HEAD");
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_answer_is_guarded() {
    let bench = Bench::new().await;
    for path in ["/", "/api/v1/site", "/api/v1/nothing", "/healthz"] {
        let answer = bench.client.get(path).await;
        let policy = answer.header("content-security-policy");
        assert!(policy.contains("default-src 'self'") && policy.contains("frame-ancestors 'none'"), "{path}");
        assert_eq!(answer.header("x-content-type-options"), "nosniff", "{path}");
        assert_eq!(answer.header("referrer-policy"), "same-origin", "{path}");
        assert_eq!(answer.header("access-control-allow-origin"), "", "{path}");
    }
    assert_eq!(bench.client.get("/api/v1/site").await.header("cache-control"), "no-store");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_elsewhere_cannot_rebind_its_name() {
    let bench = Bench::new().await;
    let port = bench.gateway.address().port();
    for host in ["localhost", "127.0.0.1", "[::1]"] {
        for host in [host.to_owned(), format!("{host}:{port}")] {
            let answer = bench.client.ask("GET", "/api/v1/site", &[("host", &host)]).await;
            assert_eq!(answer.status, 200, "{host}");
        }
    }
    for path in ["/", "/api/v1/site", "/healthz"] {
        let host = format!("evil.example:{port}");
        let answer = bench.client.ask("GET", path, &[("host", &host)]).await;
        let problem = answer.problem(421);
        assert!(problem.contains("was asked for evil.example"), "{problem}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_page_is_served() {
    let bench = Bench::new().await;
    let page = bench.client.get("/").await;
    assert_eq!(page.status, 200);
    assert_eq!(page.header("content-type"), "text/html; charset=utf-8");
    assert!(page.body.contains("<title>"), "{}", page.body);
    assert!(page.body.contains("Busbar"));
    assert!(page.body.contains("<h2>Genset 1</h2>"), "with the site as it stands: {}", page.body);
    assert_eq!((page.header("cache-control"), page.header("etag")), ("no-cache", ""), "never the same twice");
    let small = bench.client.ask("GET", "/", &[("accept-encoding", "br")]).await;
    assert_eq!(small.header("content-encoding"), "br");
}

#[tokio::test(flavor = "multi_thread")]
async fn answers_are_compressed_for_who_can_read_it() {
    let bench = Bench::new().await;
    let path = "/api/v1/devices/gen1/points";
    let plain = bench.client.get(path).await;
    let small = bench.client.ask("GET", path, &[("accept-encoding", "gzip, br")]).await;
    assert_eq!((plain.header("content-encoding"), small.header("content-encoding")), ("", "br"));
    assert!(small.body.len() * 4 < plain.body.len());
}

#[tokio::test(flavor = "multi_thread")]
async fn the_document_is_served() {
    let bench = Bench::new().await;
    let served = bench.client.get("/api/v1/openapi.json").await.json();
    let generated: serde_json::Value =
        serde_json::from_str(&busbar_gateway::openapi().to_json().unwrap()).unwrap();
    assert!(served == generated);
    assert_eq!(served["openapi"], "3.1.0");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_address_that_is_no_text_is_a_problem_like_any_other() {
    let bench = Bench::new().await;
    for path in ["/api/v1/devices/%FF", "/api/v1/devices/%FF/points", "/api/v1/devices/%FF/values"] {
        let problem = bench.client.get(path).await.problem(400);
        assert!(problem.contains("names no device"), "{path}: {problem}");
    }
    let problem = bench.client.get("/api/v1/devices/gen1/values?foo=1").await.problem(400);
    assert!(problem.starts_with("the query is not understood: ") && problem.contains("foo"), "{problem}");
    assert!(!problem.contains("deserialize"), "{problem}");
}

#[tokio::test(flavor = "multi_thread")]
async fn who_has_an_answer_is_told_so() {
    let bench = Bench::new().await;
    bench.until_view(|view| view["online"] == true).await;
    for path in ["/api/v1/devices/gen1/points", "/api/v1/openapi.json", "/api/v1/alarms"] {
        let whole = bench.client.get(path).await;
        let tag = whole.header("etag").to_owned();
        assert!(tag.starts_with("W/\"") && tag.len() == 20, "{path}: {tag}");
        assert_eq!(whole.header("vary"), "accept-encoding", "{path}");
        let strong = tag.trim_start_matches("W/").to_owned();
        for list in [tag.clone(), strong, format!("\"other\", {tag}"), "*".to_owned()] {
            for method in ["GET", "HEAD"] {
                let again = bench.client.ask(method, path, &[("if-none-match", &list)]).await;
                assert_eq!((again.status.as_u16(), again.body.as_str()), (304, ""), "{path} {list}");
                assert_eq!(again.header("etag"), tag);
                assert_eq!(again.header("vary"), "accept-encoding");
                assert_eq!(again.header("cache-control"), whole.header("cache-control"));
                assert_eq!(again.header("content-type"), "");
            }
        }
        let other = bench.client.ask("GET", path, &[("if-none-match", "\"other\"")]).await;
        assert_eq!((other.status.as_u16(), other.body == whole.body), (200, true));
        // However it is compressed, it is the same answer.
        let small = bench.client.ask("GET", path, &[("accept-encoding", "gzip")]).await;
        assert_eq!(small.header("etag"), tag);
        let both = [("accept-encoding", "gzip"), ("if-none-match", tag.as_str())];
        assert_eq!(bench.client.ask("GET", path, &both).await.status, 304);
        // A head alone has the headers of the whole.
        let head = bench.client.ask("HEAD", path, &[]).await;
        assert_eq!((head.status.as_u16(), head.body.as_str(), head.header("etag")), (200, "", tag.as_str()));
        assert_eq!(head.header("content-length"), whole.body.len().to_string());
    }
    let points = bench.client.get("/api/v1/devices/gen1/points").await;
    assert_eq!(points.header("cache-control"), "no-cache", "kept, and asked for again");
    assert_eq!(bench.client.get("/api/v1/alarms").await.header("cache-control"), "no-store");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_tag_changes_with_what_it_is_for() {
    let bench = Bench::new().await;
    let path = "/api/v1/devices/gen1/values?point=genset_l1_voltage";
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    let before = bench.client.get(path).await;
    bench.device.change(|device| device.registers.insert(10_246, 2_400));
    bench.until_value("genset_l1_voltage", |value| value["value"] == 240).await;
    let after = bench.client.ask("GET", path, &[("if-none-match", before.header("etag"))]).await;
    assert_eq!(after.json()[0]["value"], 240);
    assert_ne!(after.header("etag"), before.header("etag"));
    // What is no good answer carries none.
    assert_eq!(bench.client.get("/api/v1/devices/gen9").await.header("etag"), "");
    let problem = bench.client.ask("GET", "/api/v1/devices/gen9", &[("if-none-match", "*")]).await;
    problem.problem(404);
}

#[tokio::test(flavor = "multi_thread")]
async fn it_lives_and_says_when_it_is_ready() {
    let bench = Bench::new().await;
    let lives = bench.client.get("/healthz").await;
    assert_eq!((lives.status.as_u16(), lives.body.as_str()), (200, "ok\n"));
    let ready =
        crate::support::until(async || bench.client.get("/readyz").await, |ready| ready.status == 200).await;
    assert_eq!(ready.body, "ready\n");
    assert_eq!(bench.client.get("/api/v1/devices/gen1").await.json()["online"], true);
    bench.device.change(|device| device.silent = true);
    bench.until_view(|view| view["online"] == false).await;
    assert_eq!(bench.client.get("/readyz").await.status, 200, "a device that dies is for the page to show");
}

#[tokio::test(flavor = "multi_thread")]
async fn it_is_not_ready_before_a_device_was_tried() {
    // Its first answer is waited for for a minute, and until then nothing is known of it.
    let device = crate::support::Imitation::start().await;
    device.change(|device| device.silent = true);
    let site = crate::support::site(&format!("tcp://{}", device.address()))
        .replace("200ms\"\n        [[dev", "60s\"\n        [[dev");
    let (_gateway, client) = crate::support::start(&site).await;
    let problem = client.get("/readyz").await.problem(503);
    assert_eq!(problem, "no first answer yet, and no fault either, of gen1; ask again in a moment");
}

#[tokio::test(flavor = "multi_thread")]
async fn numbers_are_told_as_openmetrics() {
    let bench = Bench::new().await;
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    let answer = bench.client.get("/metrics").await;
    assert_eq!(answer.header("content-type"), "application/openmetrics-text; version=1.0.0; charset=utf-8");
    let has = |line: &str| answer.body.lines().any(|told| told == line);
    assert!(has("busbar_genset_l1_voltage_v{device=\"gen1\"} 230.2"), "{}", answer.body);
    assert!(has("busbar_wire_connected{wire=\"w1\"} 1") && answer.body.ends_with("\n# EOF\n"));
    let counted = |line: &str| answer.body.lines().any(|told| told.starts_with(line));
    assert!(
        counted("busbar_wire_requests_total{wire=\"w1\"} ")
            && counted("busbar_unit_answers_total{wire=\"w1\",unit=\"1\"} ")
    );

    bench.device.change(|device| device.exception = Some(2));
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "bad").await;
    let refused = bench.client.get("/metrics").await.body;
    assert!(!refused.contains("busbar_genset_l1_voltage_v{"), "an exception is no number");
    assert!(refused.contains("busbar_wire_exceptions_total{wire=\"w1\",code=\"2\"} "), "{refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_host_of_a_proxy_can_be_named() {
    let device = crate::support::Imitation::start().await;
    let plain = crate::support::site(&format!("tcp://{}", device.address()));
    let named = plain.replace("[server]", "[server]\n        hosts = [\"power.example.org\"]");
    let (mut gateway, client) = crate::support::start(&named).await;
    let ask = async |host: &str| client.ask("GET", "/api/v1/site", &[("host", host)]).await;
    for host in ["power.example.org", "Power.Example.org:443", "localhost"] {
        assert_eq!(ask(host).await.status, 200, "{host}");
    }
    for host in ["example.org", "evil.power.example.org", "power.example.org.evil.example"] {
        assert!(ask(host).await.problem(421).ends_with("name the host of a proxy under [server] hosts"));
    }
    // It follows the site file while the gateway runs.
    gateway.reload(busbar_gateway::Site::parse("bench.toml", &plain).unwrap()).unwrap();
    ask("power.example.org").await.problem(421);
}
