//! The options of a bake in words, for its page.

use seamwise_attr::Polish;

use super::options::{BakeOptions, BudgetPer, Targets, TextureFiles, Textures};

/// What levels, textures and sizes were asked for.
pub(super) fn option_words(options: &BakeOptions) -> Vec<String> {
    let list = |all: Vec<String>| all.join(", ");
    let levels = match &options.targets {
        Targets::Ratios(ratios) => {
            let percent = |ratio: &f64| ((ratio * 1e6).round() / 1e4).to_string();
            format!("levels of {} % of the triangles", list(ratios.iter().map(percent).collect()))
        }
        Targets::Triangles(counts) => {
            format!("levels of {} triangles", list(counts.iter().map(usize::to_string).collect()))
        }
    };
    let budget = match options.budget_per {
        BudgetPer::Mesh => "each mesh by itself",
        BudgetPer::Scene => "all meshes together",
    };
    let polish = match &options.polish {
        None => "no polish",
        Some(polish) if *polish == Polish::FAST => "a fast polish",
        Some(_) => "a full polish",
    };
    let textures = match options.textures {
        Textures::Keep => "textures as they are, shared",
        Textures::Repair => "textures repaired and shared",
        Textures::Transfer(own) if own.chooses => {
            "textures of each level's own where they show less error"
        }
        Textures::Transfer(_) => "textures of each level's own, sampled from the source",
    };
    let TextureFiles { ktx2, smallest_png } = options.texture_files;
    let textures = textures.to_owned()
        + if ktx2 { ", in KTX2" } else { "" }
        + if smallest_png { ", PNGs as small as they can be" } else { "" };
    let screen = &options.screen;
    let screen = format!(
        "sizes for a screen of {} × {} pixels, {}° high, and {} of tolerance",
        screen.width,
        screen.height,
        screen.field_of_view_degrees,
        match screen.pixel_tolerance {
            1.0 => "1 pixel".to_owned(),
            pixels => format!("{pixels} pixels"),
        }
    );
    vec![levels, budget.to_owned(), polish.to_owned(), textures, screen]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_options_are_told() {
        let words = option_words(&BakeOptions::default());
        assert_eq!(words[0], "levels of 50, 25, 12.5, 6.25 % of the triangles");
        let textures = "textures of each level's own where they show less error";
        assert_eq!(words[2..4], ["a full polish", textures]);
        let targets = Targets::triangles(vec![500, 20]).unwrap();
        let options = BakeOptions { targets, polish: None, ..BakeOptions::default() };
        let words = option_words(&options);
        assert_eq!((&words[0][..], &words[2][..]), ("levels of 500, 20 triangles", "no polish"));
    }
}
