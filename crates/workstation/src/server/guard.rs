//! Who may ask: nothing else decides.
//!
//! The address is loopback, which all users of a machine share, and pages of other programs on it
//! can post to any port of it and open sockets there. So a request must name loopback as its host
//! (a name that leads elsewhere and was bound to loopback later fails here), come from this page
//! (`Origin`, `Sec-Fetch-Site`: another port fails here), and, below `/api`, bear the token.

/// What a request says of where it comes from.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RequestOrigin<'a> {
    pub(crate) path: &'a str,
    /// Of `Host`, `Origin`, `Sec-Fetch-Site`, `Authorization`, as they are sent.
    pub(crate) host: Option<&'a str>,
    pub(crate) origin: Option<&'a str>,
    pub(crate) site: Option<&'a str>,
    pub(crate) authorization: Option<&'a str>,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// Its host is not loopback, or there is none.
    Host,
    /// It comes from another page, or a socket does not say from which.
    Origin,
    /// It bears no token, or another one.
    Token,
}

/// Below this the state and the data are.
const API: &str = "/api/";
/// The socket, whose token is its first message: a browser sends no header of the page's choice
/// with it.
const LINK: &str = "/api/link";

/// Whether a request may pass.
///
/// # Errors
/// Why not.
pub(crate) fn admit(asked: &RequestOrigin<'_>, token: &str) -> Result<(), Refusal> {
    let host = asked.host.filter(|host| is_loopback(host)).ok_or(Refusal::Host)?;
    let own = asked.origin.map(|origin| origin.strip_prefix("http://") == Some(host));
    match own {
        Some(false) => return Err(Refusal::Origin),
        None if asked.path == LINK => return Err(Refusal::Origin),
        _ => {}
    }
    if asked.path.starts_with(API) && asked.site.is_some_and(|site| site != "same-origin") {
        return Err(Refusal::Origin);
    }
    if !needs_key(asked.path) {
        return Ok(());
    }
    let given = asked.authorization.and_then(|text| text.strip_prefix("Bearer "));
    match given.is_some_and(|given| is_same(given, token)) {
        true => Ok(()),
        false => Err(Refusal::Token),
    }
}

/// Whether a request there bears the key in its header.
pub(crate) fn needs_key(path: &str) -> bool {
    path.starts_with(API) && path != LINK
}

/// Whether a token is this one; how long that takes tells nothing of where they differ.
pub(crate) fn is_same(given: &str, token: &str) -> bool {
    let differ = given.bytes().zip(token.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
    given.len() == token.len() && differ == 0
}

/// Whether a host is this machine by a name that no resolver decides; any port, for a tunnel has
/// its own.
fn is_loopback(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.parse::<u16>().is_ok() => name,
        _ => host,
    };
    ["127.0.0.1", "localhost", "[::1]"].contains(&name)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOKEN: &str = "0123456789abcdef";

    fn page() -> RequestOrigin<'static> {
        RequestOrigin { path: "/", host: Some("127.0.0.1:4711"), ..RequestOrigin::default() }
    }

    fn api() -> RequestOrigin<'static> {
        let authorization = Some("Bearer 0123456789abcdef");
        RequestOrigin {
            path: "/api/state",
            authorization,
            site: Some("same-origin"),
            origin: Some("http://127.0.0.1:4711"),
            ..page()
        }
    }

    #[test]
    fn the_page_and_its_own_requests_pass() {
        let tunnel = RequestOrigin {
            host: Some("localhost:9000"),
            origin: Some("http://localhost:9000"),
            ..api()
        };
        let old_browser = RequestOrigin { site: None, origin: None, ..api() };
        let redirected = RequestOrigin { site: Some("cross-site"), ..page() };
        let six = RequestOrigin { host: Some("[::1]:80"), ..page() };
        let socket = RequestOrigin { path: LINK, authorization: None, site: None, ..api() };
        for asked in [page(), api(), tunnel, old_browser, redirected, six, socket] {
            assert_eq!(admit(&asked, TOKEN), Ok(()), "{asked:?}");
        }
    }

    #[test]
    fn the_table_of_refused_requests() {
        let table = [
            (RequestOrigin { host: None, ..api() }, Refusal::Host),
            (
                RequestOrigin { host: Some("evil.example:4711"), origin: None, ..api() },
                Refusal::Host,
            ),
            // A name that was bound anew: host and origin agree.
            (
                RequestOrigin {
                    host: Some("evil.example"),
                    origin: Some("http://evil.example"),
                    ..api()
                },
                Refusal::Host,
            ),
            (RequestOrigin { host: Some("127.0.0.1.evil.example"), ..page() }, Refusal::Host),
            (RequestOrigin { host: Some("192.168.0.7:4711"), ..page() }, Refusal::Host),
            // Another program on the machine.
            (RequestOrigin { origin: Some("http://127.0.0.1:5000"), ..api() }, Refusal::Origin),
            (RequestOrigin { origin: Some("http://localhost:4711"), ..api() }, Refusal::Origin),
            (RequestOrigin { origin: Some("https://127.0.0.1:4711"), ..api() }, Refusal::Origin),
            (RequestOrigin { origin: Some("null"), ..page() }, Refusal::Origin),
            (RequestOrigin { site: Some("same-site"), ..api() }, Refusal::Origin),
            (RequestOrigin { site: Some("none"), ..api() }, Refusal::Origin),
            (RequestOrigin { path: LINK, origin: None, ..api() }, Refusal::Origin),
            (
                RequestOrigin { path: LINK, origin: Some("http://127.0.0.1:5000"), ..api() },
                Refusal::Origin,
            ),
            (RequestOrigin { authorization: None, ..api() }, Refusal::Token),
            (RequestOrigin { authorization: Some("Bearer "), ..api() }, Refusal::Token),
            (RequestOrigin { authorization: Some("0123456789abcdef"), ..api() }, Refusal::Token),
            (
                RequestOrigin { authorization: Some("Bearer 0123456789abcdeg"), ..api() },
                Refusal::Token,
            ),
            (
                RequestOrigin { authorization: Some("Bearer 0123456789abcdef0"), ..api() },
                Refusal::Token,
            ),
        ];
        for (asked, why) in table {
            assert_eq!(admit(&asked, TOKEN), Err(why), "{asked:?}");
        }
    }
}
