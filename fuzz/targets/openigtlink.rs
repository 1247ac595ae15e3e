//! A message of OpenIGTLink, with its size and checksum put right: what is read is written, and
//! read again as the same.
#![no_main]

use supine_openigtlink::{HEADER_BYTES, Header, Message, crc};

/// Reads a message with another header than it came with.
fn read(head: &[u8; HEADER_BYTES], body: &[u8]) -> Option<Message> {
    Message::read(&Header::read(head).ok()?, body).ok()
}

libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    let Some((head, body)) = input.split_first_chunk() else { return };
    let _ = read(head, body);
    let mut right = *head;
    right[42..50].copy_from_slice(&(body.len() as u64).to_be_bytes());
    right[50..].copy_from_slice(&crc::of(body).to_be_bytes());
    let Some(message) = read(&right, body) else { return };
    let (mut once, mut twice) = (Vec::new(), Vec::new());
    message.write(&mut once);
    let (head, body) = once.split_first_chunk().expect("a header");
    read(head, body).expect("what is written is read").write(&mut twice);
    assert_eq!(once, twice);
});
