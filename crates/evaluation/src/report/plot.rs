//! Plots as SVG inside the page: coloured by its style sheet, so that they are legible in light and dark.

use std::fmt::Write as _;

use super::page::escaped;

/// Number of colours in the style sheet.
const COLOURS: usize = 6;

/// One place of a line: mean and the quartiles around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    pub x: f64,
    pub mean: f64,
    pub low: f64,
    pub high: f64,
}

/// A line with its band.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub name: String,
    pub places: Vec<Place>,
}

/// A plot of lines over time.
#[derive(Debug, Clone, PartialEq)]
pub struct LinePlot<'a> {
    pub caption: &'a str,
    pub x_label: &'a str,
    pub y_label: &'a str,
    pub series: &'a [Series],
    /// part of the x axis that is shaded
    pub shaded: Option<(f64, f64)>,
}

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 48.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 42.0;

impl LinePlot<'_> {
    /// As a figure; nothing if there is nothing to draw.
    pub fn figure(&self) -> String {
        let places = || self.series.iter().flat_map(|s| &s.places);
        let x_min = places().map(|p| p.x).fold(f64::INFINITY, f64::min);
        let x_max = places().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max);
        if x_max.partial_cmp(&x_min) != Some(std::cmp::Ordering::Greater) {
            return String::new();
        }
        let y_top = places().map(|p| p.mean.max(p.high)).fold(1e-6, f64::max) * 1.05;
        let x = |v: f64| LEFT + (v - x_min) / (x_max - x_min) * (WIDTH - LEFT - RIGHT);
        let y = |v: f64| HEIGHT - BOTTOM - v / y_top * (HEIGHT - TOP - BOTTOM);
        let mut out = format!(
            "<figure>\n{}<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">\n",
            legend(self.series.iter().map(|s| s.name.as_str())),
            escaped(self.caption)
        );
        if let Some((from, to)) = self.shaded {
            let (from, to) = (x(from.max(x_min)), x(to.min(x_max)));
            let _ = writeln!(
                out,
                "<rect class=\"hidden-points\" x=\"{from:.1}\" y=\"{TOP}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                to - from,
                HEIGHT - TOP - BOTTOM
            );
        }
        for tick in ticks(0.0, y_top, 5) {
            let at = y(tick);
            let _ = writeln!(
                out,
                "<path class=\"grid\" d=\"M{LEFT} {at:.1}H{}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                WIDTH - RIGHT,
                LEFT - 7.0,
                at + 4.0,
                number(tick)
            );
        }
        for tick in ticks(x_min, x_max, 8) {
            let at = x(tick);
            let _ = writeln!(
                out,
                "<path class=\"axis\" d=\"M{at:.1} {0}v5\"/><text x=\"{at:.1}\" y=\"{1}\" text-anchor=\"middle\">{2}</text>",
                HEIGHT - BOTTOM,
                HEIGHT - BOTTOM + 18.0,
                number(tick)
            );
        }
        let base = HEIGHT - BOTTOM;
        let _ = writeln!(out, "<path class=\"axis\" d=\"M{LEFT} {base}H{}\"/>", WIDTH - RIGHT);
        for (i, series) in self.series.iter().enumerate() {
            out += &series.svg(i % COLOURS, &x, &y);
        }
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
            (LEFT + WIDTH - RIGHT) / 2.0,
            HEIGHT - 6.0,
            escaped(self.x_label)
        );
        let _ = writeln!(
            out,
            "<text transform=\"translate(13 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n</svg>",
            (TOP + HEIGHT - BOTTOM) / 2.0,
            escaped(self.y_label)
        );
        out + &format!("<figcaption>{}</figcaption>\n</figure>\n", escaped(self.caption))
    }
}

impl Series {
    fn svg(&self, colour: usize, x: &dyn Fn(f64) -> f64, y: &dyn Fn(f64) -> f64) -> String {
        let path = |places: &mut dyn Iterator<Item = (f64, f64)>| {
            let steps: Vec<String> = places.map(|(px, py)| format!("{:.1} {:.1}", x(px), y(py))).collect();
            format!("M{}", steps.join("L"))
        };
        let mut up = self.places.iter().map(|p| (p.x, p.high));
        let mut down = self.places.iter().rev().map(|p| (p.x, p.low));
        let band = path(&mut up) + &path(&mut down).replacen('M', "L", 1) + "Z";
        let line = path(&mut self.places.iter().map(|p| (p.x, p.mean)));
        if self.places.is_empty() {
            return String::new();
        }
        format!(
            "<path class=\"band f{colour}\" d=\"{band}\"/>\n<path class=\"line s{colour}\" d=\"{line}\"><title>{}</title></path>\n",
            escaped(&self.name)
        )
    }
}

/// What the colours stand for; nothing for one alone without a name.
pub fn legend<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut out = String::from("<ul class=\"legend\">");
    for (i, name) in names.enumerate() {
        let _ = write!(
            out,
            "<li><svg viewBox=\"0 0 14 8\"><rect class=\"f{}\" width=\"14\" height=\"8\"/></svg>{}</li>",
            i % COLOURS,
            escaped(name)
        );
    }
    out + "</ul>\n"
}

/// A line without axes, as high as its largest value; `top` is the value that reaches the upper edge.
pub fn sparkline(values: &[f64], top: f64) -> String {
    if values.len() < 2 || top.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
        return String::new();
    }
    let step = values.len().div_ceil(120);
    let steps: Vec<String> = values
        .iter()
        .enumerate()
        .step_by(step)
        .map(|(i, v)| {
            format!("{:.1} {:.1}", 140.0 * i as f64 / (values.len() - 1) as f64, 24.0 - 23.0 * v / top)
        })
        .collect();
    format!("<svg viewBox=\"0 0 140 25\"><path class=\"line s0\" d=\"M{}\"/></svg>", steps.join("L"))
}

/// A bar for each name, and a mark of each colour for what it is compared with.
#[derive(Debug, Clone, PartialEq)]
pub struct BarPlot<'a> {
    pub caption: &'a str,
    pub unit: &'a str,
    /// what the bar and then the marks stand for
    pub series: &'a [String],
    /// name, and a value for each of `series`
    pub bars: &'a [(String, Vec<f64>)],
}

impl BarPlot<'_> {
    /// As a figure; nothing if there are no bars.
    pub fn figure(&self) -> String {
        const ROW: f64 = 19.0;
        const NAMES: f64 = 150.0;
        let top = self.bars.iter().flat_map(|(_, values)| values).copied().fold(1e-6, f64::max);
        if self.bars.is_empty() {
            return String::new();
        }
        let x = |v: f64| NAMES + v / top * (WIDTH - NAMES - 45.0 - 32.0 * self.series.len() as f64);
        let height = ROW * self.bars.len() as f64 + 24.0;
        let mut out = format!(
            "<figure>\n{}<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{}\">\n",
            legend(self.series.iter().map(String::as_str)),
            escaped(self.caption)
        );
        for tick in ticks(0.0, top, 6) {
            let _ = writeln!(
                out,
                "<path class=\"grid\" d=\"M{0:.1} 0V{1}\"/><text x=\"{0:.1}\" y=\"{2}\" text-anchor=\"middle\">{3}{4}</text>",
                x(tick),
                height - 20.0,
                height - 5.0,
                number(tick),
                escaped(self.unit)
            );
        }
        for (i, (name, values)) in self.bars.iter().enumerate() {
            let y = ROW * i as f64;
            let Some((&first, marks)) = values.split_first() else { continue };
            let _ = writeln!(
                out,
                "<text class=\"name\" x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\
                 <rect class=\"bar f0\" x=\"{NAMES}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{}\"/>",
                NAMES - 8.0,
                y + 14.0,
                escaped(name),
                y + 3.0,
                x(first) - NAMES,
                ROW - 6.0
            );
            for (m, mark) in marks.iter().enumerate() {
                let _ = writeln!(
                    out,
                    "<path class=\"tick s{}\" d=\"M{:.1} {:.1}v{}\"/>",
                    (m + 1) % COLOURS,
                    x(*mark),
                    y + 1.5,
                    ROW - 3.0
                );
            }
            let widest = values.iter().copied().fold(first, f64::max);
            let shown: Vec<String> = values.iter().map(|v| format!("{v:.1}")).collect();
            let _ = writeln!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                x(widest) + 8.0,
                y + 14.0,
                shown.join(" · ")
            );
        }
        out + &format!("</svg>\n<figcaption>{}</figcaption>\n</figure>\n", escaped(self.caption))
    }
}

/// Round numbers between two values, about `count` of them.
fn ticks(from: f64, to: f64, count: usize) -> Vec<f64> {
    let rough = (to - from) / count as f64;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= rough).unwrap_or(power);
    let first = (from / step).ceil() as i64;
    let last = (to / step + 1e-9).floor() as i64;
    (first..=last).map(|i| i as f64 * step).collect()
}

/// Without digits that say nothing.
fn number(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(ticks(0.0, 10.3, 5), [0.0, 5.0, 10.0]);
        assert_eq!(ticks(-0.5, 1.0, 8), [-0.4, -0.2, 0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]);
        assert_eq!(
            (number(0.6000000000000001), number(-0.0), number(20.0)),
            ("0.6".into(), "0".into(), "20".into())
        );
    }

    #[test]
    fn a_plot_without_extent_is_left_out() {
        let place = Place { x: 1.0, mean: 2.0, low: 1.0, high: 3.0 };
        let series = [Series { name: "a".to_owned(), places: vec![place] }];
        let plot = LinePlot { caption: "c", x_label: "x", y_label: "y", series: &series, shaded: None };
        assert_eq!(plot.figure(), "");
        assert_eq!((sparkline(&[1.0], 1.0), sparkline(&[0.0, 0.0], 0.0)), (String::new(), String::new()));
    }
}
