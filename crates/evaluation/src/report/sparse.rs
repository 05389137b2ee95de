use model::counted;

use super::{
    READING, curves,
    page::{About, page, section, table_html, table_section},
    plot::{BarPlot, LinePlot, Series, sparkline},
};
use crate::{
    Case, Comparison, Protocol, Row, TrialResult,
    tables::{Cell, Table, reference, tables},
};

/// Trials that are shown by name because they came out worst.
const WORST: usize = 10;

/// The report of an evaluation: every table, errors over time, joints, worst trials. `beside_papers` as in [`tables`].
pub fn sparse_report(
    about: &About,
    protocol: Protocol,
    results: &[TrialResult],
    rows: &[Row],
    beside_papers: bool,
) -> String {
    let Some(reference) = reference(rows) else { return page(about, &[]) };
    let view = View { results, protocol, reference };
    let mut tables = tables(rows, beside_papers).into_iter();
    let errors = tables.next();
    let mut sections: Vec<String> = tables.map(|table| table_section(&table)).collect();
    sections.push(view.over_time());
    sections.extend(view.gaps());
    sections.push(view.joints());
    sections.push(view.worst());
    sections.extend(errors.as_ref().map(table_section));
    let protocol = format!("Protocol {protocol}: {}. ", protocol.explanation());
    sections.push(section("Reading the numbers", &(protocol + READING), ""));
    page(about, &sections)
}

struct View<'a> {
    results: &'a [TrialResult],
    protocol: Protocol,
    /// what is shown where only one case can be
    reference: Case,
}

impl<'a> View<'a> {
    fn for_case(&self, case: &Case) -> Vec<&'a TrialResult> {
        self.results.iter().filter(|r| r.case == *case).collect()
    }

    fn curve(&self, name: String, case: &Case) -> Option<Series> {
        let trials: Vec<&[f64]> =
            self.for_case(case).iter().map(|r| &r.comparison.frame_rms_deg[..]).collect();
        (!trials.is_empty()).then(|| curves::over_time(name, &trials))
    }

    /// The reference and the cases that differ from it in one thing: `other` gives each result's case changed back.
    fn beside(&self, name: &dyn Fn(&Case) -> String, other: &dyn Fn(&Case) -> Case) -> Vec<(String, Case)> {
        let mut cases: Vec<(String, Case)> = Vec::new();
        for case in self.results.iter().map(|r| &r.case) {
            if other(case) == *case && !cases.iter().any(|(_, c)| c == case) {
                cases.push((name(case), case.clone()));
            }
        }
        cases
    }

    fn methods(&self) -> Vec<(String, Case)> {
        self.beside(&|c| c.method.to_string(), &|c| Case { method: c.method, ..self.reference.clone() })
    }

    fn points(&self) -> Vec<(String, Case)> {
        self.beside(&|c| counted(c.points, "point"), &|c| Case { points: c.points, ..self.reference.clone() })
    }

    fn variants(&self) -> Vec<(String, Case)> {
        let name = |c: &Case| if c.variant.is_empty() { "as given".to_owned() } else { c.variant.clone() };
        self.beside(&name, &|c| Case { variant: c.variant.clone(), ..self.reference.clone() })
    }

    fn windows(&self) -> Vec<(String, Case)> {
        let name = |c: &Case| format!("window {}", c.window);
        self.beside(&name, &|c| Case { window: c.window, ..self.reference.clone() })
    }

    fn databases(&self) -> Vec<(String, Case)> {
        let name = |c: &Case| counted(c.database_poses, "pose");
        self.beside(&name, &|c| Case { database_poses: c.database_poses, ..self.reference.clone() })
    }

    fn noises(&self) -> Vec<(String, Case)> {
        let name = |c: &Case| format!("noise {} mm", c.noise_mm);
        self.beside(&name, &|c| Case { noise_mm: c.noise_mm, ..self.reference.clone() })
    }

    /// The reference case in words.
    fn reference(&self) -> String {
        let Case { method, points, database_poses, .. } = &self.reference;
        format!(
            "{method}, {}, {}, protocol {}",
            counted(points, "point"),
            counted(database_poses, "pose"),
            self.protocol
        )
    }

    fn over_time(&self) -> String {
        let plots: [(&str, Vec<(String, Case)>); 6] = [
            ("Numbers of control points", self.points()),
            ("Methods", self.methods()),
            ("Parameters", self.variants()),
            ("Window lengths", self.windows()),
            ("Sizes of the database", self.databases()),
            ("Noise", self.noises()),
        ];
        let varied: Vec<_> = plots.iter().filter(|(_, cases)| cases.len() > 1).collect();
        let shown = if varied.is_empty() { vec![&plots[1]] } else { varied };
        let mut figures = String::new();
        for (what, cases) in shown {
            let series: Vec<Series> =
                cases.iter().filter_map(|(name, case)| self.curve(name.clone(), case)).collect();
            let caption = format!("{what}. Otherwise as {}.", self.reference());
            let plot = LinePlot {
                caption: &caption,
                x_label: "time since the trial began, seconds",
                y_label: "RMS of joint angles, degrees",
                series: &series,
                shaded: None,
            };
            figures += &plot.figure();
        }
        let note = "Mean over the trials (line) and the middle half of them (band), for as long as at least a quarter of the trials lasts.";
        section("Error over time", note, &figures)
    }

    /// Error around the gaps, beside the same trials without; `None` without gaps.
    fn gaps(&self) -> Option<String> {
        let cases = self.beside(&|c| c.occlusion.map_or(String::new(), |o| o.to_string()), &|c| Case {
            occlusion: c.occlusion,
            ..self.reference.clone()
        });
        let mut figures = String::new();
        for (name, case) in cases.iter().filter(|(_, case)| case.occlusion.is_some()) {
            let hidden: Vec<&TrialResult> = self.for_case(case);
            let whole = self.for_case(&self.reference);
            let mut series = [Vec::new(), Vec::new()];
            for result in &hidden {
                let Some(gap) = &result.gap else { continue };
                let Some(same) = whole.iter().find(|r| r.trial == result.trial) else { continue };
                series[0].push((&result.comparison.frame_rms_deg[..], gap));
                series[1].push((&same.comparison.frame_rms_deg[..], gap));
            }
            let frames = case.occlusion.map_or(0, |o| o.frames);
            let series = [
                curves::around_gap(format!("hidden: {name}"), &series[0]),
                curves::around_gap("the same frames, nothing hidden".to_owned(), &series[1]),
            ];
            let caption =
                format!("Points hidden ({name}) from 0 s on, shaded. Otherwise as {}.", self.reference());
            let plot = LinePlot {
                caption: &caption,
                x_label: "time since the points were hidden, seconds",
                y_label: "RMS of joint angles, degrees",
                series: &series,
                shaded: Some((0.0, frames as f64 / motion_db::FRAME_RATE)),
            };
            figures += &plot.figure();
        }
        (!figures.is_empty()).then(|| {
            section("Around the gaps", "Mean over the trials and the middle half of them.", &figures)
        })
    }

    fn joints(&self) -> String {
        let mut cases = self.methods();
        if cases.len() < 2 {
            cases = self.points();
        }
        // The reference has the bars, the others the marks.
        cases.sort_by_key(|(_, case)| *case != self.reference);
        let groups: Vec<Vec<&Comparison>> = cases
            .iter()
            .map(|(_, case)| self.for_case(case).into_iter().map(|r| &r.comparison).collect())
            .collect();
        let names: Vec<String> = cases.into_iter().map(|(name, _)| name).collect();
        let caption = format!(
            "Mean angle between true and found rotation of each joint, degrees; {}.",
            self.reference()
        );
        let bars = curves::joint_bars(&groups);
        section("Joints", "", &BarPlot { caption: &caption, unit: "°", series: &names, bars: &bars }.figure())
    }

    fn worst(&self) -> String {
        let mut trials = self.for_case(&self.reference);
        trials.sort_by(|a, b| b.comparison.errors.rms_deg.total_cmp(&a.comparison.errors.rms_deg));
        trials.truncate(WORST);
        let columns =
            ["trial", "performer", "action", "RMS deg", "MAE deg", "geod deg", "MPJPE cm", "worst joint"];
        let mut table = Table::new("Worst trials", String::new(), 3, columns);
        let top = trials.iter().flat_map(|t| &t.comparison.frame_rms_deg).copied().fold(0.0, f64::max);
        let mut lines = Vec::new();
        for t in trials {
            let errors = t.comparison.errors;
            let worst = t.comparison.joints.iter().max_by(|a, b| a.geodesic_deg.total_cmp(&b.geodesic_deg));
            let joint = worst.map_or(String::new(), |j| format!("{} {:.1}°", j.joint, j.geodesic_deg));
            table.push(vec![
                Cell::text(t.trial.clone()),
                Cell::text(t.subject.clone()),
                Cell::text(t.action.clone()),
                Cell::Number(errors.rms_deg, 2),
                Cell::Number(errors.mae_deg, 2),
                Cell::Number(errors.geodesic_deg, 2),
                Cell::Number(errors.mpjpe_cm, 2),
                Cell::Text(joint),
            ]);
            lines.push(sparkline(&t.comparison.frame_rms_deg, top));
        }
        let note =
            format!("By RMS; {}. The line is the error over time, all on one scale.", self.reference());
        section(&table.title, &note, &table_html(&table, &lines))
    }
}
