//! Bytes in a URI itself (RFC 2397): in base64 (RFC 4648), or as text with percent signs.

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

/// Base64 with or without padding.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The decoded content of a data URI.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct DataUri {
    pub(super) bytes: Vec<u8>,
    /// A warning, if its base64 is not in the standard alphabet and padded, but could be read.
    pub(super) mended: Option<&'static str>,
}

impl DataUri {
    /// Reads what follows the scheme of a data URI; says what is wrong with it.
    pub(super) fn read(rest: &str) -> Result<Self, String> {
        let Some((kind, data)) = rest.split_once(',') else {
            return Err("a data URI without a comma before its data".into());
        };
        let is_base64 =
            kind.rsplit(';').next().is_some_and(|last| last.trim().eq_ignore_ascii_case("base64"));
        if is_base64 {
            return decode(data);
        }
        Ok(Self { bytes: percent_decode_str(data).collect(), mended: None })
    }
}

/// Decodes base64, also without its padding, in the alphabet for URLs and with spaces or line ends.
fn decode(data: &str) -> Result<DataUri, String> {
    let error = match base64::engine::general_purpose::STANDARD.decode(data) {
        Ok(bytes) => return Ok(DataUri { bytes, mended: None }),
        Err(error) => error,
    };
    let plain = |byte: u8| match byte {
        b'-' => b'+',
        b'_' => b'/',
        other => other,
    };
    let bytes = percent_decode_str(data).filter(|byte| !byte.is_ascii_whitespace());
    let text: Vec<u8> = bytes.map(plain).collect();
    let mended = "its base64 is not that of glTF: it is read without padding, as it is in URLs or with \
                  spaces; write it in the standard alphabet, padded";
    match BASE64.decode(text) {
        Ok(bytes) => Ok(DataUri { bytes, mended: Some(mended) }),
        Err(_) => Err(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(rest: &str) -> Vec<u8> {
        DataUri::read(rest).unwrap().bytes
    }

    #[test]
    fn base64_is_read_in_all_its_spellings_and_those_that_are_not_the_standard_are_told() {
        let read = |rest: &str| DataUri::read(rest).unwrap();
        for rest in [";base64,+/8BAg==", "application/octet-stream;base64,+/8BAg=="] {
            assert_eq!(read(rest), DataUri { bytes: vec![0xfb, 0xff, 1, 2], mended: None });
        }
        for rest in [
            ";base64,+/8BAg",
            ";base64,-_8BAg==",
            ";base64,-_8BAg",
            ";base64,%2B%2F8BAg%3D%3D",
            ";base64, +/8B\nAg==",
            "a/b;charset=utf-8;BASE64,+/8BAg=",
        ] {
            let DataUri { bytes, mended } = read(rest);
            assert_eq!((bytes, mended.is_some()), (vec![0xfb, 0xff, 1, 2], true), "{rest}");
        }
        for rest in [";base64,A", ";base64,A*==", ";base64", "AAAA"] {
            assert!(DataUri::read(rest).is_err(), "{rest}");
        }
        assert!(bytes(";base64,").is_empty());
    }

    #[test]
    fn without_base64_the_data_is_text_with_percent_signs() {
        assert_eq!(bytes(",a%20b%00%ff"), b"a b\0\xff");
        assert_eq!(bytes("text/plain;charset=utf-8,;base64,"), b";base64,");
        assert!(bytes(",").is_empty());
    }
}
