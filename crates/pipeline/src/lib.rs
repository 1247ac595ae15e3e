//! The case file and the whole flow from CT to deformed CT.
