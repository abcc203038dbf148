//! Limits on the memory that a file may make its reader take: a few bytes can claim any number of
//! texels, or name the same vertices again and again.

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::str::FromStr;

use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, Limits};

use crate::error::{Error, Result};

/// Units that a size is typed in, and how many bytes they are.
const UNITS: [(&str, u64); 9] = [
    ("TiB", 1 << 40),
    ("GiB", 1 << 30),
    ("MiB", 1 << 20),
    ("KiB", 1 << 10),
    ("TB", 1_000_000_000_000),
    ("GB", 1_000_000_000),
    ("MB", 1_000_000),
    ("KB", 1_000),
    ("B", 1),
];

/// Most memory that decoding one image may take, with what its decoder works in; and what all buffers
/// and image files of an asset, its decompressed geometry, its vertices and those of its scene may
/// each take together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryLimit {
    bytes: u64,
}

impl Default for MemoryLimit {
    /// 4 GiB: 16,384² texels of four 32-bit floats.
    fn default() -> Self {
        Self::of_bytes(4 << 30)
    }
}

impl MemoryLimit {
    /// A limit of so many bytes.
    pub const fn of_bytes(bytes: u64) -> Self {
        Self { bytes }
    }

    /// The limit in bytes.
    pub const fn bytes(self) -> u64 {
        self.bytes
    }

    /// The limit as decoders know it.
    pub(crate) fn to_limits(self) -> Limits {
        let mut limits = Limits::no_limits();
        limits.max_alloc = Some(self.bytes);
        limits
    }

    /// The fault of an image of `width` × `height` texels that takes so many bytes, if it is too
    /// large.
    pub(crate) fn check(self, [width, height]: [u64; 2], bytes: u64) -> Option<String> {
        let over = bytes > self.bytes;
        let needed = bytes.div_ceil(1 << 20);
        let what = || format!("{width}×{height} texels take {needed} MiB, {}", self.exceeded());
        over.then(what)
    }

    /// The end of a message about what was refused.
    pub(crate) fn exceeded(self) -> String {
        format!("more than the limit of {self}; --memory-limit allows more")
    }

    /// Reads a file that is to be decoded.
    pub(crate) fn read_file(self, path: &Path) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let read = |file: File| file.take(self.bytes.saturating_add(1)).read_to_end(&mut bytes);
        File::open(path).and_then(read).map_err(|error| Error::io(path, error))?;
        if bytes.len() as u64 > self.bytes {
            let what = format!("the file has {}", self.exceeded());
            return Err(Error::invalid(path.display().to_string(), what));
        }
        Ok(bytes)
    }

    /// Decodes an image; says what is wrong with it otherwise.
    pub(crate) fn decode(
        self,
        decoder: impl ImageDecoder,
        format: ImageFormat,
    ) -> std::result::Result<DynamicImage, String> {
        let (width, height) = decoder.dimensions();
        let bytes = decoder.total_bytes().saturating_mul(copies(format));
        match self.check([width.into(), height.into()], bytes) {
            Some(what) => Err(what),
            None => DynamicImage::from_decoder(decoder).map_err(|error| self.explain(&error)),
        }
    }

    /// The message for a decoder's error; decoders do not know who set their limit.
    pub(crate) fn explain(self, error: &ImageError) -> String {
        match error {
            ImageError::Limits(_) => format!("it takes {}", self.exceeded()),
            _ => error.to_string(),
        }
    }
}

/// The rest of a limit that several things share.
#[derive(Debug)]
pub(crate) struct Budget {
    left: u64,
    limit: MemoryLimit,
}

impl Budget {
    /// A budget of the whole limit.
    pub(crate) fn of(limit: MemoryLimit) -> Self {
        Self { left: limit.bytes, limit }
    }

    /// Bytes that are left.
    #[cfg(feature = "draco")]
    pub(crate) fn left(&self) -> u64 {
        self.left
    }

    /// Takes `bytes` for `things`; says that they are too much if they are.
    pub(crate) fn take(&mut self, things: &str, bytes: u64) -> std::result::Result<(), String> {
        let left = self.left.checked_sub(bytes);
        self.left = left.ok_or_else(|| format!("{things} take {}", self.limit.exceeded()))?;
        Ok(())
    }
}

/// The memory that a decoder takes, in multiples of the bytes of its result: coefficients of a
/// progressive JPEG are twice as large as its texels, a WebP is decoded with alpha and in planes, a
/// TIFF to a copy.
const fn copies(format: ImageFormat) -> u64 {
    match format {
        ImageFormat::Jpeg | ImageFormat::WebP => 3,
        ImageFormat::Tiff => 2,
        _ => 1,
    }
}

impl FromStr for MemoryLimit {
    type Err = Error;

    /// Reads `8GB`, `1.5 MiB` or a number of bytes.
    fn from_str(text: &str) -> Result<Self> {
        let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
        let (number, unit) = text.split_at(end);
        let named = |(name, _): &&(&str, u64)| name.eq_ignore_ascii_case(unit.trim());
        let unit = if unit.is_empty() { Some(1) } else { UNITS.iter().find(named).map(|u| u.1) };
        let of = |unit: u64| match number.parse::<u64>() {
            Ok(whole) => whole.checked_mul(unit),
            Err(_) => {
                let bytes = number.parse::<f64>().ok().map(|n| (n * unit as f64).round());
                // Beyond this not every number of bytes is one of these.
                bytes.filter(|&bytes| bytes < (1u64 << 53) as f64).map(|bytes| bytes as u64)
            }
        };
        let bytes = unit.and_then(of);
        bytes.filter(|&bytes| bytes > 0).map(Self::of_bytes).ok_or_else(|| Error::Options {
            what: format!("{text} is no size above 0 like 8GB, 512MiB or 1000000"),
        })
    }
}

impl fmt::Display for MemoryLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let fits = |(_, unit): &&(&str, u64)| self.bytes.is_multiple_of(*unit);
        let largest = UNITS.iter().filter(fits).max_by_key(|(_, unit)| unit);
        let (name, unit) = largest.unwrap_or(&UNITS[8]);
        write!(f, "{}{name}", self.bytes / unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_read_as_it_is_typed_and_written_the_same() {
        let read = |text: &str| text.parse::<MemoryLimit>();
        for (text, bytes) in [
            ("4GiB", 4 << 30),
            ("8GB", 8_000_000_000),
            ("100KiB", 100 << 10),
            ("7B", 7),
            ("1001B", 1001),
        ] {
            let limit = read(text).unwrap();
            assert_eq!((limit.bytes(), limit.to_string().as_str()), (bytes, text));
        }
        assert_eq!(read("64 mib").unwrap(), read("67108864").unwrap());
        assert_eq!(read("1.5GB").unwrap(), read("1500MB").unwrap());
        assert_eq!(MemoryLimit::default().to_string(), "4GiB");
        for text in [
            "",
            "GB",
            "0",
            "0GB",
            "-1GB",
            "1.5.5GB",
            ".GB",
            "0.1B",
            "8GBs",
            "99999999999TB",
            "9e9.5TB",
        ] {
            assert!(read(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_budget_is_shared_to_its_last_byte() {
        let mut budget = Budget::of(MemoryLimit::of_bytes(10));
        assert_eq!(budget.take("all views", 6), Ok(()));
        assert_eq!(budget.take("all views", 4), Ok(()));
        let what = budget.take("all views", 1).unwrap_err();
        assert!(what.starts_with("all views take more than the limit of 10B"), "{what}");
        assert!(budget.take("all views", u64::MAX).is_err() && budget.take("", 0).is_ok());
    }

    #[test]
    fn what_is_too_large_is_said_with_both_sizes() {
        let limit: MemoryLimit = "1GB".parse().unwrap();
        assert_eq!(limit.check([10, 10], 1_000_000_000), None);
        let what = limit.check([60_000, 60_000], 14_400_000_000).unwrap();
        assert!(what.contains("60000×60000") && what.contains("13733 MiB"), "{what}");
        assert!(what.contains("limit of 1GB") && what.contains("--memory-limit"), "{what}");
    }
}
