//! Replays the corpus of every fuzz target, so that what fuzzing found stays found without its tool.

use std::fs;
use std::path::PathBuf;

#[path = "../../../fuzz/src/frames.rs"]
mod fuzz;

type Target = (&'static str, fn(&[u8]));

const TARGETS: [Target; 5] = [
    ("pdu", fuzz::pdu),
    ("rtu_stream", fuzz::rtu_stream),
    ("tcp_stream", fuzz::tcp_stream),
    ("client", fuzz::client),
    ("listener", fuzz::listener),
];

/// Replayed by the tests of `busbar-profile`.
const ELSEWHERE: [&str; 2] = ["profile_text", "register_image"];

#[test]
fn every_file_of_every_target() {
    let corpus = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let mut folders: Vec<_> =
        fs::read_dir(&corpus).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    let mut names: Vec<_> = TARGETS.iter().map(|(name, _)| *name).chain(ELSEWHERE).collect();
    folders.sort();
    names.sort_unstable();
    assert_eq!(folders, names, "a folder of the corpus for each target");

    for (name, target) in TARGETS {
        let mut files = 0;
        for entry in fs::read_dir(corpus.join(name)).unwrap() {
            let path = entry.unwrap().path();
            println!("{}", path.display());
            target(&fs::read(path).unwrap());
            files += 1;
        }
        assert!(files >= 3, "{name} has {files} files");
    }
}
