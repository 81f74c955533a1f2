//! What is read on demand is read while a stream names its group, and never otherwise.

use serde_json::json;

use crate::support::{Bench, until};

/// The registers of the picture, and of the trace.
const LCD: std::ops::Range<u16> = 10_648..11_160;
const SCOPE: std::ops::Range<u16> = 10_404..10_504;

impl Bench {
    fn demanded(&self, of: std::ops::Range<u16>) -> usize {
        self.device.change(|device| device.reads.iter().filter(|read| of.contains(&read.0)).count())
    }

    async fn rounds(&self, count: usize) {
        let fast =
            async || self.device.change(|device| device.reads.iter().filter(|read| read.0 == 10_240).count());
        let now = fast().await;
        until(fast, |later| *later > now + count).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picture_is_read_while_a_stream_names_its_group() {
    let bench = Bench::with(|device| device.registers.extend(LCD.map(|address| (address, 0xA5A5)))).await;
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    // Neither a stream of everything nor one of another group makes it read.
    let _all = bench.client.events("").await;
    let _other = bench.client.events("?group=genset").await;
    bench.rounds(5).await;
    assert_eq!((bench.demanded(LCD), bench.demanded(SCOPE)), (0, 0));

    let mut stream = bench.client.events("?device=gen1&group=display").await;
    let event = stream.until(|event| event.name == "values" && event.data["rate"] == "on_demand").await;
    let picture = &event.data["changed"][0];
    assert_eq!((&picture["id"], &picture["quality"]), (&json!("lcd"), &json!("good")));
    let raw = picture["raw"].as_array().unwrap();
    assert!(raw.len() == 512 && raw.iter().all(|register| *register == json!(0xA5A5)));
    // Again and again, for there is always a next picture; but what can only be written is never read.
    let pictures = bench.demanded(LCD);
    until(async || bench.demanded(LCD), |reads| *reads > pictures + 64).await;
    assert_eq!(bench.demanded(SCOPE), 0);
    assert!(bench.device.change(|device| device.reads.iter().all(|read| read.0 > 10_000)));

    // Nobody looks any more.
    drop(stream);
    let quiet = async || {
        let before = bench.demanded(LCD);
        bench.rounds(5).await;
        bench.demanded(LCD) - before
    };
    until(quiet, |reads| *reads == 0).await;
    bench.until_value("lcd", |value| value["quality"] == "stale" && value["raw"][0] == 0xA5A5).await;
}
