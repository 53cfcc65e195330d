//! The address at which the dashboard listens.

use super::Token;
use crate::failure::Failure;
use nix::sys::socket::{setsockopt, sockopt::SndBuf};
use std::io;
use std::net::{SocketAddr, TcpListener};

/// What the kernel keeps for one reader, bytes: a second of frames. What waits longer is old when it arrives.
const SEND_BUFFER: usize = 64 << 10;

/// Binds the address. Beyond loopback only with a token that somebody has chosen: one that is made here would be read by who starts it alone,
/// and with the name of the computer in it.
///
/// # Errors
/// [`Failure::Unusable`] for an address that is none, is taken or is not this computer's, and for one beyond loopback without a token.
pub(crate) fn listen(address: &str, token: Option<&Token>) -> Result<TcpListener, Failure> {
    let address = parse(address)?;
    if !address.ip().is_loopback() && token.is_none() {
        return Err(Failure::unusable(format!(
            "{address} can be reached from other computers: give a token with --token-file or {}, or listen at 127.0.0.1 and come by \
             `ssh -L`",
            super::token::VARIABLE
        )));
    }
    let listener = TcpListener::bind(address).map_err(|error| Failure::unusable(refusal(address, &error)))?;
    // Connections inherit it.
    setsockopt(&listener, SndBuf, &SEND_BUFFER).map_err(Failure::failed)?;
    listener.set_nonblocking(true).map_err(Failure::failed)?;
    Ok(listener)
}

/// An address and a port; `localhost` is 127.0.0.1.
fn parse(text: &str) -> Result<SocketAddr, Failure> {
    let numeric = match text.strip_prefix("localhost:") {
        Some(port) => format!("127.0.0.1:{port}"),
        None => text.to_owned(),
    };
    numeric.parse().map_err(|_| {
        Failure::unusable(format!(
            "--listen {text:?} is no address with a port: give for example 127.0.0.1:8470, [::1]:8470, or 0.0.0.0:8470 for all networks"
        ))
    })
}

fn refusal(address: SocketAddr, error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::AddrInUse => {
            format!(
                "{address} is in use, by another dashboard perhaps: give another port with --listen, or 0 for any that is free"
            )
        }
        io::ErrorKind::AddrNotAvailable => {
            format!("{address} is no address of this computer: `ip address` shows those that are")
        }
        io::ErrorKind::PermissionDenied => {
            format!("{address}: ports below 1024 need a privilege: give a higher one with --listen")
        }
        _ => format!("{address}: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_that_cannot_be_used_are_refused_in_words() {
        let token = Token::random().expect("random numbers");
        for (address, has_token, part) in [
            ("", false, "is no address with a port"),
            ("8470", false, "is no address with a port"),
            ("127.0.0.1", false, "is no address with a port"),
            ("127.0.0.1:99999", false, "is no address with a port"),
            ("localhost:", false, "is no address with a port"),
            ("0.0.0.0:0", false, "give a token"),
            ("[::]:0", false, "give a token"),
            // Documentation, RFC 5737.
            ("192.0.2.1:8470", true, "is no address of this computer"),
        ] {
            let refusal = listen(address, has_token.then_some(&token)).expect_err(address);
            assert!(matches!(refusal, Failure::Unusable(_)), "{address}");
            assert!(refusal.to_string().contains(part), "{address}: {refusal}");
        }
        let first = listen("localhost:0", None).expect("a free port");
        let taken = first.local_addr().expect("is bound").to_string();
        let refusal = listen(&taken, None).expect_err("is taken").to_string();
        assert!(refusal.contains("is in use"), "{refusal}");
        assert!(listen("0.0.0.0:0", Some(&token)).is_ok());
    }
}
