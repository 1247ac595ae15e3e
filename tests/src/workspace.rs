//! Where the workspace lies and what cargo knows of it.

use cargo_metadata::{Metadata, MetadataCommand};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// The packages of the workspace, without their foreign dependencies.
pub fn metadata() -> &'static Metadata {
    static METADATA: OnceLock<Metadata> = OnceLock::new();
    METADATA.get_or_init(|| {
        MetadataCommand::new()
            .manifest_path(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"))
            .no_deps()
            .exec()
            .expect("cargo metadata answers")
    })
}

/// The root of the repository.
pub fn root() -> PathBuf {
    metadata().workspace_root.clone().into_std_path_buf()
}

/// Cargo's target folder.
pub fn target() -> PathBuf {
    metadata().target_directory.clone().into_std_path_buf()
}
