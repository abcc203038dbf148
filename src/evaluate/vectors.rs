//! Work made for the vector instructions of the processor that it runs on.

/// Work whose whole way is inlined. A closure will not do: one that is not small stays a function of its
/// own, made for the oldest processors.
pub(super) trait Work {
    /// What comes of it.
    type Output;

    /// Does it; to be inlined always.
    fn run(self) -> Self::Output;
}

struct Vectors<W>(W);

impl<W: Work> pulp::WithSimd for Vectors<W> {
    type Output = W::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> W::Output {
        self.0.run()
    }
}

/// Does work that is compiled once more for processors with AVX2, and for those with AVX-512. No number is rounded otherwise there:
/// nothing is fused.
#[inline]
pub(super) fn dispatch<W: Work>(work: W) -> W::Output {
    pulp::Arch::new().dispatch(Vectors(work))
}
