//! What Zenoh and TLS say when nothing comes about, in words that help.

/// Why nothing is heard of a robot, from what was `said` of the newest attempt to connect.
pub(crate) fn of_silence(robot: &str, address: &str, own: &str, said: &str) -> String {
    let has = |part: &str| said.to_lowercase().contains(part);
    if has("received fatal alert") {
        format!(
            "{address} answers, and refuses the certificate of this computer ({said}): it must be signed by the authority that is on the \
             robot, and be valid by the robot's clock"
        )
    } else if has("not valid for name") || has("notvalidforname") {
        format!(
            "{address} answers, and its certificate does not name this address ({said}): make it anew with the address among its names \
             (make-keys), or connect to one of those"
        )
    } else if has("expired") || has("not valid yet") || has("notvalidyet") {
        format!(
            "{address} answers, and its certificate is not valid now ({said}): make it anew, and compare the clocks of both computers"
        )
    } else if has("badsignature") || has("unknownissuer") {
        format!(
            "{address} answers, and its certificate is of another authority than this computer's ({said}): both need the ca.pem by which \
             {robot}'s was signed"
        )
    } else if has("invalid peer certificate") {
        format!("{address} answers, and its certificate cannot be used ({said}): make it anew (make-keys)")
    } else if has("keymismatch") {
        format!(
            "the certificate and the key of this computer do not belong together ({said}): name both of {own} in fleet.toml"
        )
    } else if has("cannot create a new tls") {
        format!(
            "what this computer proves itself by cannot be used ({said}): look at certificate, key and authority in fleet.toml"
        )
    } else if has("connection refused") {
        format!(
            "at {address} is a computer, and nobody listens ({said}): `wormd bridge` does not run there, or at another port"
        )
    } else if has("lookup") || has("resolve") {
        format!("the name in {address} is not known here ({said}): give the robot's address, or look at the network")
    } else if has("reset") || has("eof") || has("broken pipe") {
        format!("{address} ends each connection ({said}): another program listens there, or an older wormd")
    } else {
        format!(
            "{address} does not answer ({said}): the robot is switched off or not in this network, or the address is wrong; or its bridge \
             hangs"
        )
    }
}

/// Why nothing is heard though no attempt to connect has failed.
pub(crate) fn of_silent_link(robot: &str, address: &str, own: &str, was_heard: bool) -> String {
    if was_heard {
        return format!(
            "the link to {address} is silent: the robot was switched off, its network is gone, or its bridge hangs"
        );
    }
    format!(
        "{address} takes the connection, and nothing is heard: the certificate there is not {robot}'s (compare its name with that in \
         fleet.toml), or {own} does not stand under [access] in its bridge.toml"
    )
}

/// Why a laptop's connection was refused.
pub(crate) fn of_refusal(said: &str) -> String {
    let has = |part: &str| said.to_lowercase().contains(part);
    let why = if has("received fatal alert") {
        "the other end does not take this robot's certificate: its authority is another one, the address is none of those in the \
         certificate, or its clock is wrong"
    } else if has("badsignature") || has("unknownissuer") {
        "its certificate is of another authority than this robot's"
    } else if has("expired") || has("not valid yet") || has("notvalidyet") {
        "its certificate is not valid by this robot's clock"
    } else if has("nocertificates") || has("no certificates") {
        "it has no certificate"
    } else {
        "it does not speak as a laptop does"
    };
    format!("a connection was refused: {why} ({said})")
}

/// Why the bridge cannot listen.
pub(crate) fn of_listening(addresses: &str, said: &str) -> String {
    let has = |part: &str| said.to_lowercase().contains(part);
    let remedy = if has("in use") {
        "another bridge may run there: give another address"
    } else if has("permission denied") {
        "ports below 1024 are root's: give another one"
    } else if has("lookup") {
        "give an address of this computer, or 0.0.0.0 for all of them"
    } else if has("keymismatch") {
        "certificate and key do not belong together: name both of this robot"
    } else if has("certificate") || has("key") {
        "look at certificate, key and authority: make-keys makes them"
    } else {
        "give another address"
    };
    format!("listening at {addresses}: {said}: {remedy}")
}

/// Why a worm that a bridge serves does not get another one.
pub(crate) fn of_second_bridge(worm: &str, pid: u32, listen: Option<&str>) -> String {
    let at = listen.map_or_else(String::new, |listen| format!(", listening at {listen}"));
    format!(
        "another `wormd bridge` (process {pid}{at}) serves {worm} already, and a worm has one bridge for all laptops: name all addresses, \
         certificates and worms in one bridge.toml, or end that bridge first (kill {pid})"
    )
}

/// Whether the address is none of this computer's, which it may become when its network is up.
pub(crate) fn is_address_missing(said: &str) -> bool {
    said.contains("(os error 99)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_said_decides_what_to_look_at() {
        // As Zenoh 1.10 and rustls 0.23 say it.
        for (said, part) in [
            (
                "received fatal alert: DecryptError",
                "refuses the certificate of this computer",
            ),
            (
                "Can not create a new TLS link bound to IpAddress(…): invalid peer certificate: BadSignature",
                "another authority",
            ),
            ("invalid peer certificate: UnknownIssuer", "another authority"),
            (
                "invalid peer certificate: certificate not valid for name \"127.0.0.1\"; certificate is only valid for …",
                "does not name",
            ),
            (
                "invalid peer certificate: certificate expired: verification time 2 (UNIX)",
                "clocks",
            ),
            (
                "Bad certificate/key: keys may not be consistent: KeyMismatch",
                "do not belong together",
            ),
            (
                "Cannot create a new TLS listener to tls/…: Invalid TLS certificate file",
                "certificate, key and authority",
            ),
            ("[127.0.0.1:17106: Connection refused (os error 111)", "nobody listens"),
            (
                "failed to lookup address information: Name or service not known",
                "is not known here",
            ),
            ("deadline has elapsed", "switched off"),
        ] {
            let text = of_silence("robot1", "tls/127.0.0.1:7447", "anna", said);
            assert!(text.contains(part), "{text}");
        }
        let silent = |was_heard| of_silent_link("robot1", "tls/r:1", "anna", was_heard);
        assert!(silent(false).contains("[access]") && silent(true).contains("switched off"));
        for (said, part) in [
            ("a: Address already in use (os error 98)", "another bridge"),
            ("keys may not be consistent: KeyMismatch", "do not belong together"),
            ("a: Permission denied (os error 13)", "1024"),
        ] {
            assert!(of_listening("tls/a:1", said).contains(part), "{said}");
        }
        assert!(is_address_missing(
            "10.9.9.9:17101: Cannot assign requested address (os error 99)"
        ));
        assert!(of_refusal("invalid peer certificate: BadSignature").contains("another authority"));
    }
}
