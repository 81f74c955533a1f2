//! What the tests share: an imitated controller, a gateway on it, and a client that believes nothing.

mod client;
mod imitation;

use std::time::Duration;

use busbar_gateway::{Gateway, Limits, Options, Site};
use serde_json::Value;

pub(crate) use self::client::{Client, Event, Stream};
pub(crate) use self::imitation::{Behaviour, Imitation};

/// Nothing here waits for a fixed time; this is when a test gives up.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

/// A gateway with one imitated D-500.
pub(crate) struct Bench {
    pub(crate) device: Imitation,
    pub(crate) gateway: Gateway,
    pub(crate) client: Client,
}

impl Bench {
    /// A gateway that polls an imitated D-500 at rest.
    pub(crate) async fn new() -> Self {
        Self::with(|_| {}).await
    }

    /// The same, with the device prepared before it is first asked.
    pub(crate) async fn with(prepare: impl FnOnce(&mut Behaviour)) -> Self {
        Self::bound(prepare, None).await
    }

    /// The same, with other limits for clients.
    pub(crate) async fn bound(prepare: impl FnOnce(&mut Behaviour), limits: Option<Limits>) -> Self {
        let device = Imitation::start().await;
        device.change(prepare);
        let site = site(&format!("tcp://{}", device.address()));
        let (gateway, client) = start_with(&site, Options { limits, ..Options::default() }).await;
        Self { device, gateway, client }
    }

    /// The value of a point of the device.
    pub(crate) async fn value(&self, point: &str) -> Value {
        let path = format!("/api/v1/devices/gen1/values?point={point}");
        self.client.get(&path).await.json()[0].clone()
    }

    pub(crate) async fn view(&self) -> Value {
        self.client.get("/api/v1/devices/gen1").await.json()
    }

    /// Waits until a point is as wanted.
    pub(crate) async fn until_value(&self, point: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        until(async || self.value(point).await, wanted).await
    }

    pub(crate) async fn until_view(&self, wanted: impl Fn(&Value) -> bool) -> Value {
        until(async || self.view().await, wanted).await
    }
}

/// A site with one device, polled twenty times a second.
pub(crate) fn site(endpoint: &str) -> String {
    format!(
        r#"
        [site]
        name = "Bench"
        [server]
        listen = "127.0.0.1:0"
        [[wires]]
        id = "w1"
        endpoint = "{endpoint}"
        timeout = "200ms"
        [[devices]]
        id = "gen1"
        name = "Genset 1"
        profile = "datakom-d"
        wire = "w1"
        unit = 1
        poll = {{ fast = "50ms", slow = "200ms" }}
        "#
    )
}

pub(crate) async fn start(site: &str) -> (Gateway, Client) {
    start_with(site, Options::default()).await
}

pub(crate) async fn start_with(site: &str, options: Options) -> (Gateway, Client) {
    let site = Site::parse("bench.toml", site).unwrap();
    let gateway = busbar_gateway::start(site, options).await.unwrap();
    let client = Client::new(gateway.address());
    (gateway, client)
}

/// Asks until the answer is as wanted.
pub(crate) async fn until<T: std::fmt::Debug>(ask: impl AsyncFn() -> T, wanted: impl Fn(&T) -> bool) -> T {
    let deadline = tokio::time::Instant::now() + PATIENCE;
    loop {
        let answer = ask().await;
        if wanted(&answer) {
            return answer;
        }
        assert!(tokio::time::Instant::now() < deadline, "still {answer:#?}");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}
