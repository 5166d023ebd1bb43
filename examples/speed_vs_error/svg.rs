//! Plots, as small SVG files that follow the reader's light or dark scheme.

use std::fmt::Write;

/// Colours that keep their contrast on both grounds, by role.
pub const COLOURS: [&str; 6] = ["#d1495b", "#c97b12", "#2e86ab", "#3fa34d", "#8e6cc0", "#7a7f87"];

/// Told apart without their colours, too.
#[derive(Clone, Copy, Debug)]
pub enum Mark {
    Square,
    Circle,
    Diamond,
}

pub struct Svg {
    width: f64,
    height: f64,
    body: String,
}

impl Svg {
    pub fn new(width: f64, height: f64, title: &str) -> Self {
        let mut svg = Self { width, height, body: String::new() };
        svg.text(width / 2.0, 18.0, title, "middle", "title");
        svg
    }

    pub fn text(&mut self, x: f64, y: f64, text: &str, anchor: &str, class: &str) {
        let text = text.replace('&', "&amp;").replace('<', "&lt;");
        let _ =
            writeln!(self.body, r#"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}" class="{class}">{text}</text>"#);
    }

    /// Small, from below upwards, about a point.
    pub fn upright(&mut self, (x, y): (f64, f64), text: &str) {
        let _ = writeln!(
            self.body,
            r#"<text x="{x:.1}" y="{y:.1}" text-anchor="middle" class="small" transform="rotate(-90 {x:.1} {y:.1})">{text}</text>"#,
        );
    }

    pub fn line(&mut self, a: (f64, f64), b: (f64, f64), class: &str) {
        let ((x1, y1), (x2, y2)) = (a, b);
        let _ = writeln!(self.body, r#"<path d="M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}" class="{class}"/>"#);
    }

    pub fn polyline(&mut self, points: &[(f64, f64)], colour: &str, dash: &str) {
        let mut path = String::new();
        for (i, (x, y)) in points.iter().enumerate() {
            let _ = write!(path, "{}{x:.1} {y:.1}", if i == 0 { 'M' } else { 'L' });
        }
        let _ = writeln!(
            self.body,
            r#"<path d="{path}" fill="none" stroke="{colour}" stroke-width="1.8" stroke-dasharray="{dash}"/>"#
        );
    }

    /// Filled, or only its outline.
    pub fn mark(&mut self, (x, y): (f64, f64), shape: Mark, colour: &str, filled: bool, hint: &str) {
        let fill = if filled { colour } else { "none" };
        let hint = hint.replace('&', "&amp;").replace('<', "&lt;");
        let r = 3.0;
        let path = match shape {
            Mark::Square => {
                let r = 0.9 * r;
                format!("M{:.1} {:.1}h{}v{}h-{}z", x - r, y - r, 2.0 * r, 2.0 * r, 2.0 * r)
            }
            Mark::Circle => format!("M{:.1} {y:.1}a{r} {r} 0 1 0 {} 0a{r} {r} 0 1 0 -{} 0z", x - r, 2.0 * r, 2.0 * r),
            Mark::Diamond => {
                let r = 1.35 * r;
                format!("M{x:.1} {:.1}l{r:.2} {r:.2}l-{r:.2} {r:.2}l-{r:.2} -{r:.2}z", y - r)
            }
        };
        let _ = writeln!(
            self.body,
            r#"<path d="{path}" fill="{fill}" fill-opacity=".7" stroke="{colour}"><title>{hint}</title></path>"#
        );
    }

    pub fn rectangle(&mut self, x: f64, y: f64, w: f64, h: f64, fill: &str, opacity: f64) {
        let _ = writeln!(
            self.body,
            r#"<rect x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}" fill="{fill}" fill-opacity="{opacity:.3}"/>"#
        );
    }

    pub fn finish(self) -> String {
        let Self { width, height, body } = self;
        format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="system-ui, sans-serif" font-size="11">
<style>
.ground {{ fill: #ffffff }} text {{ fill: #24292f }} .title {{ font-size: 14px; font-weight: 600 }} .small {{ font-size: 9.5px }}
.axis {{ stroke: #57606a; fill: none }} .grid {{ stroke: #d8dee4; stroke-width: .6; fill: none }}
@media (prefers-color-scheme: dark) {{
.ground {{ fill: #0d1117 }} text {{ fill: #e6edf3 }} .axis {{ stroke: #9198a1 }} .grid {{ stroke: #30363d }}
}}
</style>
<rect class="ground" width="100%" height="100%"/>
{body}</svg>
"#
        )
    }
}

/// One axis: from data to pixels.
#[derive(Clone, Debug)]
pub struct Axis {
    pub label: String,
    low: f64,
    high: f64,
    log: bool,
}

impl Axis {
    /// Logarithmic, in whole decades around the values.
    pub fn decades(label: &str, low: f64, high: f64) -> Self {
        let (low, high) = (low.log10().floor(), high.log10().ceil().max(low.log10().floor() + 1.0));
        Self { label: label.to_owned(), low, high, log: true }
    }

    pub fn linear(label: &str, low: f64, high: f64) -> Self {
        Self { label: label.to_owned(), low, high, log: false }
    }

    /// 0..1 along the axis; what lies outside is drawn at its end.
    fn place(&self, x: f64) -> f64 {
        let x = if self.log { x.log10() } else { x };
        ((x - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }

    /// Where lines of the grid stand, with their labels.
    fn ticks(&self) -> Vec<(f64, String)> {
        if self.log {
            let step = (((self.high - self.low) / 6.0).ceil() as i32).max(1);
            let decades = self.low as i32..=self.high as i32;
            return decades.filter(|e| e % step == 0).map(|e| (10f64.powi(e), power_of_ten(e))).collect();
        }
        (0..=5)
            .map(|i| self.low + (self.high - self.low) * f64::from(i) / 5.0)
            .map(|x| (x, format!("{x:.3}").trim_end_matches('0').trim_end_matches('.').to_owned()))
            .collect()
    }
}

pub fn power_of_ten(e: i32) -> String {
    match e {
        0 => "1".to_owned(),
        1 => "10".to_owned(),
        _ => {
            let digits = e.to_string();
            let raised = digits.chars().map(|c| match c {
                '-' => '⁻',
                '1' => '¹',
                '2' => '²',
                '3' => '³',
                c => char::from_u32('⁰' as u32 + (c as u32 - '0' as u32)).expect("a digit"),
            });
            format!("10{}", raised.collect::<String>())
        }
    }
}

/// A frame with two axes inside a picture.
pub struct Panel {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
    x: Axis,
    y: Axis,
}

impl Panel {
    /// Draws the grid, the axes and their labels.
    pub fn draw(svg: &mut Svg, at: (f64, f64), size: (f64, f64), title: &str, x: Axis, y: Axis) -> Self {
        let panel = Self { left: at.0, top: at.1, width: size.0, height: size.1, x, y };
        let (right, bottom) = (panel.left + panel.width, panel.top + panel.height);
        for (value, label) in panel.x.ticks() {
            let (x, _) = panel.at(value, f64::NAN);
            svg.line((x, panel.top), (x, bottom), "grid");
            svg.text(x, bottom + 13.0, &label, "middle", "small");
        }
        for (value, label) in panel.y.ticks() {
            let (_, y) = panel.at(f64::NAN, value);
            svg.line((panel.left, y), (right, y), "grid");
            svg.text(panel.left - 5.0, y + 3.5, &label, "end", "small");
        }
        svg.line((panel.left, panel.top), (panel.left, bottom), "axis");
        svg.line((panel.left, bottom), (right, bottom), "axis");
        svg.text(panel.left + panel.width / 2.0, panel.top - 7.0, title, "middle", "");
        svg.text(panel.left + panel.width / 2.0, bottom + 27.0, &panel.x.label.clone(), "middle", "small");
        let at = (panel.left - 36.0, panel.top + panel.height / 2.0);
        svg.upright(at, &panel.y.label);
        panel
    }

    /// The pixel of a value.
    pub fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let px = if x.is_nan() { 0.0 } else { self.x.place(x) };
        let py = if y.is_nan() { 0.0 } else { self.y.place(y) };
        (self.left + px * self.width, self.top + (1.0 - py) * self.height)
    }
}

/// Names beside their marks, in one row.
pub fn legend(svg: &mut Svg, mut x: f64, y: f64, entries: &[(&str, Mark, &str, bool)]) {
    for &(name, mark, colour, filled) in entries {
        svg.mark((x, y - 4.0), mark, colour, filled, name);
        svg.text(x + 8.0, y, name, "start", "");
        x += 24.0 + 6.0 * name.chars().count() as f64;
    }
}
