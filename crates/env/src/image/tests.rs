//! Compares images with recorded observations of CREATE (`tests/data/create/all/frames.jsonl.gz`).

use image::ImageReader;
use serde_json::Value;

use super::*;
use mge_physics::catalogue_tool;
use mge_task::load;

/// The records, one per line.
fn frames() -> String {
    let bytes = include_bytes!("../../../../tests/data/create/all/frames.jsonl.gz");
    // Ten bytes of header, eight of checksum and length.
    let body = &bytes[10..bytes.len() - 8];
    String::from_utf8(miniz_oxide::inflate::decompress_to_vec(body).unwrap()).unwrap()
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|index| value[index].as_f64().unwrap())
}

/// CREATE's image.
fn recorded(record: &Value) -> Vec<u8> {
    use base64::prelude::{BASE64_STANDARD, Engine};
    let png = BASE64_STANDARD.decode(record["png"].as_str().unwrap()).unwrap();
    let reader = ImageReader::new(std::io::Cursor::new(png)).with_guessed_format().unwrap();
    reader.decode().unwrap().into_rgb8().into_raw()
}

/// Our image of the recorded state.
fn drawn(record: &Value) -> Vec<u8> {
    let task = load(&format!("create/{}", record["level"].as_str().unwrap())).unwrap();
    let names = crate::ball_names(&task);
    let mut now = Snapshot::new(std::sync::Arc::new(task), [0.0; 2]);
    for placed in record["placed"].as_array().unwrap() {
        let tool = catalogue_tool(placed["tool_id"].as_u64().unwrap() as usize).unwrap();
        now.world_mut().add_tool(tool.at(to_units(numbers(&placed["pos_norm"]))));
    }
    for (index, name) in names.iter().enumerate() {
        let recorded = if name == "ball0" { "env0" } else { name };
        let [x, y, vx, vy, angle, angular_velocity] = numbers(&record["balls"][recorded]);
        now.world_mut().set_ball(index, Motion { position: [x, y], velocity: [vx, vy], angle, angular_velocity });
    }
    let mut image = [0; IMAGE_LEN];
    draw(&now, &mut image);
    image.to_vec()
}

/// Whether a pixel belongs to the trampoline of one level, which CREATE draws as a picture.
fn is_picture(level: &Value, column: usize, row: usize) -> bool {
    level == "Moving" && (60..83).contains(&column) && (69..79).contains(&row)
}

#[test]
fn shapes_without_pictures_equal_create_pixel_for_pixel() {
    let frames = frames();
    assert!(frames.lines().count() > 30);
    for line in frames.lines() {
        let record: Value = serde_json::from_str(line).unwrap();
        let (theirs, ours) = (recorded(&record), drawn(&record));
        assert_eq!(theirs.len(), ours.len());
        for (index, (theirs, ours)) in theirs.chunks(3).zip(ours.chunks(3)).enumerate() {
            let (column, row) = (index % IMAGE_SIDE, index / IMAGE_SIDE);
            if !is_picture(&record["level"], column, row) {
                assert_eq!(theirs, ours, "{}: column {column}, row {row}", record["id"]);
            }
        }
    }
}
