//! Strides that the vertex codec knows.

/// Calls a function of arrays whose length is a stride that the vertex codec knows: 4, 8, … 256 bytes.
/// None for any other.
macro_rules! by_stride {
    (@ $stride:expr, $function:ident, $arguments:tt, $($size:literal)*) => {
        match $stride {
            $($size => Some(by_stride!(@call $function, $size, $arguments)),)*
            _ => None,
        }
    };
    (@call $function:ident, $size:literal, ($($argument:expr),*)) => {
        $function::<$size>($($argument),*)
    };
    ($stride:expr, $function:ident, $($argument:expr),*) => {
        by_stride!(@ $stride, $function, ($($argument),*),
            4 8 12 16 20 24 28 32 36 40 44 48 52 56 60 64 68 72 76 80 84 88 92 96 100 104 108 112
            116 120 124 128 132 136 140 144 148 152 156 160 164 168 172 176 180 184 188 192 196 200
            204 208 212 216 220 224 228 232 236 240 244 248 252 256)
    };
}
pub(super) use by_stride;
