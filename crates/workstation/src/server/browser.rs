//! Opens the browser at an address that nobody else may see.
//!
//! What a program is started with is seen by every user of a machine, so the browser is given a
//! file that its owner alone may read, and that leads to the address.

use std::io::Write;
use tempfile::{Builder, NamedTempFile};

/// Opens the browser. The file is there as long as what is returned.
///
/// # Errors
/// When the file cannot be written, or there is no browser.
pub(crate) fn open(address: &str) -> std::io::Result<NamedTempFile> {
    // On Unix temporary files are their owner's alone.
    let mut file = Builder::new().prefix("supine-").suffix(".html").tempfile()?;
    // The address is made of digits and letters alone.
    writeln!(
        file,
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>supine</title>\
         <meta http-equiv=\"refresh\" content=\"0; url={address}\"></head>\
         <body><a href=\"{address}\">Open the page</a></body></html>"
    )?;
    file.flush()?;
    open::that_detached(file.path())?;
    Ok(file)
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn the_file_is_its_owners_alone() {
        let file = tempfile::Builder::new().suffix(".html").tempfile().unwrap();
        let mode = file.as_file().metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
    }
}
