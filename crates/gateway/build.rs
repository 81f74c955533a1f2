//! Puts the page (`web/dist`) into the library; a plain sentence in its place where it has not been built.

use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let crate_dir = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    let out_dir = PathBuf::from(env::var("OUT_DIR")?);
    let dist = crate_dir.join("../../web/dist");
    let plain = crate_dir.join("page");

    // A folder that is not there would count as changed each time, and this crate be built each time.
    if crate_dir.join("../../web").is_dir() {
        fs::create_dir_all(&dist).ok();
    }
    println!("cargo::rerun-if-changed={}", dist.display());
    println!("cargo::rerun-if-changed={}", plain.display());
    println!("cargo::rerun-if-changed=build.rs");

    let built = dist.join("index.html").is_file();
    let folder = if built { fs::canonicalize(&dist)? } else { plain };
    // The document is written anew for each reader.
    fs::copy(folder.join("index.html"), out_dir.join("index.html"))?;
    let assets = memory_serve::assets_to_code(&folder.to_string_lossy(), &folder, &out_dir, true, silent);
    fs::write(Path::new(&out_dir).join("memory_serve_assets.rs"), format!("&[(\"default\", {assets})]"))?;
    Ok(())
}

/// What memory-serve has to say about each file would be a warning of every build.
fn silent(_: &str) {}
