//! What we say of ourselves in protocol data units, and what units are called.

use dicom_ul::pdu::{Pdu, UserVariableItem};

/// Longest protocol data unit that is taken, and sent whatever the peer would take, bytes.
pub(crate) const MAX_PDU: u32 = 128 << 10;

/// What we tell the peer of ourselves when an association is made (PS3.7 D.3.3).
pub(crate) fn own_variables() -> Vec<UserVariableItem> {
    let (class, version) = supine_dicom::implementation();
    vec![
        UserVariableItem::MaxLength(MAX_PDU),
        UserVariableItem::ImplementationClassUID(class.to_owned()),
        UserVariableItem::ImplementationVersionName(version.to_owned()),
    ]
}

/// What the standard calls a unit.
pub(crate) fn kind(pdu: &Pdu) -> &'static str {
    match pdu {
        Pdu::AssociationRQ(_) => "A-ASSOCIATE-RQ",
        Pdu::AssociationAC(_) => "A-ASSOCIATE-AC",
        Pdu::AssociationRJ(_) => "A-ASSOCIATE-RJ",
        Pdu::PData { .. } => "P-DATA",
        Pdu::ReleaseRQ => "A-RELEASE-RQ",
        Pdu::ReleaseRP => "A-RELEASE-RP",
        Pdu::AbortRQ { .. } => "A-ABORT",
        Pdu::Unknown { .. } => "of unknown type",
    }
}
