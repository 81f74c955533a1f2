//! Starting, refusing to start, and ending.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use busbar_gateway::{Options, Site, StartError};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::timeout;

use crate::support::{Bench, PATIENCE, site};

#[tokio::test]
async fn an_address_in_use_is_said_in_one_sentence() {
    let taken = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = taken.local_addr().unwrap();
    let site = Site::parse("bench.toml", &site("tcp://127.0.0.1:1")).unwrap();
    let error = busbar_gateway::start(site, Options { listen: Some(address), ..Options::default() })
        .await
        .unwrap_err();
    assert_eq!(error, StartError::AddressInUse { address });
    assert_eq!(
        error.to_string(),
        format!("{address} is in use by another program: stop it, or listen elsewhere")
    );
}

#[tokio::test]
async fn an_address_of_another_machine_is_said_in_one_sentence() {
    let site = Site::parse("bench.toml", &site("tcp://127.0.0.1:1")).unwrap();
    // 192.0.2.0/24 is nobody's.
    let address: SocketAddr = "192.0.2.1:8080".parse().unwrap();
    let error = busbar_gateway::start(site, Options { listen: Some(address), ..Options::default() })
        .await
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "cannot listen on 192.0.2.1:8080: this machine does not have that address; write one of its own, or 0.0.0.0 \
         for all of them"
    );
}

#[tokio::test]
async fn a_wire_that_cannot_be_spoken_is_named() {
    // The site file refuses it; whoever builds a site otherwise is told here.
    let mut site = Site::parse("bench.toml", &site("tcp://127.0.0.1:1")).unwrap();
    site.wires[0].endpoint = "tls://127.0.0.1:802".parse().unwrap();
    let error = busbar_gateway::start(site, Options::default()).await.unwrap_err();
    assert!(matches!(&error, StartError::Wire { wire, .. } if wire == "w1"), "{error:?}");
    assert!(error.to_string().contains("tls://127.0.0.1:802"), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_end_tells_readers_and_frees_the_port() {
    let bench = Bench::new().await;
    bench.until_view(|view| view["online"] == true).await;
    let mut stream = bench.client.events("").await;
    stream.next().await.unwrap();
    let idle = bench.client.never_reads().await;
    let silent = TcpStream::connect(bench.gateway.address()).await.unwrap();

    let address = bench.gateway.address();
    timeout(PATIENCE, bench.gateway.shutdown()).await.unwrap();
    while stream.next().await.is_some() {}
    TcpListener::bind(address).await.unwrap();
    drop((idle, silent));

    // The device is left alone from then on.
    let reads = bench.device.change(|device| device.reads.len());
    tokio::task::yield_now().await;
    assert_eq!(bench.device.change(|device| device.reads.len()), reads);
}

#[tokio::test(flavor = "multi_thread")]
async fn clients_that_only_keep_their_connection_do_not_delay_the_end() {
    let bench = Bench::new().await;
    let (_client, connection) = bench.client.keeps_its_connection().await;
    let before = Instant::now();
    timeout(PATIENCE, bench.gateway.shutdown()).await.unwrap();
    assert!(before.elapsed() < Duration::from_secs(2), "{:?}", before.elapsed());
    timeout(PATIENCE, connection).await.expect("the connection is closed").unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn two_gateways_live_side_by_side() {
    let (first, second) = (Bench::new().await, Bench::new().await);
    assert_ne!(first.gateway.address(), second.gateway.address());
    first.until_view(|view| view["online"] == true).await;
    drop(first);
    second.until_view(|view| view["online"] == true).await;
}
