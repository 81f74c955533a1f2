//! The committed OpenAPI document of the control is the one the code generates.

use std::path::Path;

#[test]
fn committed_document_is_current() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("openapi.json");
    let mut generated = busbar_emulator::control::openapi().to_pretty_json().unwrap();
    generated.push('\n');
    if std::env::var_os("BUSBAR_UPDATE").is_some_and(|value| value == "1") {
        std::fs::write(&file, &generated).unwrap();
    }
    let committed = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(
        committed == generated,
        "crates/emulator/openapi.json is not what the code generates: run `BUSBAR_UPDATE=1 cargo test -p \
         busbar-emulator` and look at the difference"
    );
}
