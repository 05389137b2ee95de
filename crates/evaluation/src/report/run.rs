use super::{
    READING, curves,
    page::{About, page, section, table_section},
    plot::{BarPlot, LinePlot},
};
use crate::{
    Comparison, FootSlide,
    tables::{Cell, Table},
};

/// Errors of one motion as a table: a line for each measure.
pub fn run_errors(comparison: &Comparison, slide: Option<&FootSlide>) -> Table {
    let e = comparison.errors;
    let mut table = Table::new("Errors", String::new(), 1, ["measure", "value"]);
    let mut line = |name: &str, value: f64, decimals| {
        table.push(vec![Cell::text(name), Cell::Number(value, decimals)]);
    };
    line("frames compared", e.frames as f64, 0);
    line("joint angles, RMS, degrees", e.rms_deg, 2);
    line("joint angles, mean absolute, degrees", e.mae_deg, 2);
    line("joint rotations, geodesic, degrees", e.geodesic_deg, 2);
    line("joint positions (MPJPE), cm", e.mpjpe_cm, 2);
    line("joint positions, roots aligned, cm", e.mpjpe_aligned_cm, 2);
    if let Some(slide) = slide.filter(|s| s.contact_frames > 0) {
        line("foot slide of the truth, cm/s", slide.truth_cm_s, 1);
        line("foot slide of the result, cm/s", slide.found_cm_s, 1);
    }
    table
}

/// The report of one motion beside the truth.
pub fn run_report(about: &About, comparison: &Comparison, slide: Option<&FootSlide>) -> String {
    let degrees = curves::from_errors("joint angles, RMS".to_owned(), &comparison.frame_rms_deg);
    let plot = LinePlot {
        caption: "Root mean square over the joint angles of each frame. Of a long motion, mean and quartiles over short pieces.",
        x_label: "time, seconds",
        y_label: "degrees",
        series: &[degrees],
        shaded: None,
    };
    let centimetres = curves::from_errors("joint positions, MPJPE".to_owned(), &comparison.frame_mpjpe_cm);
    let positions = LinePlot {
        caption: "Mean distance of joints and bone ends from their true places.",
        y_label: "cm",
        series: &[centimetres],
        ..plot.clone()
    };
    let bars = BarPlot {
        caption: "Mean angle between true and found rotation of each joint.",
        unit: "°",
        series: &["this motion".to_owned()],
        bars: &curves::joint_bars(&[vec![comparison]]),
    };
    page(
        about,
        &[
            table_section(&run_errors(comparison, slide)),
            section("Error over time", "", &(plot.figure() + &positions.figure())),
            section("Joints", "", &bars.figure()),
            section("Reading the numbers", READING, ""),
        ],
    )
}
