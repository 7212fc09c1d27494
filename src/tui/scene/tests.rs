//! Tests of the drawn scene.

use std::sync::LazyLock;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Color;

use super::{Content, Ghost, Heat, Objects, Overlays, View, draw, legend as legend_lines, picture};
use crate::tui::view::playback::PlaybackFrame;
use crate::tui::widgets::theme::{ASCII, Depth, Marker, Palette, Theme};
use mge_guidance::{ActionPrior, Cluster, GuidanceConfig, StagePrior};
use mge_physics::Tool;
use mge_task::{Object, Part, Region, Task};
use mge_trainer::Source;

static TASK: LazyLock<Task> = LazyLock::new(|| mge_task::load("task1").unwrap());
static FRAME: LazyLock<PlaybackFrame> =
    LazyLock::new(|| PlaybackFrame { ball: TASK.ball.position, ..PlaybackFrame::default() });

/// The whole buffer.
const WHOLE: Rect = Rect::new(0, 0, 80, 40);
/// A part of it with room on all sides.
const PART: Rect = Rect::new(30, 5, 40, 20);

fn theme() -> Theme {
    Theme::new(Palette::Dark, Depth::True, Marker::Braille)
}

fn drawn<'a>(change: impl FnOnce(&mut Content<'a>)) -> (Buffer, View) {
    drawn_in(WHOLE, &theme(), change)
}

fn drawn_in<'a>(area: Rect, theme: &Theme, change: impl FnOnce(&mut Content<'a>)) -> (Buffer, View) {
    let mut buffer = Buffer::empty(WHOLE);
    let view = draw(&content(change), area, theme, &mut buffer);
    (buffer, view)
}

fn content<'a>(change: impl FnOnce(&mut Content<'a>)) -> Content<'a> {
    let mut content = Content {
        objects: Objects { task: &TASK, proposed: &[] },
        frame: &FRAME,
        overlays: Overlays::default(),
        prior: None,
        heat: None,
        choice: None,
        predicted: &[],
        truth: &[],
        selected: None,
        ghost: None,
    };
    change(&mut content);
    content
}

fn all_text(buffer: &Buffer) -> String {
    buffer.content.iter().map(|cell| cell.symbol()).collect()
}

fn colour_at(buffer: &Buffer, view: View, position: [f32; 2]) -> Color {
    buffer[view.cell(position).unwrap()].fg
}

/// The task's own tool at a position in units.
fn tool_at(position: [f64; 2]) -> Tool {
    TASK.placeable.tool([0.0; 2]).at(position)
}

/// One cluster in the first stage.
fn prior() -> ActionPrior {
    let cluster = Cluster { mean: [-0.5, 0.5], std: [0.1, 0.1], weight: 1.0, count: 3 };
    let stage = StagePrior { clusters: vec![cluster], ..StagePrior::default() };
    ActionPrior {
        version: 1,
        task: "task1".into(),
        model: "true".into(),
        model_sha256: None,
        seed: 0,
        config: GuidanceConfig::default(),
        stages: vec![stage],
    }
}

#[test]
fn objects_are_drawn_at_their_positions_in_their_colours() {
    let (buffer, view) = drawn(|_| {});
    assert_eq!(colour_at(&buffer, view, [0.25, 0.8]), theme().ball);
    assert_eq!(colour_at(&buffer, view, [0.25, -0.85]), theme().tool);
    assert_eq!(buffer[view.cell([0.0, 0.2]).unwrap()].symbol(), "1");
    assert_eq!(buffer[view.cell([-0.6, -0.2]).unwrap()].symbol(), "G");
    assert_eq!(colour_at(&buffer, view, [-0.9, 0.9]), Color::Reset);
}

#[test]
fn placed_tools_have_the_colour_of_what_placed_them() {
    let placed = vec![(tool_at([67.2, 42.0]), Source::Clusters), (tool_at([16.8, 67.2]), Source::Policy)];
    let frame = PlaybackFrame { placed, ..FRAME.clone() };
    let (buffer, view) = drawn(|content| content.frame = &frame);
    assert_eq!(colour_at(&buffer, view, [0.6, 0.0]), theme().stage(0));
    assert_eq!(colour_at(&buffer, view, [-0.6, 0.6]), theme().placed);
}

#[test]
fn clusters_have_the_colour_of_their_stage_and_are_grey_when_stale() {
    let prior = prior();
    let edge = [-0.4, 0.5];
    let (buffer, view) = drawn(|content| content.prior = Some((&prior, false)));
    assert_eq!(colour_at(&buffer, view, edge), theme().stage(0));
    let goal = ActionPrior { stages: vec![StagePrior::default(), prior.stages[0].clone()], ..prior.clone() };
    let (buffer, view) = drawn(|content| content.prior = Some((&goal, false)));
    assert_eq!(colour_at(&buffer, view, edge), theme().goal, "clusters of the goal have the colour of the goal");
    let (buffer, view) = drawn(|content| content.prior = Some((&prior, true)));
    assert_eq!(colour_at(&buffer, view, edge), theme().dim);
}

#[test]
fn the_heat_map_colours_the_background_from_low_to_high() {
    for low in [0.0, -1.0] {
        let values = [0.0, 0.5, 1.0, 0.0, 0.5, 1.0, 2.0, 2.0, f32::NAN].map(|value| low + value);
        let heat = Heat::from_vec(3, 3, values.into()).unwrap();
        let (buffer, view) = drawn(|content| {
            content.heat = Some(&heat);
            content.overlays.critic = true;
        });
        let background = |position| buffer[view.cell(position).unwrap()].bg;
        assert_eq!(background([-0.8, 0.8]), theme().heat(0.0));
        assert_eq!(background([0.8, 0.8]), theme().heat(0.5));
        assert_eq!(background([-0.8, -0.8]), theme().heat(1.0));
        let between = background([0.0, 0.8]);
        assert!(![0.0, 0.5].map(|share| theme().heat(share)).contains(&between), "between two cells");
    }
}

#[test]
fn the_heat_map_is_a_smooth_ramp_with_256_colours() {
    let heat = Heat::from_vec(2, 2, vec![0.0, 1.0, 0.0, 1.0]).unwrap();
    let theme = Theme::new(Palette::Dark, Depth::Ansi256, Marker::Braille);
    let (buffer, view) = drawn_in(WHOLE, &theme, |content| {
        content.heat = Some(&heat);
        content.overlays.critic = true;
    });
    let row = view.area.y + 1;
    let colours: Vec<Color> = (view.area.x..view.area.right()).map(|x| buffer[(x, row)].bg).collect();
    let number = |colour: &Color| if let Color::Indexed(number) = colour { *number } else { 0 };
    let numbers: Vec<u8> = colours.iter().map(number).collect();
    assert!(numbers.windows(2).all(|pair| pair[0] <= pair[1] && pair[1] <= pair[0] + 1), "{numbers:?}");
    assert_eq!((numbers[0], numbers.last()), (232, Some(&246)), "greys, without specks of other colours");
}

#[test]
fn without_colours_or_unicode_the_heat_map_is_characters_between_the_objects() {
    let values = vec![0.0, 0.5, 1.0, 0.0, 0.5, 1.0, 2.0, 2.0, f32::NAN];
    let heat = Heat::from_vec(3, 3, values).unwrap();
    for (depth, marker) in [(Depth::None, Marker::Braille), (Depth::True, ASCII)] {
        let theme = Theme::new(Palette::Dark, depth, marker);
        let (before, _) = drawn_in(WHOLE, &theme, |_| {});
        let (buffer, view) = drawn_in(WHOLE, &theme, |content| {
            content.heat = Some(&heat);
            content.overlays.critic = true;
        });
        let at = |position| buffer[view.cell(position).unwrap()].symbol();
        assert_eq!([at([-0.8, 0.8]), at([0.8, 0.8]), at([-0.8, -0.8])], [" ", ":", "#"], "{marker:?}");
        let mut objects = before.content.iter().zip(&buffer.content).filter(|(before, _)| before.symbol() != " ");
        assert!(objects.all(|(before, now)| before.symbol() == now.symbol()), "{marker:?}");
    }
}

#[test]
fn the_legend_lists_what_is_visible_and_the_heat_map_has_a_scale() {
    let heat = Heat::from_vec(2, 1, vec![-0.5, 1.5]).unwrap();
    let plain = legend(|_| {});
    assert!(plain.contains("G  goal") && !plain.contains("predicts"));
    let (buffer, _) = drawn(|content| {
        content.heat = Some(&heat);
        content.overlays.critic = true;
    });
    let prior = prior();
    let whole = legend(|content| {
        (content.heat, content.prior) = (Some(&heat), Some((&prior, false)));
        (content.overlays.critic, content.overlays.samples) = (true, true);
    });
    assert!(whole.contains("rewarding actions") && whole.contains("critic: the value"), "{whole}");
    let scale = all_text(&buffer);
    assert!(!scale.contains("goal") && scale.contains("critic -0.50"));
    // A column of each of nine colours after the smallest value.
    let colours = [13, 15, 17, 19, 21].map(|x| buffer[(x, 39)].bg);
    assert_eq!(colours, [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| theme().heat(share)));
}

fn legend<'a>(change: impl FnOnce(&mut Content<'a>)) -> String {
    legend_lines(&content(change), &theme()).iter().map(|line| format!("{line}\n")).collect()
}

#[test]
fn the_legend_explains_only_what_is_shown() {
    let plain = legend(|_| {});
    for sign in ["subgoals, in their order", "tools of the scene"] {
        assert!(plain.contains(sign), "{sign}");
    }
    for sign in ["where the ball was", "placed", "action clusters", "the actor", "really happened"] {
        assert!(!plain.contains(sign), "{sign}");
    }
    let task = Task { subgoals: Vec::new(), tools: Vec::new(), ..TASK.clone() };
    let bare = legend(|content| content.objects.task = &task);
    assert!(!bare.contains("subgoals, in") && !bare.contains("tools of"));
    let level = mge_task::load("create/Obstacle").unwrap();
    let of_level = legend(|content| content.objects.task = &level);
    for sign in ["○  marker: sets", "○  subgoals of the marker", "□  moving boxes"] {
        assert!(of_level.contains(sign) && !plain.contains(sign), "{sign}");
    }

    let (by_policy, from_clusters) = ("placed by policy, planner or hand", "placed from the clusters");
    for (source, shown, other) in
        [(Source::Policy, by_policy, from_clusters), (Source::Clusters, from_clusters, by_policy)]
    {
        let placed = vec![(tool_at([67.2, 42.0]), source)];
        let frame = PlaybackFrame { placed, trail: vec![[0.0, 0.0]], ..FRAME.clone() };
        let text = legend(|content| content.frame = &frame);
        assert!(text.contains(shown) && !text.contains(other) && text.contains("where the ball was"), "{source:?}");
    }
    let text = legend(|content| {
        content.truth = &[[0.0, 0.0]];
        content.overlays.actor = true;
    });
    assert!(text.contains("what really happened then") && !text.contains("the actor"));
    let choice = tool_at([42.0, 42.0]);
    let text = legend(|content| (content.overlays.actor, content.choice) = (true, Some(choice)));
    assert!(text.contains("where the actor would place the tool"));
}

#[test]
fn the_legend_says_whether_the_clusters_are_out_of_date() {
    let prior = prior();
    let shown = |stale: bool, clusters: bool| {
        let text = legend(|content| (content.prior, content.overlays.clusters) = (Some((&prior, stale)), clusters));
        ["action clusters: mean", "out of date"].map(|sign| text.contains(sign))
    };
    assert_eq!(shown(false, true), [true, false]);
    assert_eq!(shown(true, true), [false, true]);
    assert_eq!(shown(false, false), [false, false]);
    assert_eq!(shown(true, false), [false, false]);
}

#[test]
fn a_proposal_is_marked_with_a_question() {
    let proposed = [Region { position: [0.5, 0.5], radius: 4.0 }];
    let (buffer, view) = drawn_in(PART, &theme(), |content| content.objects.proposed = &proposed);
    let (x, y) = view.cell([0.5, 0.5]).unwrap();
    assert_eq!([x, x + 1].map(|x| buffer[(x, y)].symbol()), ["1", "?"]);
}

#[test]
fn the_ball_of_a_small_scene_is_a_sign() {
    for (height, is_letter) in [(11, true), (12, false)] {
        let (buffer, view) = drawn_in(Rect::new(0, 0, 2 * height, height), &theme(), |_| {});
        let cell = &buffer[view.cell(FRAME.ball).unwrap()];
        assert_eq!(cell.symbol() == "●", is_letter, "{height} rows");
    }
}

#[test]
fn the_selected_object_is_in_brackets_with_its_name_below() {
    let (buffer, view) = drawn_in(PART, &theme(), |content| content.selected = Some(Object::Part(Part::Subgoal(0))));
    let (x, y) = view.cell([0.0, 0.2]).unwrap();
    assert_eq!([x - 2, x + 2].map(|x| buffer[(x, y)].symbol()), ["[", "]"]);
    let below: String = (0..WHOLE.width).map(|x| buffer[(x, y + 2)].symbol()).collect();
    assert!(below.contains("subgoal 1"), "{below}");
}

#[test]
fn the_name_of_an_object_at_the_bottom_is_above_it() {
    let last = PART.bottom() - 1;
    let proposed = [Region { position: View { area: PART }.nearest(50, last), radius: 4.0 }];
    let (buffer, _) = drawn_in(PART, &theme(), |content| {
        content.objects.proposed = &proposed;
        content.selected = Some(Object::Proposal(0));
    });
    let row = |y: u16| -> String { (0..WHOLE.width).map(|x| buffer[(x, y)].symbol()).collect() };
    assert!(row(last).contains('[') && row(last - 2).contains("propos"), "{} {}", row(last), row(last - 2));
}

#[test]
fn nothing_is_drawn_beside_the_scene() {
    let view = View { area: PART };
    let columns = [30, 31, 50, 67, 68, 69];
    for (column, row) in (PART.top()..PART.bottom()).flat_map(|row| columns.map(|column| (column, row))) {
        let proposed = [Region { position: view.nearest(column, row), radius: 4.0 }];
        let (buffer, view) = drawn_in(PART, &theme(), |content| {
            content.objects.proposed = &proposed;
            content.selected = Some(Object::Proposal(0));
        });
        let mut beside = WHOLE.positions().filter(|at| !view.area.contains(*at));
        assert!(beside.all(|at| buffer[at].symbol() == " "), "with an object in column {column} of row {row}");
    }
}

#[test]
fn the_colour_of_a_tool_in_hand_shows_whether_it_fits() {
    for (refusal, colour) in [(None, theme().good), (Some("in the way".to_owned()), theme().bad)] {
        let ghost = Ghost { action: [0.6, 0.0], tool: tool_at([67.2, 42.0]), refusal, predicted: vec![] };
        let (buffer, view) = drawn(|content| content.ghost = Some(&ghost));
        assert_eq!(colour_at(&buffer, view, [0.6 - 4.0 / 42.0 + 0.01, 0.0]), colour);
    }
}

#[test]
fn a_bucket_has_a_rim_unlike_a_box() {
    let shape = |kind| {
        let mut buffer = Buffer::empty(PART);
        picture(&Tool::new(kind, [42.0, 42.0]).with_size(8.0), PART, &theme(), &mut buffer);
        let row = |y: u16| (PART.left()..PART.right()).filter(|x| buffer[(*x, y)].symbol() != " ").count();
        (PART.top()..PART.bottom()).map(row).filter(|width| *width > 0).collect::<Vec<_>>()
    };
    let [bucket, plain] = [mge_physics::ToolKind::Bucket, mge_physics::ToolKind::Box].map(shape);
    assert!(bucket[0] > bucket[bucket.len() - 1] && plain[0] == plain[plain.len() - 1], "{bucket:?} {plain:?}");
}
