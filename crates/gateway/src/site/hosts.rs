//! `hosts` of `[server]`: the names under which a proxy on the same machine asks for the gateway.

use busbar_profile::Collector;
use busbar_profile::text::shown;

use super::reader::Table;

/// The names in lower case.
pub(super) fn read(server: &Table<'_, '_>, findings: &mut Collector<'_>) -> Vec<String> {
    let texts = server.texts("hosts", findings);
    let mut hosts: Vec<String> = Vec::new();
    for text in texts {
        if !is_host(&text.value) {
            findings.add(
                text.span,
                format!("`{}` is no host name", shown(&text.value)),
                "write a name as a browser's address line has it, without scheme, port and path, such as \
                 \"power.example.org\"",
            );
            continue;
        }
        hosts.push(text.value.to_ascii_lowercase());
    }
    hosts
}

/// A name of letters, digits and hyphens with dots between its parts, or an IP address.
fn is_host(text: &str) -> bool {
    let part = |part: &str| {
        (1..=63).contains(&part.len())
            && part.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_')
            && !part.starts_with('-')
            && !part.ends_with('-')
    };
    let literal = text.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    match literal {
        Some(address) => address.parse::<std::net::Ipv6Addr>().is_ok(),
        None => text.len() <= 253 && text.split('.').all(part),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::site::Site;

    fn parse(hosts: &str) -> Result<Vec<String>, String> {
        let text = format!("[site]\nname = \"S\"\n[server]\nhosts = {hosts}\n");
        match Site::parse("site.toml", &text) {
            Ok(site) => Ok(site.hosts),
            Err(findings) => Err(findings.iter().map(ToString::to_string).collect()),
        }
    }

    #[test]
    fn a_site_file_names_hosts_or_says_what_is_wrong_with_them() {
        assert_eq!(parse("[]"), Ok(Vec::new()));
        assert_eq!(parse("[\"Power.example.org\"]"), Ok(vec!["power.example.org".to_owned()]));
        for (hosts, expected) in [
            (
                "\"a\"",
                "site.toml:4:9: `hosts` has the wrong type (string); write a list of texts in quotes, in square brackets",
            ),
            ("[1]", "site.toml:4:10: `hosts` has the wrong type (integer); write each text in quotes"),
            (
                "[\"a\", \"https://b\"]",
                "site.toml:4:15: `https://b` is no host name; write a name as a browser's address line has it, without scheme, port and path, such as \"power.example.org\"",
            ),
        ] {
            assert_eq!(parse(hosts), Err(expected.to_owned()));
        }
    }

    #[test]
    fn hosts_are_names_and_nothing_else() {
        for host in
            ["power.example.org", "gateway", "10.0.0.7", "[2001:db8::1]", "Power.Example.ORG", "a_b.local"]
        {
            assert!(is_host(host), "{host}");
        }
        let long = ["a".repeat(64), "a.".repeat(127) + "aa"];
        for host in [
            "",
            "*",
            "*.example.org",
            "http://a",
            "a:80",
            "a/b",
            "a b",
            "-a",
            "a-.b",
            "a..b",
            "[::1",
            "ü",
            &long[0],
            &long[1],
        ] {
            assert!(!is_host(host), "{host}");
        }
    }
}
