//! Whether pictures fit the machine, asked before any work.

use crate::{Error, Result};

/// Bytes a pixel beside the channels: the film's colour, its spread and AOVs, and the encoder's copy.
const FILM_BYTES: u64 = 16 + 4 + 48 + 16;

/// Refuses a picture of `channels` channels that the memory now free cannot hold. Where the system does not
/// tell (it is not Linux), anything goes.
pub fn check_picture(width: u32, height: u32, channels: u64) -> Result<()> {
    let needed = u64::from(width) * u64::from(height) * (FILM_BYTES + 8 * channels);
    check_fits(
        &format!("a picture of {width} x {height} pixels"),
        needed,
        "use a smaller --width and --height, or fewer --aov",
    )
}

/// Refuses `what` if it needs more `bytes` than are now free.
pub fn check_fits(what: &str, bytes: u64, remedy: &str) -> Result<()> {
    match available() {
        Some(free) if bytes > free => {
            let problem = format!("{what} needs {} MiB, {} MiB are free", bytes >> 20, free >> 20);
            Err(Error::usage(problem, remedy))
        }
        _ => Ok(()),
    }
}

fn available() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}
