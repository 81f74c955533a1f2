//! The bodies of the fuzz targets. The tests of the crates include these files to replay the corpus, so that what
//! fuzzing found stays found without its tool.

pub mod frames;
pub mod profiles;
