//! The memory that the program holds.

/// Resident memory now, MB (10^6 bytes); none where the system does not tell.
pub(crate) fn mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kb: f64 = line.trim().strip_suffix(" kB")?.trim().parse().ok()?;
    Some(kb * 1024.0 / 1e6)
}

#[cfg(test)]
mod tests {
    #[test]
    #[cfg(target_os = "linux")]
    fn memory_that_is_used_is_counted() {
        let before = super::mb().unwrap();
        let held = vec![1_u8; 64_000_000];
        let after = super::mb().unwrap();
        assert!(after - before > 60.0, "{before} {after} {}", held[63_999_999]);
    }
}
