//! Every figure, with invented but realistic data: bytes, files, numbers, empty states. If `MGE_FIGURE_DIR` is set,
//! the figures are kept there for inspection.

mod invented;
mod shipped;

use std::path::Path;

use super::*;
use mge_base::atomic::Target;
use mge_stats::Estimate;

fn provenance() -> Provenance {
    Provenance::new("mge figures --note \"a < b & c\"", &[0, 1, 2], "0f3a")
}

fn decode(path: &Path) -> (u32, u32, Vec<u8>) {
    let mut reader =
        png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap())).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    (info.width, info.height, pixels)
}

/// The provenance in the text chunks of a PNG.
fn read(path: &Path) -> Provenance {
    let reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap())).read_info().unwrap();
    let info = reader.info();
    let find = |keyword: &str| {
        let plain = info.uncompressed_latin1_text.iter().find(|chunk| chunk.keyword == keyword);
        let utf8 = info.utf8_text.iter().find(|chunk| chunk.keyword == keyword);
        plain.map(|chunk| chunk.text.clone()).or_else(|| utf8.and_then(|chunk| chunk.get_text().ok())).unwrap()
    };
    Provenance {
        version: find("Software").strip_prefix("mge ").unwrap().to_owned(),
        command: find("Command"),
        seeds: find("Seed").split_whitespace().map(|seed| seed.parse().unwrap()).collect(),
        config_hash: find("Config hash"),
    }
}

/// Rows of the CSV beside `path`, by column name.
fn rows(path: &Path) -> Vec<std::collections::HashMap<String, String>> {
    csv::Reader::from_path(path.with_extension("csv")).unwrap().deserialize().collect::<Result<_, _>>().unwrap()
}

/// Figures without data.
fn empty() -> Vec<Box<dyn Figure>> {
    let task = || mge_task::shipped().swap_remove(0);
    vec![
        Box::new(Launches::default()),
        Box::new(RelativeFrames { task: task(), cutoff: 12.0, instants: vec![] }),
        Box::new(TaskGrid::default()),
        Box::new(ActionSamples::default()),
        Box::new(HitBars::default()),
        Box::new(LearningCurves::default()),
        Box::new(MethodScores::default()),
        Box::new(MethodScores { panels: vec![ScorePanel::default()], ..MethodScores::default() }),
        Box::new(LearningCurves { panels: vec![CurvePanel::default()], ..LearningCurves::default() }),
    ]
}

#[test]
fn every_figure_is_written_with_its_numbers() {
    let temporary = tempfile::tempdir().unwrap();
    let kept = std::env::var_os("MGE_FIGURE_DIR").map(std::path::PathBuf::from);
    let folder = kept.as_deref().unwrap_or(temporary.path());
    let dpi = if kept.is_some() { DEFAULT_DPI } else { 72 };
    for (name, figure) in invented::all() {
        let path = folder.join(name).with_extension("png");
        figure.write_all(&Target::from(folder), name, &provenance(), dpi).unwrap();
        let (width, height, pixels) = decode(&path);
        let expected = figure.size().map(|points| (points / 72.0 * f64::from(dpi)).round() as u32);
        assert_eq!([width, height], expected, "{name}");
        assert!(pixels.iter().any(|byte| *byte < 100), "{name} is blank");
        assert_eq!(read(&path), provenance());
        assert_eq!(rows(&path).len(), figure.table().rows().len());
        assert!(!rows(&path).is_empty(), "{name} has no numbers");
    }
}

#[test]
fn nothing_is_drawn_outside_the_page() {
    for (name, figure) in invented::all() {
        let [width, height] = figure.size().map(|points| points.round() as u32);
        let pixels = figure.to_rgb(width, height).unwrap();
        let row = 3 * width as usize;
        let edges = pixels[..row].iter().chain(&pixels[pixels.len() - row..]);
        let sides = pixels.chunks(row).flat_map(|line| line[..3].iter().chain(&line[row - 3..]));
        assert!(edges.chain(sides).all(|byte| *byte == 255), "{name} reaches the edge of its page");
    }
}

#[test]
fn equal_data_gives_equal_bytes() {
    let png = |figure: &dyn Figure| super::render::png(&figure.to_svg(&provenance()), &provenance(), 100).unwrap();
    for ((name, a), (_, b)) in invented::all().into_iter().zip(invented::all()) {
        assert_eq!(png(&*a), png(&*b), "{name}");
        assert_eq!(a.to_svg(&provenance()), b.to_svg(&provenance()), "{name}");
        assert_eq!(a.table(), b.table());
    }
}

#[test]
fn different_data_gives_different_pixels() {
    let mut changed = invented::hits();
    changed.tasks[0].policies[0].goal.value += 100.0;
    let [before, after] = [invented::hits(), changed].map(|hits| hits.to_rgb(600, 240).unwrap());
    assert_ne!(before, after);
}

#[test]
fn tables_hold_the_data_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let (hits, curves) = (invented::hits(), invented::curves());
    let path = folder.path().join("hits.png");
    hits.write(&Target::from(&path), &provenance(), 72).unwrap();
    let number = |text: &String| if text.is_empty() { f64::NAN } else { text.parse().unwrap() };
    for task in &hits.tasks {
        for policy in &task.policies {
            let mine = |row: &&std::collections::HashMap<String, String>| {
                row["task"] == task.task && row["policy"] == policy.policy
            };
            let found: Vec<f64> = rows(&path).iter().filter(mine).map(|row| number(&row["hits"])).collect();
            let expected: Vec<f64> = policy.subgoals.iter().chain([&policy.goal]).map(|e| e.value).collect();
            assert_eq!(found, expected);
        }
    }
    let path = folder.path().join("curves.png");
    curves.write(&Target::from(&path), &provenance(), 72).unwrap();
    let expected = curves.panels.iter().flat_map(|panel| &panel.curves).flat_map(|curve| &curve.y);
    let found: Vec<f64> = rows(&path).iter().map(|row| number(&row["success"])).collect();
    assert!(found.iter().zip(expected.clone()).all(|(a, b)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())));
    assert_eq!(found.len(), expected.count());
}

#[test]
fn empty_figures_say_so() {
    for (n, figure) in empty().into_iter().enumerate() {
        let pixels = figure.to_rgb(500, 300).unwrap();
        assert!(pixels.iter().any(|byte| *byte < 200), "{n} is blank");
        let svg = figure.to_svg(&provenance());
        assert!(svg.contains("no ") || svg.contains("nothing "), "{n} says nothing: {svg}");
    }
}

#[test]
fn many_series_look_different_and_their_legend_does_not_shrink_the_plots() {
    let seeds: Vec<String> = (0..21).map(|seed| format!("DDPG, seed {seed}")).collect();
    let pens = super::style::series(&seeds.iter().map(String::as_str).collect::<Vec<_>>());
    let look = |n: usize| (pens[n].color, pens[n].dash);
    assert!((0..21).all(|n| (0..n).all(|other| look(other) != look(n))));
    let curves = |count: usize| LearningCurves {
        panels: vec![CurvePanel {
            task: "task1".to_owned(),
            curves: (0..count)
                .map(|n| Curve {
                    label: format!("DDPG-MGE, epsilon 0.1, seed {n}"),
                    x: vec![0.0, 1000.0],
                    y: vec![0.0, (n + 1) as f64 / count as f64],
                    ..Curve::default()
                })
                .collect(),
        }],
        ..LearningCurves::default()
    };
    let height = |count| curves(count).size()[1];
    assert!(height(16) > height(3) + 30.0, "{} and {}", height(16), height(3));
    let folder = std::env::var_os("MGE_FIGURE_DIR").map(std::path::PathBuf::from);
    if let Some(folder) = folder {
        curves(16).write(&Target::from(&folder.join("many.png")), &provenance(), DEFAULT_DPI).unwrap();
    }
}

#[test]
fn missing_values_leave_gaps() {
    let panel = |y: Vec<f64>| LearningCurves {
        panels: vec![CurvePanel {
            task: "task1".to_owned(),
            curves: vec![Curve { label: "DDPG".to_owned(), x: vec![0.0, 1.0, 2.0, 3.0, 4.0], y, ..Curve::default() }],
        }],
        ..LearningCurves::default()
    };
    let count = |figure: &LearningCurves| figure.to_svg(&provenance()).matches("<polyline").count();
    let whole = count(&panel(vec![0.5; 5]));
    assert_eq!(count(&panel(vec![0.5, 0.5, f64::NAN, 0.5, 0.5])), whole + 1);
    assert_eq!(count(&panel(vec![0.5, 0.5, f64::INFINITY, f64::NEG_INFINITY, f64::NAN])), whole);
    assert_eq!(count(&panel(vec![f64::NAN; 5])), whole - 1);
}

#[test]
fn non_finite_numbers_do_not_break_figures() {
    let wild = [f64::NAN, f64::INFINITY, -1e300, 1e300, 0.0];
    let curve =
        Curve { label: "x".to_owned(), x: wild.to_vec(), y: wild.to_vec(), low: wild.to_vec(), high: vec![1.0] };
    let estimate = Estimate { value: f64::INFINITY, lower: f64::NAN, upper: -1e300 };
    let figures: Vec<Box<dyn Figure>> = vec![
        Box::new(LearningCurves {
            panels: vec![CurvePanel { task: String::new(), curves: vec![curve] }],
            ..LearningCurves::default()
        }),
        Box::new(MethodScores {
            panels: vec![ScorePanel {
                methods: [estimate, Estimate::exact(-3.0)]
                    .map(|estimate| MethodScore { label: String::new(), estimate, runs: wild.to_vec() })
                    .to_vec(),
                ..ScorePanel::default()
            }],
            ..MethodScores::default()
        }),
    ];
    for figure in figures {
        figure.to_rgb(400, 300).unwrap();
    }
}

#[test]
fn svg_is_well_formed_and_carries_its_provenance() {
    for figure in invented::all().into_iter().map(|(_, figure)| figure).chain(empty()) {
        let svg = figure.to_svg(&provenance());
        assert!(svg.contains("Command: mge figures --note \"a &lt; b &amp; c\""));
        assert_eq!(open_tags(&svg), Vec::<&str>::new(), "{svg}");
    }
}

/// Names of the elements left open; checks that every closing tag matches the last opened element.
fn open_tags(svg: &str) -> Vec<&str> {
    let mut open = Vec::new();
    for tag in svg.split('<').skip(1).map(|rest| rest.split_once('>').expect("a tag ends").0) {
        assert_eq!(tag.matches('"').count() % 2, 0, "unbalanced quotes in <{tag}>");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') && !tag.starts_with(['?', '!']) {
            open.push(tag.split_whitespace().next().expect("a name"));
        }
    }
    open
}

#[test]
fn provenance_survives_any_text() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tasks.png");
    let ours = Provenance::new("mge figures läufe/ε-0.5 日本", &[], "");
    invented::tasks().write(&Target::from(&path), &ours, 50).unwrap();
    assert_eq!(read(&path), ours);
}

#[test]
fn impossible_requests_are_refused_and_leave_files_intact() {
    let folder = tempfile::tempdir().unwrap();
    let figure = invented::tasks();
    let path = folder.path().join("tasks.jpeg");
    assert!(
        figure
            .write(&Target::from(&path), &provenance(), 72)
            .unwrap_err()
            .to_string()
            .ends_with("use one of these extensions")
    );
    assert!(matches!(figure.to_rgb(0, 10), Err(FigureError::Size { .. })));
    assert!(matches!(
        figure.write(&Target::from(&folder.path().join("tasks.png")), &provenance(), 1_000_000),
        Err(FigureError::Size { .. })
    ));
    assert!(matches!(
        figure.write(&Target::from(&folder.path().join("absent/tasks.png")), &provenance(), 72),
        Err(FigureError::Io { .. })
    ));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// The figure's width and pixels, at four pixels per point.
fn points(figure: &dyn Figure) -> (usize, Vec<[u8; 3]>) {
    let [width, height] = figure.size().map(|side| side.round() as u32);
    let pixels = figure.to_rgb(4 * width, 4 * height).unwrap();
    (4 * width as usize, pixels.as_chunks::<3>().0.to_vec())
}

fn one_panel(curves: Vec<Curve>) -> LearningCurves {
    LearningCurves {
        window: 3,
        panels: vec![CurvePanel { task: "task1".to_owned(), curves }],
        ..LearningCurves::default()
    }
}

fn steady(label: &str, y: f64) -> Curve {
    Curve { label: label.to_owned(), x: vec![0.0, 1.0, 2.0, 3.0], y: vec![y; 4], ..Curve::default() }
}

const BLUE: [u8; 3] = [0x00, 0x72, 0xB2];
const VERMILLION: [u8; 3] = [0xD5, 0x5E, 0x00];

#[test]
fn a_method_keeps_its_colour_beside_any_other() {
    let has = |curves: Vec<Curve>, color: [u8; 3]| points(&one_panel(curves)).1.contains(&color);
    let (plain, guided) = (|| steady("DDPG, seed 3", 0.5), || steady("DDPG-MGE, epsilon 0.5 to 0", 0.2));
    assert!(has(vec![plain()], BLUE) && has(vec![guided()], VERMILLION));
    assert!(!has(vec![guided()], BLUE) && !has(vec![plain()], VERMILLION));
    assert!(has(vec![guided(), plain()], BLUE) && has(vec![guided(), plain()], VERMILLION));
}

#[test]
fn legends_keep_the_order_of_the_data() {
    let svg = one_panel(vec![steady("zebra", 0.9), steady("ant", 0.2), steady("moth", 0.5)]).to_svg(&provenance());
    let at = |text: &str| svg.find(&format!("\n{text}\n")).unwrap_or_else(|| panic!("{text} is missing"));
    assert!(at("zebra") < at("ant") && at("ant") < at("moth"));
}

#[test]
fn missing_values_are_not_drawn_as_zero() {
    let mut scores = invented::methods();
    let all = points(&scores).1.iter().filter(|pixel| **pixel == BLUE).count();
    scores.panels.iter_mut().for_each(|panel| {
        let missing = &mut panel.methods[0];
        (missing.estimate, missing.runs) = (Estimate::exact(f64::NAN), vec![f64::NAN; 3]);
    });
    let (width, pixels) = points(&scores);
    let legend = |n: usize| n / width < 120;
    let left = pixels.iter().enumerate().filter(|(n, pixel)| **pixel == BLUE && !legend(*n)).count();
    assert!(all > 100 && left == 0, "{left} of {all} pixels of the missing method are drawn");
}

#[test]
fn curves_stay_inside_their_frame() {
    let wild = Curve { y: vec![0.5, 9.0, -9.0, 0.5], ..steady("DDPG", 0.5) };
    let calm = steady("DDPG", 0.5);
    let reach = |curve: Curve| {
        let (width, pixels) = points(&one_panel(vec![curve]));
        let rows: Vec<usize> =
            pixels.iter().enumerate().filter(|(_, pixel)| **pixel == BLUE).map(|(n, _)| n / width).collect();
        // The legend's line is the first.
        (rows[0], *rows.last().unwrap())
    };
    let (legend, _) = reach(calm);
    let (first, last) = reach(wild);
    assert_eq!(first, legend, "nothing is drawn above the legend");
    let height = 4.0 * one_panel(vec![]).size()[1];
    assert!((last as f64) < height - 4.0 * 30.0, "nothing is drawn below the frame");
}

#[test]
fn names_with_control_characters_make_xml() {
    let figure = one_panel(vec![steady("a\u{1b}[31m<b>&\u{0}\u{FFFE}", 0.5)]);
    let odd = Provenance::new("mge figures \u{1b}]0;title\u{7}", &[1], "");
    let svg = figure.to_svg(&odd);
    assert!(svg.chars().all(|c| !c.is_control() || c == '\n') && !svg.contains('\u{FFFE}'));
    assert!(svg.contains("&lt;b&gt;&amp;"));
    super::render::tree(&svg).unwrap();
}
