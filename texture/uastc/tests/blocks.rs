//! Blocks against the transcoder, which is other people's code in another language.

use basisu::uastc::unpack::unpack_uastc;
use seamwise_uastc::{BLOCK_BYTES, BLOCK_SIDE, Error, encode};

/// Smooth colors with a print of four texels over them, noise of a few steps, and alpha that falls off.
fn picture(width: usize, height: usize) -> Vec<u8> {
    let texel = |at: usize| {
        let (x, y) = (at % width, at / width);
        let wave = |scale: f64, shift: f64| {
            ((x as f64 * scale + y as f64 * 0.07 + shift).sin() * 80.0) as i32
        };
        let noise = (at as u32).wrapping_mul(0x9e37_79b9) >> 29;
        let print = if (x / 4 + y / 4) % 5 == 0 { 30 } else { 0 };
        let color = [wave(0.05, 0.0), wave(0.05, 0.4), wave(0.04, 1.0)];
        let [r, g, b] = color.map(|own| (128 + own - print + noise as i32).clamp(0, 255) as u8);
        [r, g, b, 255 - (255 * y / height / 2) as u8]
    };
    (0..width * height).flat_map(texel).collect()
}

/// The texels of blocks, clipped to the image.
fn decode(blocks: &[u8], width: usize, height: usize) -> Vec<u8> {
    let across = width.div_ceil(BLOCK_SIDE);
    let mut texels = vec![0; width * height * 4];
    for (index, block) in blocks.as_chunks::<BLOCK_BYTES>().0.iter().enumerate() {
        let own = unpack_uastc(block, false).expect("a block");
        for (at, color) in own.iter().enumerate() {
            let x = index % across * BLOCK_SIDE + at % BLOCK_SIDE;
            let y = index / across * BLOCK_SIDE + at / BLOCK_SIDE;
            if x < width && y < height {
                texels[(y * width + x) * 4..][..4].copy_from_slice(&color.c);
            }
        }
    }
    texels
}

/// Peak signal to noise ratio in dB.
fn psnr(a: &[u8], b: &[u8]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum::<f64>();
    20.0 * 255f64.log10() - 10.0 * (squares / a.len() as f64).log10()
}

#[test]
fn a_picture_comes_back_nearly_whatever_its_size() {
    for (width, height) in [(256, 192), (100, 70), (33, 5), (2, 1), (1, 1)] {
        let texels = picture(width, height);
        let blocks = encode(&texels, width, height).expect("an image");
        assert_eq!(blocks.len(), width.div_ceil(4) * height.div_ceil(4) * BLOCK_BYTES);
        let psnr = psnr(&texels, &decode(&blocks, width, height));
        assert!(psnr > 38.0, "{width} × {height}: {psnr} dB");
    }
}

#[test]
fn bytes_are_the_same_at_any_number_of_threads() {
    let texels = picture(300, 400);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| encode(&texels, 300, 400).expect("an image"))
    };
    assert!(run(1) == run(3));
}

#[test]
fn what_is_no_image_is_refused() {
    for (bytes, width, height) in [(16, 0, 4), (16, 2, 3), (65540, 16385, 1), (0, 0, 0)] {
        let refused = encode(&vec![0; bytes], width, height);
        assert!(matches!(refused, Err(Error::Size { .. })), "{width} × {height}");
    }
}
