//! The image that everything here computes on.

/// A linear f32 image: row-major from the top, channels interleaved.
///
/// The texel in column `x` and row `y` has its centre at `(x + ½, y + ½)` in texels; a glTF UV of
/// (0, 0) is the top left corner of the image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plane {
    width: usize,
    height: usize,
    channels: usize,
    data: Vec<f32>,
}

impl Plane {
    /// An image of zeros.
    pub fn new(width: usize, height: usize, channels: usize) -> Self {
        Self { width, height, channels, data: vec![0.0; width * height * channels] }
    }

    /// An image of the given texels, `width · height · channels` floats.
    ///
    /// # Panics
    /// If `data` has another length.
    pub fn from_vec(width: usize, height: usize, channels: usize, data: Vec<f32>) -> Self {
        assert_eq!(data.len(), width * height * channels, "texels and size of a plane differ");
        Self { width, height, channels, data }
    }

    /// Width in texels.
    #[inline]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in texels.
    #[inline]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Floats per texel.
    #[inline]
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// The channels of one texel.
    #[inline]
    pub fn texel(&self, x: usize, y: usize) -> &[f32] {
        let start = (y * self.width + x) * self.channels;
        &self.data[start..start + self.channels]
    }

    /// The channels of one texel, to write.
    #[inline]
    pub fn texel_mut(&mut self, x: usize, y: usize) -> &mut [f32] {
        let start = (y * self.width + x) * self.channels;
        &mut self.data[start..start + self.channels]
    }

    /// All texels, row after row.
    #[inline]
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// All texels, row after row, to write.
    #[inline]
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }
}
