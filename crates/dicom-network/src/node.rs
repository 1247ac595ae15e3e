//! Whom we talk to.

use std::fmt;
use std::str::FromStr;

/// An application entity title (PS3.5 6.2, VR AE): 1 to 16 characters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Title(String);

impl Title {
    /// The title, without padding.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Title {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for Title {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let title = text.trim_matches(' ');
        let allowed = |c: char| (' '..='~').contains(&c) && c != '\\';
        if title.is_empty() || title.len() > 16 || !title.chars().all(allowed) {
            return Err("an AE title has 1 to 16 characters of ASCII, no backslash".into());
        }
        Ok(Self(title.to_owned()))
    }
}

/// An application entity on the network: `AET@HOST:PORT`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Node {
    /// Its title.
    pub title: Title,
    /// Name or address of its machine.
    pub host: String,
    /// TCP port.
    pub port: u16,
}

impl fmt::Display for Node {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.host.contains(':') {
            write!(f, "{}@[{}]:{}", self.title, self.host, self.port)
        } else {
            write!(f, "{}@{}:{}", self.title, self.host, self.port)
        }
    }
}

impl FromStr for Node {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected AET@HOST:PORT, such as ARCHIVE@192.0.2.7:104".to_owned();
        let (title, address) = text.rsplit_once('@').ok_or_else(wrong)?;
        let (host, port) = address.rsplit_once(':').ok_or_else(wrong)?;
        let bare = host.strip_prefix('[').and_then(|h| h.strip_suffix(']'));
        let host = bare.unwrap_or(host);
        if host.is_empty() || (bare.is_none() && host.contains(':')) {
            return Err(wrong());
        }
        let port = port.parse().ok().filter(|port| *port > 0).ok_or_else(wrong)?;
        Ok(Self { title: title.parse()?, host: host.to_owned(), port })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_read_and_written() {
        for text in ["PACS@10.0.0.1:104", "A B@archive.example:11112", "X@[::1]:4242"] {
            assert_eq!(text.parse::<Node>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn half_a_node_is_refused() {
        for text in
            ["PACS", "PACS@host", "PACS@host:0", "PACS@host:x", "@host:1", "P@:1", "P@::1:1"]
        {
            assert!(text.parse::<Node>().is_err(), "{text}");
        }
        assert!("SEVENTEEN_LETTERS".parse::<Title>().is_err());
        assert!("A\\B".parse::<Title>().is_err());
    }
}
