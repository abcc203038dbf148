//! Wrap modes of a sampler: reads beyond the image's edge (glTF 2.0 §5.26, `sampler.wrapS`).

/// A sampler's wrap mode along one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image repeats: glTF's default.
    #[default]
    Repeat,
    /// The image repeats, every other copy mirrored.
    Mirror,
    /// The edge texel goes on for ever.
    Clamp,
}

impl Wrap {
    /// The texel of an axis of `size` texels that is read at index `texel`.
    #[inline]
    pub fn texel(self, texel: i64, size: usize) -> usize {
        let size = size as i64;
        let wrapped = match self {
            Self::Repeat => texel.rem_euclid(size),
            Self::Mirror => {
                let folded = texel.rem_euclid(2 * size);
                folded.min(2 * size - 1 - folded)
            }
            Self::Clamp => texel.clamp(0, size - 1),
        };
        wrapped as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mode_reads_the_texel_of_the_specification() {
        let read = |wrap: Wrap| (-3..=5).map(|i| wrap.texel(i, 3)).collect::<Vec<_>>();
        assert_eq!(read(Wrap::Repeat), [0, 1, 2, 0, 1, 2, 0, 1, 2]);
        assert_eq!(read(Wrap::Mirror), [2, 1, 0, 0, 1, 2, 2, 1, 0]);
        assert_eq!(read(Wrap::Clamp), [0, 0, 0, 0, 1, 2, 2, 2, 2]);
    }
}
