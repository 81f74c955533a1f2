//! Replays the corpus of the fuzz targets of this crate, so that what fuzzing found stays found without its tool.

#![cfg(test)]

use std::fs;
use std::path::PathBuf;

#[path = "../../../fuzz/src/profiles.rs"]
mod fuzz;

type Target = (&'static str, fn(&[u8]));

const TARGETS: [Target; 2] = [("profile_text", fuzz::profile_text), ("register_image", fuzz::register_image)];

#[test]
fn every_file_of_every_target() {
    for (name, target) in TARGETS {
        let corpus = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus").join(name);
        let mut files = 0;
        for entry in fs::read_dir(corpus).unwrap() {
            let path = entry.unwrap().path();
            println!("{}", path.display());
            target(&fs::read(path).unwrap());
            files += 1;
        }
        assert!(files >= 3, "{name} has {files} files");
    }
}
