//! A peer whose every byte the test decides, and the client's usual requests.

use std::future::Future;
use std::time::Duration;

use busbar_link::{Backoff, Endpoint, Link, LinkError, Options, WireState, Write};
use tokio::io::AsyncReadExt;
use tokio::net::{TcpListener, TcpStream};

pub(crate) const UNIT: u8 = 1;
pub(crate) const ADDRESS: u16 = 10246;

/// Short enough for tests that wait for it, long enough for a peer on a busy machine.
pub(crate) const QUICK: Duration = Duration::from_millis(300);

/// A listener on a port of the system's choice.
pub(crate) async fn listener() -> (TcpListener, Endpoint) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let endpoint = Endpoint::from(listener.local_addr().unwrap());
    (listener, endpoint)
}

pub(crate) fn quick() -> Options {
    Options {
        timeout: QUICK,
        backoff: Backoff { first: Duration::from_millis(5), max: Duration::from_millis(20) },
        ..Options::default()
    }
}

/// Time-outs that no test reaches.
pub(crate) fn patient() -> Options {
    Options { timeout: Duration::from_secs(60), ..Options::default() }
}

/// Runs the peer beside the client; both must come to their end.
pub(crate) async fn play<T>(
    peer: impl Future<Output = ()> + Send + 'static,
    client: impl Future<Output = T>,
) -> T {
    let peer = tokio::spawn(peer);
    let both = async {
        let result = client.await;
        peer.await.unwrap();
        result
    };
    tokio::time::timeout(Duration::from_secs(30), both).await.expect("somebody waits for ever")
}

pub(crate) async fn request(stream: &mut TcpStream) -> [u8; 12] {
    let mut request = [0; 12];
    stream.read_exact(&mut request).await.unwrap();
    request
}

/// The peer waits until the client has hung up.
pub(crate) async fn hung_up(mut stream: TcpStream) {
    // A reset is as good as an end.
    let _ = stream.read_to_end(&mut Vec::new()).await;
}

pub(crate) fn frame(transaction: [u8; 2], unit: u8, pdu: &[u8]) -> Vec<u8> {
    let length = u8::try_from(pdu.len() + 1).unwrap();
    [&transaction[..], &[0, 0, 0, length, unit], pdu].concat()
}

/// An answer to a read that holds one register.
pub(crate) fn register(request: &[u8; 12], value: u16) -> Vec<u8> {
    let [high, low] = value.to_be_bytes();
    frame([request[0], request[1]], request[6], &[request[7], 2, high, low])
}

pub(crate) async fn read(link: &Link) -> Result<Vec<u16>, LinkError> {
    link.read_registers(UNIT, 3, ADDRESS, 1).await
}

pub(crate) async fn write(link: &Link) -> Result<(), LinkError> {
    let write = Write::Register { address: 8193, value: 4 };
    link.write(UNIT, write).await
}

pub(crate) async fn wait_until(link: &Link, wanted: impl Fn(&WireState) -> bool) -> WireState {
    link.state().wait_for(|state| wanted(state)).await.unwrap().clone()
}
