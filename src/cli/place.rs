//! Places in the scene as they are typed.

use glam::DVec3;

/// Reads finite numbers between commas.
pub(super) fn numbers(text: &str) -> Option<Vec<f64>> {
    let number = |own: &str| own.trim().parse().ok().filter(|x: &f64| x.is_finite());
    text.split(',').map(number).collect()
}

/// Reads `0,1.5,-2`.
pub(super) fn parse_place(text: &str) -> Result<DVec3, String> {
    match numbers(text).as_deref() {
        Some(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("{text} is no place: it is three numbers, as 0,1.5,-2")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_three_numbers() {
        assert_eq!(parse_place("0, 1.5,-2"), Ok(DVec3::new(0.0, 1.5, -2.0)));
        for wrong in ["", "1,2", "1,2,3,4", "1,2,x", "1,2,inf"] {
            assert!(parse_place(wrong).is_err(), "{wrong}");
        }
    }
}
