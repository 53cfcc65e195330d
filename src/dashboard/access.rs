//! Who may ask for what. Pure.
//!
//! A page of a stranger that runs in the browser of somebody who may reach the dashboard can send requests here. Two checks keep it out,
//! also at loopback: the Host must be a name of this computer (a name of the stranger's that suddenly means this address is not), and a
//! request that says where it comes from must come from here.

use std::net::IpAddr;

/// The names by which the dashboard may be asked for.
#[derive(Debug, Clone)]
pub(super) struct Hosts {
    /// Whether it listens at loopback alone.
    is_local: bool,
    /// Further names, in lower case.
    names: Vec<String>,
}

/// What a request says about where it comes from.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Source<'a> {
    /// Its `Host`.
    pub(super) host: Option<&'a str>,
    /// Its `Origin`.
    pub(super) origin: Option<&'a str>,
    /// Its `Sec-Fetch-Site`.
    pub(super) site: Option<&'a str>,
    /// Whether somebody follows a link: then another page is shown, which the one with the link cannot read.
    pub(super) is_navigation: bool,
}

impl Hosts {
    /// For an address; `names` are those that were given, and that of this computer.
    pub(super) fn new(address: IpAddr, names: impl IntoIterator<Item = String>) -> Self {
        Self {
            is_local: address.is_loopback(),
            names: names.into_iter().map(|name| name.to_ascii_lowercase()).collect(),
        }
    }

    /// Why a request is refused, if it is.
    pub(super) fn refusal(&self, source: Source<'_>) -> Option<String> {
        let Some(host) = source.host else {
            return Some("the request has no Host".to_owned());
        };
        if !self.is_own(host_name(host)) {
            return Some(format!(
                "the dashboard is not called {:?}: use its address, or start it with --host and that name",
                shortened(host_name(host))
            ));
        }
        if let Some(origin) = source.origin {
            // Whatever is before it: a proxy may speak TLS for the dashboard.
            let from = origin.split_once("://").map(|(_, from)| from);
            if !from.is_some_and(|from| from.eq_ignore_ascii_case(host)) {
                return Some(format!("pages of {:?} may not use the dashboard", shortened(origin)));
            }
        }
        let is_foreign = source.site.is_some_and(|site| !matches!(site, "same-origin" | "none"));
        (is_foreign && !source.is_navigation).then(|| "pages of other sites may not use the dashboard".to_owned())
    }

    fn is_own(&self, name: &str) -> bool {
        let name = name.to_ascii_lowercase();
        let address: Option<IpAddr> = name.trim_matches(['[', ']']).parse().ok();
        match address {
            // A number means what it says: no stranger's name server answers for it.
            Some(address) => address.is_loopback() || !self.is_local,
            None => name == "localhost" || self.names.contains(&name),
        }
    }
}

/// A host without its port.
fn host_name(host: &str) -> &str {
    match host.rfind(':') {
        Some(colon) if !host[colon..].contains(']') => &host[..colon],
        _ => host,
    }
}

/// The beginning of what a stranger sent.
fn shortened(text: &str) -> String {
    text.chars().take(64).collect()
}

/// The token of an `Authorization`.
pub(super) fn bearer(authorization: &str) -> Option<&str> {
    let (scheme, token) = authorization.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| token.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_names_and_origins_are_refused() {
        let local = Hosts::new([127, 0, 0, 1].into(), ["Robot.local".to_owned()]);
        let open = Hosts::new([0, 0, 0, 0].into(), ["robot.local".to_owned()]);
        for (host, is_local, is_open) in [
            ("localhost:8470", true, true),
            ("LOCALHOST", true, true),
            ("127.0.0.1:8470", true, true),
            // By `ssh -L`.
            ("127.0.0.1:9000", true, true),
            ("[::1]:8470", true, true),
            ("[::1]", true, true),
            ("robot.LOCAL:8470", true, true),
            ("192.168.1.5:8470", false, true),
            ("[fe80::1]:8470", false, true),
            ("evil.example:8470", false, false),
            ("localhost.evil.example", false, false),
            ("127.0.0.1.evil.example", false, false),
            ("evil.example:80@127.0.0.1", false, false),
            ("", false, false),
            (":8470", false, false),
        ] {
            let source = Source {
                host: Some(host),
                ..Source::default()
            };
            assert_eq!(local.refusal(source).is_none(), is_local, "{host:?} at loopback");
            assert_eq!(open.refusal(source).is_none(), is_open, "{host:?} beyond");
        }
        assert!(local.refusal(Source::default()).is_some(), "without a Host");
        for (origin, site, is_navigation, is_allowed) in [
            (None, None, false, true),
            (Some("http://localhost:8470"), Some("same-origin"), false, true),
            (Some("https://localhost:8470"), None, false, true),
            (None, Some("none"), true, true),
            (Some("http://localhost:3000"), None, false, false),
            (Some("http://evil.example"), None, false, false),
            (Some("null"), None, false, false),
            (Some(""), None, false, false),
            (None, Some("cross-site"), false, false),
            (None, Some("same-site"), false, false),
            // A link to the dashboard on somebody's page.
            (None, Some("cross-site"), true, true),
        ] {
            let source = Source {
                host: Some("localhost:8470"),
                origin,
                site,
                is_navigation,
            };
            assert_eq!(local.refusal(source).is_none(), is_allowed, "{source:?}");
        }
    }

    #[test]
    fn a_token_comes_as_bearer() {
        for (header, token) in [
            ("Bearer abc", Some("abc")),
            ("bearer  abc ", Some("abc")),
            ("Basic abc", None),
            ("abc", None),
            ("", None),
        ] {
            assert_eq!(bearer(header), token, "{header:?}");
        }
    }
}
