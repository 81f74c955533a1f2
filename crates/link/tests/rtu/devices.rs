//! Devices that are missing, in use elsewhere, or pulled out and put back.

use std::os::unix::fs::symlink;

use busbar_link::{Cause, Link, LinkError, Serial, SerialError, SerialPort, WireState};

use crate::slave::*;

async fn down(link: &Link) -> Cause {
    match wait_until(link, |state| matches!(state, WireState::Down { .. })).await {
        WireState::Down { reason, .. } => reason.cause,
        state => panic!("{state:?}"),
    }
}

#[tokio::test]
async fn a_missing_device_says_what_to_check() {
    let folder = tempfile::tempdir().unwrap();
    let link = Link::open(endpoint(&folder.path().join("ttyUSB7")), options()).unwrap();
    assert_eq!(down(&link).await, Cause::Serial(SerialError::Missing));
    let sentence = read(&link).await.unwrap_err().to_string();
    assert!(sentence.contains("ttyUSB7?baud=9600") && sentence.contains("plugged in"), "{sentence}");
}

#[tokio::test]
async fn a_busy_device_is_ours_when_the_other_program_ends() {
    let line = Line::new();
    let other = SerialPort::open(line.path().to_str().unwrap(), &Serial::default()).unwrap();
    let link = Link::open(line.endpoint(), options()).unwrap();
    assert_eq!(down(&link).await, Cause::Serial(SerialError::Busy));
    let sentence = read(&link).await.unwrap_err().to_string();
    assert!(sentence.contains("another program has the device open"), "{sentence}");
    drop(other);
    wait_until(&link, |state| *state == WireState::Connected).await;
}

#[tokio::test]
async fn two_wires_do_not_share_a_device() {
    let line = Line::new();
    let first = Link::open(line.endpoint(), options()).unwrap();
    wait_until(&first, |state| *state == WireState::Connected).await;
    let second = Link::open(line.endpoint(), options()).unwrap();
    assert_eq!(down(&second).await, Cause::Serial(SerialError::Busy));
    assert_eq!(*first.state().borrow(), WireState::Connected);
}

#[tokio::test]
async fn a_device_that_was_pulled_out_is_used_again_when_it_is_back() {
    let folder = tempfile::tempdir().unwrap();
    let node = folder.path().join("ttyUSB0");
    let line = Line::new();
    symlink(line.path(), &node).unwrap();
    let answer = |value| {
        move |line: &mut Line| {
            let request = line.request();
            line.say(&register(&request, value));
        }
    };
    let slave = line.play(answer(7));
    let link = Link::open(endpoint(&node), options()).unwrap();
    assert_eq!(read(&link).await, Ok(vec![7]));

    // The node goes with the device.
    let line = slave.join().unwrap();
    std::fs::remove_file(&node).unwrap();
    drop(line);
    let gone = down(&link).await;
    assert!(matches!(gone, Cause::Vanished | Cause::Serial(SerialError::Missing)), "{gone}");
    let refused = read(&link).await.unwrap_err();
    assert!(matches!(refused, LinkError::Down { .. }), "{refused}");

    let line = Line::new();
    symlink(line.path(), &node).unwrap();
    wait_until(&link, |state| *state == WireState::Connected).await;
    let slave = line.play(answer(8));
    assert_eq!(read(&link).await, Ok(vec![8]));
    assert_eq!(link.statistics().reconnects, 1);
    drop(link);
    slave.join().unwrap();
}
