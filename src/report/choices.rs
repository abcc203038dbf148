//! The textures that were chosen for each level, why, and what the others would have cost.

use super::columns::{Column, fit, size};
use super::ticks::grouped;
use crate::transfer::{Candidate, ChoiceReason, MaterialTextures, TextureChoice, TextureOutcome};

/// Textures that the table for people has room for; all of them are in the JSON and on the page.
const MOST_ROWS: usize = 16;

/// A texture with the choice for each level.
struct Chosen<'a> {
    /// Its material and its place there.
    name: String,
    is_normal: bool,
    levels: Vec<&'a TextureChoice>,
}

/// The textures that were chosen. An image that several materials use is told once.
fn chosen(materials: &[MaterialTextures]) -> Vec<Chosen<'_>> {
    let mut all: Vec<Chosen<'_>> = Vec::new();
    let mut told: Vec<(usize, bool)> = Vec::new();
    for material in materials {
        for texture in &material.textures {
            for gained in [false, true] {
                let own = texture.choices.iter().filter(|choice| choice.gained == gained);
                let levels: Vec<&TextureChoice> = own.collect();
                if levels.is_empty() || told.contains(&(texture.image, gained)) {
                    continue;
                }
                told.push((texture.image, gained));
                let place = if gained { "new normals" } else { place(texture) };
                let is_normal = gained || place.contains("normal");
                all.push(Chosen {
                    name: format!("{} {place}", material.called()),
                    is_normal,
                    levels,
                });
            }
        }
    }
    all
}

/// The last part of a texture's place, without what all end in.
fn place(texture: &TextureOutcome) -> &str {
    let last = texture.texture.rsplit('/').next().unwrap_or_default();
    last.strip_suffix("Texture").unwrap_or(last)
}

/// The choices as a table for people, in lines of at most `width` signs where that can be; nothing if
/// all that the source has is shared and nothing is added.
pub(super) fn choice_table(materials: &[MaterialTextures], width: usize) -> String {
    let chosen = chosen(materials);
    if !chosen.iter().flat_map(|own| &own.levels).any(|own| own.own) {
        return String::new();
    }
    let levels = chosen.iter().map(|own| own.levels.len()).max().unwrap_or(0);
    let shown = &chosen[..chosen.len().min(MOST_ROWS)];
    let names = shown.iter().map(|own| own.name.clone()).collect();
    let mut columns = vec![Column::new("texture", 0, names)];
    columns.extend((0..levels).map(|level| {
        let cell = |own: &Chosen<'_>| own.levels.get(level).map_or(String::new(), |own| pick(own));
        Column::new(format!("level {}", level + 1), 0, shown.iter().map(cell).collect())
    }));
    let mut text = fit(columns, width);
    if chosen.len() > MOST_ROWS {
        text += &format!("and {} more textures\n", chosen.len() - MOST_ROWS);
    }
    text
}

/// What was chosen: a size and its bytes, or the source's.
fn pick(choice: &TextureChoice) -> String {
    match choice.why {
        _ if choice.own => sized(choice.own_size, choice.own_bytes),
        _ if choice.gained => "none".to_owned(),
        _ => "shared".to_owned(),
    }
}

fn sized([width, height]: [usize; 2], bytes: usize) -> String {
    let side = if width == height { format!("{width}²") } else { format!("{width}×{height}") };
    format!("{side} {}", size(bytes as u64))
}

/// A line on what a larger budget would buy, if one would.
pub(super) fn budget_line(materials: &[MaterialTextures]) -> Option<String> {
    let chosen = chosen(materials);
    let all = || chosen.iter().flat_map(|own| own.levels.iter().copied());
    let cut = |own: &&TextureChoice| {
        matches!(own.why, ChoiceReason::SmallerForBudget | ChoiceReason::SharedForBudget)
    };
    let count = all().filter(cut).count();
    let most = |own: &TextureChoice| match own.why {
        ChoiceReason::NoBetter | ChoiceReason::NotLost => 0,
        _ => own.candidates.iter().map(|own| own.bytes).max().unwrap_or(0),
    };
    let bytes: usize = all().map(most).sum();
    (count > 0).then(|| {
        format!(
            "{count} of the levels' textures are smaller, or shared, for the budget of bytes: --budget {} \
             has room for all that show less error",
            bytes.next_multiple_of(1000)
        )
    })
}

/// The choices as rows of a table on the page, a header first; nothing if there are none.
pub(super) fn choice_rows(materials: &[MaterialTextures]) -> Vec<Vec<String>> {
    let chosen = chosen(materials);
    if chosen.is_empty() {
        return Vec::new();
    }
    let header = ["texture", "level", "chosen", "why", "error", "the others, and their errors"];
    let rows = chosen.iter().flat_map(|own| own.levels.iter().map(|choice| row(own, choice)));
    std::iter::once(header.map(str::to_owned).to_vec()).chain(rows).collect()
}

fn row(own: &Chosen<'_>, choice: &TextureChoice) -> Vec<String> {
    let error = |error: f64| match own.is_normal {
        true => format!("{:.2}°", error.to_degrees()),
        false => format!("{error:.4}"),
    };
    let used = if choice.own { choice.own_error } else { choice.shared_error };
    let shared = if choice.gained { "none" } else { "shared" };
    let rest = choice.candidates.iter().filter(|own| !choice.own || own.size != choice.own_size);
    let told = |own: &Candidate| format!("{}: {}", sized(own.size, own.bytes), error(own.error));
    let shared = choice.own.then(|| format!("{shared}: {}", error(choice.shared_error)));
    let rest: Vec<String> = shared.into_iter().chain(rest.map(told)).collect();
    vec![
        own.name.clone(),
        grouped(choice.level),
        pick(choice),
        choice.why.to_string(),
        error(used),
        rest.join(", "),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer::Outcome;

    fn material(choices: Vec<TextureChoice>) -> MaterialTextures {
        let texture = "pbrMetallicRoughness/baseColorTexture".to_owned();
        let outcome = Outcome::InPlace;
        let textures = vec![TextureOutcome { texture, image: 0, outcome, why: None, choices }];
        MaterialTextures {
            material: 0,
            name: Some("paint".to_owned()),
            textures,
            merged: Vec::new(),
            apart: None,
        }
    }

    fn choice(level: usize, own: bool, gained: bool, why: ChoiceReason) -> TextureChoice {
        let candidate = |side: usize| Candidate {
            size: [side; 2],
            bytes: side * 100,
            error: 0.01 * 512.0 / side as f64,
        };
        TextureChoice {
            level,
            own,
            why,
            shared_error: 0.05,
            own_error: 0.02,
            own_size: [256; 2],
            own_bytes: 25_600,
            gained,
            candidates: vec![candidate(512), candidate(256)],
        }
    }

    #[test]
    fn the_table_tells_each_level_and_the_page_what_the_others_would_have_cost() {
        assert_eq!(choice_table(&[], 80), "");
        let choices = vec![
            choice(1, false, false, ChoiceReason::NoBetter),
            choice(1, true, true, ChoiceReason::SmallerForBudget),
            choice(2, true, false, ChoiceReason::Better),
            choice(2, false, true, ChoiceReason::NotLost),
        ];
        let materials = [material(choices)];
        let text = choice_table(&materials, 80);
        assert!(text.contains("paint baseColor") && text.contains("paint new normals"), "{text}");
        assert!(text.contains("shared") && text.contains("256² 26 kB"), "{text}");
        let rows = choice_rows(&materials);
        assert_eq!(rows.len(), 5);
        assert_eq!(rows[2][5], "shared: 0.0500, 512² 51 kB: 0.0100");
        assert_eq!(rows[3][4], "1.15°");
        let line = budget_line(&materials).expect("a choice that was cut");
        assert!(line.starts_with("1 of") && line.contains("--budget 103000"), "{line}");
    }
}
