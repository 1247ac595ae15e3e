//! The process that may die.

use crate::bridge::ffi;
use crate::wire::{Answer, Request};
use std::io::{Read, Write};

/// Takes a surface from stdin, fills it by TetGen and puts the mesh on stdout.
///
/// # Errors
/// What went wrong, in words for the one who asked; TetGen may also end the process.
pub fn work() -> Result<(), String> {
    let mut bytes = Vec::new();
    std::io::stdin().lock().read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    let request =
        Request::read(&bytes).ok_or("this is a part of the mesher, not for use by hand")?;
    let raw = ffi::fill(&request.points, &request.faces, &request.tags, &request.switches)
        .map_err(|e| e.what().to_owned())?;
    let answer = Answer { points: raw.points, tets: raw.tets, faces: raw.faces, tags: raw.tags };
    let mut out = std::io::stdout().lock();
    out.write_all(&answer.bytes()).and_then(|()| out.flush()).map_err(|e| e.to_string())
}
