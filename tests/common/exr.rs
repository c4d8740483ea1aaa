//! EXR files as OpenImageIO reads them, which shares no code with what wrote them.

use std::path::Path;
use std::process::Command;

/// The file at `path` has this size and these channels, and only finite numbers. Skips aloud without oiiotool.
pub fn assert_sound(path: &Path, (width, height): (u32, u32), channels: &[&str]) {
    let output = match Command::new("oiiotool").args(["--info", "-v", "--stats"]).arg(path).output() {
        Ok(output) => output,
        Err(error) => return eprintln!("SKIPPED: oiiotool (package openimageio-tools): {error}"),
    };
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    let line = |label: &str| said.lines().find_map(|line| line.trim().strip_prefix(label)).unwrap_or_default();
    let size = format!("{width:4} x {height:4}, {} channel", channels.len());
    assert!(said.contains(&size), "no '{size}' in\n{said}");
    // A type may follow the name.
    let names = line("channel list: ").split(", ").map(|channel| channel.split(' ').next().unwrap_or_default());
    let (mut names, mut channels) = (Vec::from_iter(names), channels.to_vec());
    names.sort_unstable();
    channels.sort_unstable();
    assert_eq!(names, channels);
    for label in ["Stats NanCount:", "Stats InfCount:"] {
        assert_eq!(line(label).split_whitespace().collect::<Vec<_>>(), vec!["0"; channels.len()], "{label}\n{said}");
    }
}
