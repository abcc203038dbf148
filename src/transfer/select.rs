//! The selection of images of levels' own within a budget of bytes.
//!
//! Each image has options of more bytes and less error. All begin with the least error; then the step
//! down that loses least for each byte that it saves comes first, until the bytes fit, and what is left
//! over goes to the steps up that win most for a byte. On the lower hull of options that is the best
//! selection but for the last step (Everett, "Generalized Lagrange multiplier method for solving problems
//! of optimum allocation of resources", Operations Research 1963).

use super::choice::Measured;

/// The option of each image; in `budget` are the bytes that may be added to those of shared images.
pub(super) fn select(images: &[&Measured], budget: Option<u64>) -> Vec<Option<usize>> {
    let options: Vec<Vec<Choice>> = images.iter().map(|own| choices(own)).collect();
    let mut at: Vec<usize> = options.iter().map(|own| own.len() - 1).collect();
    if let Some(budget) = budget {
        let shared: usize = images.iter().map(|own| own.shared_bytes).sum();
        let budget = usize::try_from(budget).unwrap_or(usize::MAX).saturating_add(shared);
        step_down(&options, &mut at, budget);
        step_up(&options, &mut at, budget);
    }
    options.iter().zip(at).map(|(own, at)| own[at].own).collect()
}

/// An option of an image.
struct Choice {
    own: Option<usize>,
    bytes: usize,
    loss: f64,
}

/// The options of an image, of more and more bytes and less and less loss.
fn choices(image: &Measured) -> Vec<Choice> {
    let choice = |own| Choice { own, bytes: image.bytes(own), loss: image.loss(own) };
    let mut all: Vec<Choice> = image.options().into_iter().map(choice).collect();
    all.sort_by_key(|choice| choice.bytes);
    let mut least = f64::INFINITY;
    all.retain(|choice| {
        let is_less = choice.loss < least;
        least = least.min(choice.loss);
        is_less
    });
    all
}

fn bytes(options: &[Vec<Choice>], at: &[usize]) -> usize {
    options.iter().zip(at).map(|(own, &at)| own[at].bytes).sum()
}

fn step_down(options: &[Vec<Choice>], at: &mut [usize], budget: usize) {
    while bytes(options, at) > budget {
        let steps = options.iter().enumerate().flat_map(|(image, own)| {
            let now = &own[at[image]];
            let price = |to: &Choice| (to.loss - now.loss) / (now.bytes - to.bytes).max(1) as f64;
            own[..at[image]].iter().enumerate().map(move |(to, choice)| (price(choice), image, to))
        });
        let Some((_, image, to)) = steps.min_by(|a, b| a.0.total_cmp(&b.0)) else { return };
        at[image] = to;
    }
}

fn step_up(options: &[Vec<Choice>], at: &mut [usize], budget: usize) {
    loop {
        let left = budget.saturating_sub(bytes(options, at));
        let steps = options.iter().enumerate().flat_map(|(image, own)| {
            let now = &own[at[image]];
            let fits = move |to: &usize| own[*to].bytes - now.bytes <= left;
            let won = move |to: usize| {
                (now.loss - own[to].loss) / (own[to].bytes - now.bytes).max(1) as f64
            };
            (at[image] + 1..own.len()).filter(fits).map(move |to| (won(to), image, to))
        });
        let Some((_, image, to)) = steps.max_by(|a, b| a.0.total_cmp(&b.0)) else { return };
        at[image] = to;
    }
}

#[cfg(test)]
mod tests {
    use seamwise_texture::Role;

    use super::super::choice::Candidate;
    use super::*;
    use crate::image_file::encoded::{EncodedImage, ImageFormat};

    /// An image of a shared error, and errors and bytes of its own, the largest first.
    fn image(shared_error: f64, own: &[(f64, usize)]) -> Measured {
        let file = EncodedImage { bytes: Vec::new().into(), format: ImageFormat::Png };
        let own = own.iter().map(|&(error, bytes)| Candidate { size: [64; 2], bytes, error });
        Measured {
            image: 0,
            role: Role::Color,
            gained: false,
            shared_error,
            share: 1.0,
            shared_bytes: 0,
            own: own.map(|own| (own, file.clone())).collect(),
        }
    }

    #[test]
    fn what_loses_least_for_a_byte_goes_first_and_what_is_left_is_spent() {
        let images = [
            image(0.5, &[(0.1, 1000), (0.11, 250), (0.3, 60)]),
            image(0.2, &[(0.05, 1000), (0.15, 250)]),
            image(0.1, &[(0.3, 10)]),
        ];
        let images: Vec<&Measured> = images.iter().collect();
        assert_eq!(select(&images, None), [Some(0), Some(0), None]);
        assert_eq!(select(&images, Some(2000)), [Some(0), Some(0), None]);
        assert_eq!(select(&images, Some(1300)), [Some(1), Some(0), None]);
        assert_eq!(select(&images, Some(500)), [Some(1), Some(1), None]);
        assert_eq!(select(&images, Some(100)), [Some(2), None, None]);
        assert_eq!(select(&images, Some(0)), [None, None, None]);
    }

    #[test]
    fn an_image_in_place_of_one_that_a_file_holds_anyway_costs_the_difference() {
        let alone = image(0.5, &[(0.1, 1000), (0.2, 300)]);
        let shared_bytes = 950;
        let images = [Measured { shared_bytes, ..alone.clone() }, alone];
        let images: Vec<&Measured> = images.iter().collect();
        assert_eq!(select(&images, Some(1050)), [Some(0), Some(0)]);
        assert_eq!(select(&images, Some(350)), [Some(1), Some(0)]);
        assert_eq!(select(&images, Some(0)), [Some(1), Some(1)], "700 are saved and 300 spent");
    }

    #[test]
    fn a_selection_is_the_best_of_all_but_for_a_last_step() {
        let images = [
            image(0.5, &[(0.1, 900), (0.2, 300), (0.4, 100)]),
            image(0.4, &[(0.05, 800), (0.1, 250), (0.2, 60)]),
            image(0.6, &[(0.3, 1000), (0.35, 200), (0.5, 70)]),
        ];
        let images: Vec<&Measured> = images.iter().collect();
        let loss = |picks: &[Option<usize>]| -> f64 {
            images.iter().zip(picks).map(|(own, &pick)| own.loss(pick)).sum()
        };
        let cost = |picks: &[Option<usize>]| -> usize {
            images.iter().zip(picks).map(|(own, &pick)| own.bytes(pick)).sum()
        };
        let each = [None, Some(0), Some(1), Some(2)];
        for budget in (0..2800).step_by(50) {
            let found = select(&images, Some(budget));
            assert!(cost(&found) as u64 <= budget);
            // No worse than the best with as much less as the dearest step takes.
            let less = (budget as usize).saturating_sub(800);
            let all = each.iter().flat_map(|&a| each.iter().map(move |&b| (a, b)));
            let all = all.flat_map(|(a, b)| each.iter().map(move |&c| [a, b, c]));
            let best = all.filter(|picks| cost(picks) <= less).map(|picks| loss(&picks));
            assert!(loss(&found) <= best.fold(f64::INFINITY, f64::min) + 1e-12, "{budget}");
        }
    }
}
