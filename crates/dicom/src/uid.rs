//! Unique identifiers from content: `2.25.` and a UUID in decimal (PS3.5 B.2).

use uuid::Uuid;

/// Implementation Class UID of this software (PS3.7 D.3.3.2).
pub(crate) const IMPLEMENTATION_CLASS: &str = "2.25.73876759777490297878304483147290077542";
/// Name space of every UID made here.
const NAME_SPACE: Uuid = Uuid::from_u128(0x1f71_a2c8_93de_4128_a584_5e49_5473_b2ec);

/// The UID of something (`role`) made from content with this hash: version-5 UUID (RFC 9562).
pub(crate) fn from_content(role: &str, hash: &[u8; 32]) -> String {
    let mut name = role.as_bytes().to_vec();
    name.push(0);
    name.extend_from_slice(hash);
    format!("2.25.{}", Uuid::new_v5(&NAME_SPACE, &name).as_u128())
}

/// Whether the text has the form of a UID: 64 characters at most, no leading zeros (PS3.5 9.1).
pub(crate) fn is_uid(text: &str) -> bool {
    let component = |c: &str| {
        !c.is_empty() && c.bytes().all(|b| b.is_ascii_digit()) && (c == "0" || !c.starts_with('0'))
    };
    text.len() <= 64 && text.contains('.') && text.split('.').all(component)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uids_are_well_formed_and_differ_by_role_and_content() {
        let a = from_content("series", &[1; 32]);
        assert!(is_uid(&a) && a.len() <= 44, "{a}");
        assert_eq!(a, from_content("series", &[1; 32]));
        assert_ne!(a, from_content("frame", &[1; 32]));
        assert_ne!(a, from_content("series", &[2; 32]));
        assert!(is_uid(IMPLEMENTATION_CLASS));
    }

    #[test]
    fn malformed_uids_are_seen() {
        for text in ["", "1", "1..2", "1.02", "1.2.", "1.a", "2.25.0123456"] {
            assert!(!is_uid(text), "{text}");
        }
        assert!(!is_uid(&format!("2.25.{}", "1".repeat(62))));
        assert!(is_uid("1.2.840.10008.1.2.0"));
    }
}
