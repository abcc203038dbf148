use super::*;
use crate::evaluate::reference::ReferenceTextures;
use crate::evaluate::scene::Scene;
use crate::report::ReferenceReport;

/// The page of candidates of these names, all of which were compared.
fn page_of(candidates: &[(&str, Option<&str>)]) -> String {
    let mut gallery = Gallery::new(&Scene::default()).unwrap();
    let candidate = |&(file, warning): &(&str, Option<&str>)| {
        gallery.add(&Scene::default()).unwrap();
        CandidateReport {
            file: file.to_owned(),
            triangles: 6,
            metrics: Some(Metrics::default()),
            warning: warning.map(str::to_owned),
            ..CandidateReport::default()
        }
    };
    let report = EvaluateReport {
        schema: 1,
        reference: ReferenceReport {
            file: "<b>&\".glb".into(),
            triangles: 12,
            diagonal: 1.0,
            textures: ReferenceTextures::default(),
        },
        mode: Mode::Lit,
        views: Vec::new(),
        candidates: candidates.iter().map(candidate).collect(),
        warnings: Warnings::default(),
    };
    evaluate_page(&report, &gallery).unwrap()
}

#[test]
fn a_doubtful_candidate_is_in_no_chart() {
    let page = page_of(&[("x/a.glb", None), ("x/b.glb", Some("in other units?"))]);
    assert!(page.contains(">a.glb<") && page.contains(">b.glb<"));
    assert!(page.contains("x/b.glb: in other units?"));
    assert!(page.contains("<title>a.glb: 6") && !page.contains("<title>b.glb: 6"));
    assert!(!page.contains("class=\"dotted\""), "one series needs no key");
}

#[test]
fn text_from_files_is_escaped() {
    let page = page_of(&[("<script>.glb", None)]);
    assert!(!page.contains("<script>.glb") && !page.contains("<b>"));
    assert!(page.contains("&#60;script&#62;.glb") && page.contains("&lt;script&gt;.glb: 6"));
}

#[test]
fn the_legend_has_the_colors_of_the_map() {
    let legend = legend();
    let colors: Vec<&str> = legend.iter().map(|stop| stop.color.as_str()).collect();
    assert_eq!(colors, ["rgb(0 0 0)", "rgb(255 0 0)", "rgb(255 255 0)", "rgb(255 255 255)"]);
    assert_eq!(legend[3].label, "≥ 12.5 %");
}

#[test]
fn a_figure_without_difference_is_a_word_and_no_chart() {
    let metrics = Metrics { distance_rms: 0.1, ssim: 1.0, ..Metrics::default() };
    let measured = [("a".to_owned(), 9, &metrics, 0)];
    assert!(perfect(&measured).contains(&"Similarity"));
    let drawn: Vec<&str> = imperfect(&measured).iter().map(|chart| chart.title).collect();
    assert!(drawn.contains(&"RMS distance") && !drawn.contains(&"Similarity"));
}
