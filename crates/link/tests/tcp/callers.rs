//! Many callers on one wire, patient ones and others.

use std::future::Future;
use std::pin::{Pin, pin};
use std::task::Poll;
use std::time::Duration;

use busbar_link::{Backoff, Link, LinkError, Options, Priority, WireState};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;
use tokio::sync::{mpsc, oneshot};

use crate::peer::*;

#[tokio::test]
async fn refuses_more_than_it_can_hold() {
    let (listener, endpoint) = listener().await;
    let (arrived, mut first_arrived) = mpsc::channel(1);
    let (go, may_go) = oneshot::channel::<()>();
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let first = request(&mut stream).await;
        arrived.send(()).await.unwrap();
        may_go.await.unwrap();
        stream.write_all(&register(&first, 1)).await.unwrap();
        let second = request(&mut stream).await;
        stream.write_all(&register(&second, 2)).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, Options { queue: 1, ..patient() }).unwrap();
        let flying = tokio::spawn({
            let link = link.clone();
            async move { read(&link).await }
        });
        first_arrived.recv().await.unwrap();
        let (second, third) = tokio::join!(biased; read(&link), async {
            let third = read(&link).await;
            go.send(()).unwrap();
            third
        });
        assert_eq!(third, Err(LinkError::QueueFull { waiting: 1 }));
        assert_eq!((flying.await.unwrap(), second), (Ok(vec![1]), Ok(vec![2])));
    };
    play(peer, client).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn gives_each_of_many_callers_their_own_answer() {
    const CALLERS: u16 = 64;
    const READS: u16 = 50;
    let (listener, endpoint) = listener().await;
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        for _ in 0..CALLERS * READS {
            let asked = request(&mut stream).await;
            let address = u16::from_be_bytes([asked[8], asked[9]]);
            stream.write_all(&register(&asked, !address)).await.unwrap();
        }
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        let callers: Vec<_> = (0..CALLERS)
            .map(|caller| {
                let link =
                    link.with_priority(if caller % 2 == 0 { Priority::Poll } else { Priority::Person });
                tokio::spawn(async move {
                    for read in 0..READS {
                        let address = caller * 1000 + read;
                        assert_eq!(link.read_registers(UNIT, 3, address, 1).await, Ok(vec![!address]));
                    }
                })
            })
            .collect();
        for caller in callers {
            caller.await.unwrap();
        }
        assert_eq!(link.statistics().answers, u64::from(CALLERS * READS));
    };
    play(peer, client).await;
}

#[tokio::test]
async fn does_not_send_what_was_given_up_before_its_turn() {
    let (listener, endpoint) = listener().await;
    let (arrived, mut first_arrived) = mpsc::channel(1);
    let (go, may_go) = oneshot::channel::<()>();
    let peer = async move {
        let (mut stream, _) = listener.accept().await.unwrap();
        let first = request(&mut stream).await;
        arrived.send(()).await.unwrap();
        may_go.await.unwrap();
        stream.write_all(&register(&first, 1)).await.unwrap();
        let second = request(&mut stream).await;
        assert_eq!(second[7], 3, "the write was given up");
        stream.write_all(&register(&second, 2)).await.unwrap();
        hung_up(stream).await;
    };
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        let flying = tokio::spawn({
            let link = link.clone();
            async move { read(&link).await }
        });
        first_arrived.recv().await.unwrap();
        tokio::select! {
            biased;
            _ = write(&link) => panic!("nobody answers it"),
            () = std::future::ready(()) => {}
        }
        go.send(()).unwrap();
        assert_eq!(flying.await.unwrap(), Ok(vec![1]));
        assert_eq!(read(&link).await, Ok(vec![2]));
    };
    play(peer, client).await;
}

/// A peer that answers reads with the transaction id.
async fn count_reads(listener: TcpListener, reads: u16) {
    let (mut stream, _) = listener.accept().await.unwrap();
    for _ in 0..reads {
        let asked = request(&mut stream).await;
        let id = u16::from_be_bytes([asked[0], asked[1]]);
        stream.write_all(&register(&asked, id)).await.unwrap();
    }
    hung_up(stream).await;
}

#[tokio::test]
async fn lets_others_pass_a_caller_who_does_not_poll() {
    let (listener, endpoint) = listener().await;
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        assert_eq!(read(&link).await, Ok(vec![1]));
        let mut forgotten = pin!(read(&link));
        assert!(poll_once(forgotten.as_mut()).await.is_pending());
        assert_eq!(read(&link).await, Ok(vec![3]));
        assert_eq!(forgotten.await, Ok(vec![2]));
    };
    play(count_reads(listener, 3), client).await;
}

#[tokio::test]
async fn goes_on_when_a_caller_leaves_with_its_request_on_the_wire() {
    let (listener, endpoint) = listener().await;
    let client = async {
        let link = Link::open(endpoint, patient()).unwrap();
        assert_eq!(read(&link).await, Ok(vec![1]));
        {
            let left = pin!(read(&link));
            assert!(poll_once(left).await.is_pending());
        }
        assert_eq!(read(&link).await, Ok(vec![3]));
        assert_eq!((link.statistics().answers, link.statistics().late), (3, 0));
    };
    play(count_reads(listener, 3), client).await;
}

async fn poll_once<F: Future>(mut future: Pin<&mut F>) -> Poll<F::Output> {
    std::future::poll_fn(|cx| Poll::Ready(future.as_mut().poll(cx))).await
}

#[tokio::test]
async fn hangs_up_with_the_last_handle() {
    let (listener, endpoint) = listener().await;
    let link = Link::open(endpoint, patient()).unwrap();
    let (stream, _) = listener.accept().await.unwrap();
    let mut state = link.state();
    state.wait_for(|state| *state == WireState::Connected).await.unwrap();
    drop(link.clone());
    drop(link);
    hung_up(stream).await;
    assert!(state.changed().await.is_err(), "the task is gone");
}

/// The next number of a seeded row; xorshift.
fn next(seed: &mut u64) -> u64 {
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    *seed
}

/// A peer that answers reads with the complement of their address, but is late, cuts answers in pieces and connections
/// in the middle, until nobody connects any more.
async fn unruly(listener: TcpListener, mut seed: u64) {
    loop {
        let (mut stream, _) = listener.accept().await.unwrap();
        let mut asked = [0; 12];
        let mut before: Option<Vec<u8>> = None;
        while stream.read_exact(&mut asked).await.is_ok() {
            let address = u16::from_be_bytes([asked[8], asked[9]]);
            let answer = register(&asked, !address);
            let cut = match next(&mut seed) % 16 {
                0 => break,
                1 => {
                    stream.set_zero_linger().unwrap();
                    break;
                }
                2 => 5,
                3 => 0,
                _ => answer.len(),
            };
            let late = before.take().filter(|_| next(&mut seed).is_multiple_of(4)).unwrap_or_default();
            let sent = stream.write_all(&[&late, &answer[..cut]].concat()).await;
            tokio::task::yield_now().await;
            if sent.is_err() || cut == 5 && stream.write_all(&answer[cut..]).await.is_err() {
                break;
            }
            before = Some(answer);
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn keeps_answers_apart_whatever_the_peer_and_the_callers_do() {
    const CALLERS: u16 = 8;
    const READS: u16 = 80;
    let (listener, endpoint) = listener().await;
    let backoff = Backoff { first: Duration::from_millis(1), max: Duration::from_millis(5) };
    let options = Options { timeout: Duration::from_millis(20), retries: 3, backoff, ..quick() };
    let link = Link::open(endpoint, options).unwrap();
    let peer = tokio::spawn(unruly(listener, 0x2545_F491_4F6C_DD1D));
    let callers: Vec<_> = (0..CALLERS)
        .map(|caller| {
            let link = link.clone();
            tokio::spawn(async move {
                let mut answers = 0;
                for read in 0..READS {
                    let address = caller * 1000 + read;
                    if read % 7 == 0 {
                        // Asked, and left before the answer.
                        let _ = poll_once(pin!(link.read_registers(UNIT, 3, address, 1))).await;
                        continue;
                    }
                    loop {
                        match link.read_registers(UNIT, 3, address, 1).await {
                            Ok(registers) => {
                                assert_eq!(registers, [!address]);
                                answers += 1;
                            }
                            Err(LinkError::Timeout { .. }) => {}
                            Err(LinkError::Down { .. }) => {
                                // The state is told a little later than the error.
                                tokio::task::yield_now().await;
                                wait_until(&link, |state| *state == WireState::Connected).await;
                                continue;
                            }
                            Err(error) => panic!("{error}"),
                        }
                        break;
                    }
                }
                answers
            })
        })
        .collect();
    let mut answers = 0;
    for caller in callers {
        let all = tokio::time::timeout(Duration::from_secs(60), caller);
        answers += all.await.expect("somebody waits for ever").unwrap();
    }
    peer.abort();
    assert!(answers > 100, "only {answers} reads were answered");
    let seen = link.statistics();
    assert!(seen.late > 0 && seen.reconnects > 0 && seen.timeouts > 0, "{seen:?}");
}
