//! Who may ask: the right host, no other site, the token; and what every answer forbids the
//! browser.

use axum::http::{HeaderMap, HeaderValue, StatusCode, header};

/// The header that carries the token. A page of another site cannot send it without being allowed
/// to, and nobody is.
pub(super) const TOKEN_HEADER: &str = "x-jointwatch-token";

/// Nothing but this server's own files runs, styles, or is talked to.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What is asked of every request.
#[derive(Clone, Debug)]
pub(super) struct Guard {
    /// The port that this server listens on.
    pub(super) port: u16,
    /// The token that was printed at the start.
    pub(super) token: String,
}

/// Why a request is refused.
pub(super) type Refused = (StatusCode, &'static str);

impl Guard {
    /// Checks host and origin, and the token of everything below `/api/`.
    pub(super) fn check(&self, path: &str, headers: &HeaderMap) -> Result<(), Refused> {
        let text = |name: &str| headers.get(name).map(|v| v.to_str().unwrap_or("?"));
        let names = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        let one_host = headers.get_all(header::HOST).iter().count() == 1;
        if !one_host || !names.iter().any(|n| text("host") == Some(n)) {
            return Err((
                StatusCode::MISDIRECTED_REQUEST,
                "this server is asked for under another name",
            ));
        }
        let ours = |origin: &str| names.iter().any(|n| origin == format!("http://{n}"));
        let foreign_site =
            text("sec-fetch-site").is_some_and(|s| s != "same-origin" && s != "none");
        if text("origin").is_some_and(|o| !ours(o)) || foreign_site {
            return Err((StatusCode::FORBIDDEN, "the request comes from another site"));
        }
        let given = headers.get(TOKEN_HEADER).map(HeaderValue::as_bytes);
        if path.starts_with("/api/") && !given.is_some_and(|g| same(g, self.token.as_bytes())) {
            return Err((
                StatusCode::UNAUTHORIZED,
                "the token is missing or wrong; open the page by the address that jointwatch lab printed",
            ));
        }
        Ok(())
    }
}

/// Whether two texts are equal, in a time that does not say where they differ.
fn same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |d, (x, y)| d | (x ^ y)) == 0
}

/// Puts what the browser is to forbid on an answer.
pub(super) fn seal(headers: &mut HeaderMap) {
    for (name, value) in [
        ("content-security-policy", POLICY),
        ("x-content-type-options", "nosniff"),
        ("x-frame-options", "DENY"),
        ("referrer-policy", "no-referrer"),
        ("cross-origin-resource-policy", "same-origin"),
        ("cross-origin-opener-policy", "same-origin"),
        ("cache-control", "no-store"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(guard: &Guard, path: &str, headers: &[(&'static str, &str)]) -> u16 {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(*name, HeaderValue::from_str(value).unwrap());
        }
        guard
            .check(path, &map)
            .map_or_else(|(code, _)| code.as_u16(), |()| 200)
    }

    #[test]
    fn host_origin_and_token_have_to_be_right() {
        let guard = Guard {
            port: 4000,
            token: "secret".into(),
        };
        let host = ("host", "127.0.0.1:4000");
        let token = (TOKEN_HEADER, "secret");
        let api = |headers: &[(&'static str, &str)]| asked(&guard, "/api/state/0", headers);
        assert_eq!(api(&[host, token]), 200);
        assert_eq!(
            api(&[
                ("host", "localhost:4000"),
                token,
                ("origin", "http://localhost:4000")
            ]),
            200
        );
        assert_eq!(asked(&guard, "/", &[host]), 200);
        for name in [
            "evil.example:4000",
            "127.0.0.1:4001",
            "127.0.0.1",
            "127.0.0.1:4000.evil.example",
            "",
        ] {
            assert_eq!(api(&[("host", name), token]), 421, "{name}");
        }
        assert_eq!(api(&[token]), 421);
        assert_eq!(api(&[host, host, token]), 421);
        for origin in [
            "http://evil.example",
            "null",
            "https://127.0.0.1:4000",
            "http://127.0.0.1:4001",
        ] {
            assert_eq!(api(&[host, token, ("origin", origin)]), 403, "{origin}");
        }
        for site in ["cross-site", "same-site"] {
            assert_eq!(asked(&guard, "/", &[host, ("sec-fetch-site", site)]), 403);
        }
        for wrong in ["", "secre", "secrets", "Secret"] {
            assert_eq!(api(&[host, (TOKEN_HEADER, wrong)]), 401, "{wrong}");
        }
        assert_eq!(api(&[host]), 401);
    }
}
