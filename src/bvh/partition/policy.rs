//! How the tree is cut, as the user says it.

use std::fmt;
use std::str::FromStr;

use crate::layout::Triangle;
use crate::shared::{MAX_LEAF_TRIANGLES, STACK_SIZE};
use crate::{Error, Result};

/// Deepest level at which a tree can be cut: the deepest a node can have.
const MAX_LEVEL: u32 = STACK_SIZE - 1;

/// Fewest bytes that any leaf fits.
const MIN_BYTES: u64 = MAX_LEAF_TRIANGLES as u64 * size_of::<Triangle>() as u64;

/// Beyond the caches of any machine.
const MAX_BYTES: u64 = 1 << 30;

/// Where the tree is cut into a top tree and subtrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// At a level, 0 being the root (Zhu and Deng 2013, section IV.A).
    Level(u32),
    /// The largest subtrees whose nodes and triangles fit so many bytes.
    Bytes(u64),
    /// Subtrees that fit so many bytes, cut where a ray is expected to move the fewest bytes: the treelet
    /// assignment of Aila and Karras 2010, section 4.1, with one level of treelets.
    Sah(u64),
}

/// Subtrees of half a megabyte suit the second-level caches of software drivers' hosts.
impl Default for Policy {
    fn default() -> Policy {
        Policy::Bytes(512 << 10)
    }
}

impl FromStr for Policy {
    type Err = Error;

    fn from_str(text: &str) -> Result<Policy> {
        let wrong = || {
            Error::usage(
                format!("partition '{text}'"),
                format!(
                    "give level:K with K from 0 to {MAX_LEVEL}, or bytes:N or sah:N with N from {MIN_BYTES} to 1GiB, \
                     for example bytes:64KiB"
                ),
            )
        };
        let (name, value) = text.split_once(':').ok_or_else(wrong)?;
        let bytes = || parse_bytes(value).filter(|bytes| (MIN_BYTES..=MAX_BYTES).contains(bytes)).ok_or_else(wrong);
        match name {
            "level" => {
                let level = value.parse().ok().filter(|&level| level <= MAX_LEVEL);
                Ok(Policy::Level(level.ok_or_else(wrong)?))
            }
            "bytes" => Ok(Policy::Bytes(bytes()?)),
            "sah" => Ok(Policy::Sah(bytes()?)),
            _ => Err(wrong()),
        }
    }
}

/// `4096`, `64K`, `64KiB`, `1M`, `1MiB`, `1GiB`: units are powers of 1024.
fn parse_bytes(text: &str) -> Option<u64> {
    let digits = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let shift = match &text[digits..] {
        "" | "B" => 0,
        "K" | "KiB" => 10,
        "M" | "MiB" => 20,
        "G" | "GiB" => 30,
        _ => return None,
    };
    text[..digits].parse::<u64>().ok()?.checked_mul(1 << shift)
}

impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match *self {
            Policy::Level(level) => write!(f, "level:{level}"),
            Policy::Bytes(bytes) => write!(f, "bytes:{}", text_of(bytes)),
            Policy::Sah(bytes) => write!(f, "sah:{}", text_of(bytes)),
        }
    }
}

fn text_of(bytes: u64) -> String {
    match bytes {
        b if b.is_multiple_of(1 << 30) => format!("{}GiB", b >> 30),
        b if b.is_multiple_of(1 << 20) => format!("{}MiB", b >> 20),
        b if b.is_multiple_of(1 << 10) => format!("{}KiB", b >> 10),
        b => b.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn policies_are_read_and_written() {
        for (text, policy) in [
            ("level:0", Policy::Level(0)),
            ("level:63", Policy::Level(63)),
            ("bytes:384", Policy::Bytes(384)),
            ("bytes:64KiB", Policy::Bytes(65_536)),
            ("sah:1GiB", Policy::Sah(1 << 30)),
        ] {
            assert_eq!(text.parse::<Policy>().unwrap(), policy);
            assert_eq!(policy.to_string(), text);
        }
        assert_eq!("bytes:65536".parse::<Policy>().unwrap().to_string(), "bytes:64KiB");
        assert_eq!("sah:2M".parse::<Policy>().unwrap(), Policy::Sah(2 << 20));
    }

    #[test]
    fn what_is_no_policy_is_refused_with_the_range() {
        for bad in [
            "level:99",
            "level:-1",
            "level:",
            "level",
            "bytes:0",
            "bytes:383",
            "bytes:1TB",
            "bytes:2GiB",
            "bytes:64k",
            "sah:",
            "sah:x",
            "byte:64KiB",
            "",
            "bytes:99999999999999999999",
            "bytes:18446744073709551615K",
        ] {
            let error = bad.parse::<Policy>().unwrap_err();
            assert_eq!(error.exit_code(), 2);
            let text = error.to_string();
            assert!(text.contains("level:K with K from 0 to 63") && text.contains("from 384 to 1GiB"), "{text}");
        }
    }
}
