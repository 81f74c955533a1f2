//! The JSON Schema of the profile format, by which an editor completes and checks a file.

use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use schemars::{Schema, SchemaGenerator};
use serde_json::Value;

use crate::file::ProfileFile;

/// The schema of a profile file, JSON Schema draft 2020-12; committed as `profiles/profile.schema.json`.
pub fn json_schema() -> Value {
    let settings = SchemaSettings::draft2020_12().with_transform(RecursiveTransform(WithoutNull));
    SchemaGenerator::new(settings).into_root_schema_for::<ProfileFile>().to_value()
}

/// Takes out `null`, which an optional key gets and TOML does not have.
#[derive(Clone, Debug)]
struct WithoutNull;

impl Transform for WithoutNull {
    fn transform(&mut self, schema: &mut Schema) {
        let Some(object) = schema.as_object_mut() else {
            return;
        };
        if let Some(Value::Array(types)) = object.get_mut("type") {
            types.retain(|kind| kind != "null");
            if let [kind] = types.as_slice() {
                let kind = kind.clone();
                object.insert("type".to_owned(), kind);
            }
        }
        let Some(Value::Array(ways)) = object.get_mut("anyOf") else {
            return;
        };
        ways.retain(|way| way.get("type").is_none_or(|kind| kind != "null"));
        if let [Value::Object(way)] = ways.as_slice() {
            let way = way.clone();
            object.remove("anyOf");
            object.extend(way);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `UPDATE=1 cargo test -p busbar-profile schema` writes the file anew.
    #[test]
    fn the_committed_schema_is_current() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../profiles/profile.schema.json");
        let current = serde_json::to_string_pretty(&json_schema()).unwrap() + "\n";
        if std::env::var_os("UPDATE").is_some() {
            std::fs::write(path, &current).unwrap();
        }
        let committed = std::fs::read_to_string(path).unwrap_or_default();
        assert!(committed == current, "profiles/profile.schema.json has drifted; run again with UPDATE=1");
    }

    #[test]
    fn the_schema_refuses_unknown_keys_and_knows_the_bounds() {
        let schema = json_schema();
        assert_eq!(schema["additionalProperties"], false);
        let point = &schema["$defs"]["PointFile"];
        assert_eq!(point["additionalProperties"], false);
        assert_eq!(point["properties"]["at"]["maximum"], 65535);
        let required = point["required"].as_array().unwrap();
        assert!(!schema.to_string().contains("null"));
        for key in ["at", "id", "name", "type"] {
            assert!(required.iter().any(|required| required == key), "{key}");
        }
    }
}
