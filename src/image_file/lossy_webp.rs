//! WebP with losses, by libwebp; the encoder of the image crate knows only the lossless kind.

use image::DynamicImage;

use crate::error::{Error, Result};

/// Encodes an image of 8 bits a channel; `quality` is 0…100. Alpha is kept without loss, and so are colors where it is
/// 0, which filters read.
///
/// # Errors
/// [`Error::Internal`] if the encoder refuses it, as it does with sides above 16383; [`Error::Options`] in a build
/// without it.
#[cfg(feature = "webp")]
pub(crate) fn encode(image: &DynamicImage, quality: u8) -> Result<Vec<u8>> {
    let fault = |what: String| Error::internal(format!("the encoder of WebP failed: {what}"));
    let mut config = webp::WebPConfig::new().map_err(|()| fault("no configuration".to_owned()))?;
    config.quality = quality.into();
    (config.exact, config.use_sharp_yuv) = (1, 1);
    let (width, height) = (image.width(), image.height());
    let encoded = if image.color().has_alpha() {
        let texels = image.to_rgba8();
        webp::Encoder::from_rgba(&texels, width, height).encode_advanced(&config)
    } else {
        let texels = image.to_rgb8();
        webp::Encoder::from_rgb(&texels, width, height).encode_advanced(&config)
    };
    encoded.map(|bytes| bytes.to_vec()).map_err(|error| fault(format!("{error:?}")))
}

/// The error of a build without the encoder.
#[cfg(not(feature = "webp"))]
pub(crate) fn encode(_: &DynamicImage, _: u8) -> Result<Vec<u8>> {
    Err(not_built())
}

/// Makes sure that this build has the encoder.
///
/// # Errors
/// [`Error::Options`] that names the feature, if not.
pub(crate) fn check_built() -> Result<()> {
    if cfg!(feature = "webp") { Ok(()) } else { Err(not_built()) }
}

fn not_built() -> Error {
    let what = "WebP with losses needs the feature webp, which this program was built without: build it with \
                --features webp, which takes a C compiler";
    Error::Options { what: what.to_owned() }
}
