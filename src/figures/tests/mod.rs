//! Every figure, with invented but realistic data: bytes, files, numbers, empty states.
//! With `MGE_FIGURE_DIR` set, the figures stay there to be looked at.

mod invented;

use std::path::Path;

use super::*;

fn provenance() -> Provenance {
    Provenance::new("mge figures --note \"a < b & c\"", &[0, 1, 2], "0f3a")
}

fn decode(path: &Path) -> (u32, u32, Vec<u8>) {
    let mut reader = png::Decoder::new(std::fs::File::open(path).unwrap()).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size()];
    let info = reader.next_frame(&mut pixels).unwrap();
    (info.width, info.height, pixels)
}

#[test]
fn every_figure_is_written_with_its_numbers() {
    let temporary = tempfile::tempdir().unwrap();
    let kept = std::env::var_os("MGE_FIGURE_DIR").map(std::path::PathBuf::from);
    let folder = kept.as_deref().unwrap_or(temporary.path());
    let dpi = if kept.is_some() { DEFAULT_DPI } else { 72 };
    for figure in invented::all() {
        let path = folder.join(figure.name()).with_extension("png");
        figure.write(&path, &provenance(), dpi).unwrap();
        let (width, height, pixels) = decode(&path);
        let expected = figure.size().map(|points| (points / 72.0 * f64::from(dpi)).round() as u32);
        assert_eq!([width, height], expected, "{}", figure.name());
        assert!(pixels.iter().any(|byte| *byte < 100), "{} is blank", figure.name());
        assert_eq!(Provenance::read(&path).unwrap(), provenance());
        let rows = csv::Reader::from_path(path.with_extension("csv")).unwrap().into_records().count();
        assert_eq!(rows, figure.table().rows().len());
        assert!(rows > 0, "{} has no numbers", figure.name());
        figure.write(&folder.join(figure.name()).with_extension("svg"), &provenance(), dpi).unwrap();
    }
}
