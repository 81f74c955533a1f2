//! The HTTP server: accepts connections, bounds them, and ends them when the gateway ends.

mod guard;
mod held;
mod limits;
mod places;
mod refusal;
mod streams;

use std::net::SocketAddr;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::http::{StatusCode, header};
use axum::middleware::{from_fn, from_fn_with_state};
use axum::routing::get;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep, timeout};
use tower_http::compression::CompressionLayer;

use self::guard::{Known, header_unless_set};
pub use self::limits::Limits;
use self::places::{Activity, Places};
use self::refusal::Worded;
use self::streams::{Peer, Streams};
use crate::api;
use crate::gateway::Beside;
use crate::hub::Hub;
use crate::page;
use crate::patience::Patient;
use crate::stop::Stop;

/// How long connections may take to end: one that never reads ends by nothing else than being cut off.
pub(crate) const FAREWELL: Duration = Duration::from_secs(2);

/// The longest head of a request, and of what a connection keeps of an answer.
const BUFFER: usize = 32 * 1_024;

/// How soon it is looked again whether a connection can make room.
const CROWDED: Duration = Duration::from_millis(100);

/// Where and for whom it serves.
#[derive(Debug)]
pub(crate) struct Service {
    pub(crate) listener: TcpListener,
    pub(crate) address: SocketAddr,
    /// None: those of this process.
    pub(crate) limits: Option<Limits>,
    /// What is served besides.
    pub(crate) beside: Vec<Beside>,
}

/// Serves until the gateway ends.
pub(crate) async fn serve(service: Service, hub: Arc<Hub>) {
    let wires = hub.table().wires.len();
    let limits = service.limits.unwrap_or_else(|| Limits::with_handles(limits::handles(), wires));
    let stop = hub.stop();
    let known = Known { address: service.address.ip(), hub: Arc::clone(&hub) };
    let routes = router(hub, &limits).merge(beside(service.beside));
    accept(service.listener, guard::guarded(routes, known), limits, stop).await;
}

async fn accept(listener: TcpListener, router: Router, limits: Limits, stop: Stop) {
    let origin = Instant::now();
    let (mut connections, mut places) = (JoinSet::new(), Places::default());
    let mut ended = stop.clone();
    // Several at a time, for finding them means looking at all of them.
    let some = (limits.connections / 64).max(1);
    loop {
        let crowded = connections.len() >= limits.connections;
        tokio::select! {
            biased;
            () = ended.requested() => break,
            Some(left) = connections.join_next_with_id() => {
                places.leave(left.map_or_else(|error| error.id(), |(id, ())| id));
            }
            accepted = listener.accept(), if !crowded => match accepted {
                Ok((stream, from)) => {
                    let activity = Arc::new(Activity::new(origin, Peer::of(from.ip())));
                    let connection = connection(stream, router.clone(), limits, Arc::clone(&activity), stop.clone());
                    places.take(connections.spawn(connection), activity);
                    if connections.len() >= limits.connections {
                        places.make_room(some);
                    }
                }
                Err(error) => {
                    // Out of file handles, most likely: it passes, and trying at once would only burn the processor.
                    tracing::warn!(%error, "cannot accept a connection");
                    places.make_room(some);
                    sleep(CROWDED).await;
                }
            },
            () = sleep(CROWDED), if crowded => places.make_room(some),
        }
    }
    drop(listener);
    let _ = timeout(FAREWELL, async { while connections.join_next().await.is_some() {} }).await;
    connections.shutdown().await;
}

async fn connection(
    stream: TcpStream,
    router: Router,
    limits: Limits,
    activity: Arc<Activity>,
    mut stop: Stop,
) {
    // Events are small and late ones are of no use.
    let _ = stream.set_nodelay(true);
    let mut server = http1::Builder::new();
    server.timer(TokioTimer::new()).header_read_timeout(limits.head).max_buf_size(BUFFER);
    let stream = Patient::new(stream, limits.write, {
        let activity = Arc::clone(&activity);
        move || activity.mark()
    });
    let router = TowerToHyperService::new(router);
    let service = hyper::service::service_fn(move |mut request: hyper::Request<hyper::body::Incoming>| {
        request.extensions_mut().insert(activity.peer());
        let answering = activity.answering();
        let answer = hyper::service::Service::call(&router, request);
        async move { answer.await.map(|response| held::holding(response, answering)) }
    });
    let mut connection = pin!(server.serve_connection(TokioIo::new(Worded::new(stream)), service));
    let stopped = tokio::select! {
        result = connection.as_mut() => {
            if let Err(error) = result {
                tracing::debug!(%error, "a connection broke");
            }
            false
        }
        () = stop.requested() => true,
    };
    if stopped {
        connection.as_mut().graceful_shutdown();
        let _ = connection.await;
    }
}

/// The API and the page.
fn router(hub: Arc<Hub>, limits: &Limits) -> Router {
    let waiting = guard::waiting(limits);
    let document = page::document(Arc::clone(&hub))
        .layer(from_fn_with_state(Arc::clone(&waiting), guard::weighed))
        .layer(CompressionLayer::new());
    let api = api::router(hub)
        .layer(from_fn(api::tagged))
        .layer(from_fn_with_state(waiting, guard::weighed))
        .layer(CompressionLayer::new())
        .layer(from_fn_with_state(Streams::new(limits.streams), guard::counted))
        .layer(header_unless_set(header::CACHE_CONTROL, "no-store"))
        .layer(header_unless_set(header::VARY, "accept-encoding"));
    Router::new().merge(api).merge(document).merge(page::files())
}

/// What is served besides, each below its folder; its page finds its own files there.
fn beside(beside: Vec<Beside>) -> Router {
    beside.into_iter().fold(Router::new(), |router, Beside { folder, routes, .. }| {
        let within = format!("{folder}/");
        let moved = get(async move || ([(header::LOCATION, within)], StatusCode::PERMANENT_REDIRECT));
        router.route(&format!("/{folder}"), moved).nest_service(&format!("/{folder}/"), routes)
    })
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};

    use super::*;

    async fn ask(address: SocketAddr) -> TcpStream {
        let mut stream = TcpStream::connect(address).await.unwrap();
        let request = format!("GET /api/v1/wires HTTP/1.1\r\nhost: {address}\r\n\r\n");
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = [0; 15];
        stream.read_exact(&mut answer).await.unwrap();
        assert_eq!(&answer, b"HTTP/1.1 200 OK");
        stream
    }

    #[tokio::test]
    async fn the_longest_idle_connection_makes_room_for_the_next() {
        let (announcer, stop) = crate::stop::channel();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let hub = Arc::new(crate::testing::hub(&[], stop));
        let limits = Limits { connections: 3, ..Limits::default() };
        let service = Service { listener, address, limits: Some(limits), beside: Vec::new() };
        let server = tokio::spawn(serve(service, hub));
        let mut first = ask(address).await;
        let mut second = ask(address).await;
        // The third takes the last place, and the first goes for the one after it.
        let _third = ask(address).await;
        let mut rest = Vec::new();
        let _ = first.read_to_end(&mut rest).await;
        let _fourth = ask(address).await;
        let _ = second.read_to_end(&mut rest).await;
        announcer.announce();
        server.await.unwrap();
    }
}
