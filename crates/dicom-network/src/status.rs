//! What a peer's status means (PS3.7 Annex C; PS3.4 B.2.3, C.4).

/// Done.
pub(crate) const SUCCESS: u16 = 0x0000;
/// More answers come.
pub(crate) const PENDING: [u16; 2] = [0xFF00, 0xFF01];
/// The object is not one that was asked for.
pub(crate) const NOT_AUTHORISED: u16 = 0x0124;
/// The object cannot be kept.
pub(crate) const OUT_OF_RESOURCES: u16 = 0xA700;
/// The data set is not that of its SOP class or instance.
pub(crate) const DOES_NOT_MATCH: u16 = 0xA900;
/// The data set is not sound.
pub(crate) const CANNOT_UNDERSTAND: u16 = 0xC000;

/// An object of this SOP Instance UID is there already (PS3.7 9.1.1.1.9).
pub(crate) const DUPLICATE: u16 = 0x0111;

/// Whether the peer has kept the object, though not without change (PS3.4 B.2.3). The other
/// warnings of PS3.7 Annex C (0001H, 0107H, 0116H) are of services that store nothing: who answers
/// them to C-STORE does not say that it has kept it.
pub(crate) fn is_warning(status: u16) -> bool {
    status & 0xF000 == 0xB000
}

/// Whether a request to retrieve failed for objects of it rather than by itself (PS3.4 C.4.2.1.5,
/// C.4.3.1.4).
pub(crate) fn is_of_objects(status: u16) -> bool {
    status & 0xF000 == 0xC000 || status == TRANSFERS_FAILED
}

/// Out of resources, the transfers cannot be made.
const TRANSFERS_FAILED: u16 = 0xA702;

/// The move destination is unknown.
pub(crate) const DESTINATION_UNKNOWN: u16 = 0xA801;

/// Whether the peer may succeed later: it is out of resources.
pub(crate) fn is_transient(status: u16) -> bool {
    status & 0xFF00 == 0xA700 || status == 0x0213
}

/// The status in words, with its number.
pub(crate) fn words(status: u16) -> String {
    let meaning = match status {
        0x0000 => "success",
        0x0001 => "requested optional attributes are not supported",
        0x0105 => "no such attribute",
        0x0106 => "invalid attribute value",
        0x0107 => "attribute list error",
        0x0110 => "processing failure",
        0x0111 => "duplicate SOP instance",
        0x0112 => "no such SOP instance",
        0x0115 => "invalid argument value",
        0x0116 => "attribute value out of range",
        0x0117 => "invalid SOP instance",
        0x0118 => "no such SOP class",
        0x0122 => "SOP class not supported",
        0x0124 => "not authorised",
        0x0210 => "duplicate invocation",
        0x0211 => "unrecognised operation",
        0x0212 => "mistyped argument",
        0x0213 => "resource limitation",
        0xA701 => "out of resources, the matches cannot be counted",
        TRANSFERS_FAILED => "out of resources, the transfers cannot be made",
        DESTINATION_UNKNOWN => "the move destination is unknown there",
        0xA900..=0xA9FF => "the data set does not match its SOP class or the request",
        0xA700..=0xA7FF => "out of resources",
        0xB000 => "kept with changed data elements, or transfers ended with failures",
        0xB006 => "kept, elements were discarded",
        0xB007 => "kept, the data set does not match its SOP class",
        0xB001..=0xBFFF => "kept, with a warning",
        0xC000..=0xCFFF => "cannot be understood or processed",
        0xFE00 => "cancelled",
        0xFF00 | 0xFF01 => "pending",
        _ => "unknown status",
    };
    format!("{meaning} (status {status:04X}H)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_status_has_words_and_one_meaning() {
        for status in 0..=u16::MAX {
            assert!(words(status).contains(&format!("{status:04X}H")));
            assert!(!(is_warning(status) && is_transient(status)), "{status:04X}");
        }
        assert!(is_warning(0xB000) && is_warning(0xB006) && is_warning(0xB007));
        for status in [0xA700, 0xC000, 0, 0x0001, 0x0107, 0x0111, 0x0116] {
            assert!(!is_warning(status), "{status:04X}");
        }
    }
}
