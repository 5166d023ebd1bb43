//! The README's tables, between its markers.

use crate::page::{Page, ns, ulps};
use crate::peers::{self, Race, thousands};
use crate::support::cases::Kernel;
use std::fmt::Write;

/// What the textbook is represented by.
const REPRESENTATIVES: [(Kernel, &str, &str); 6] = [
    (Kernel::Plane, "textbook f64", "plane"),
    (Kernel::Triangle, "Möller–Trumbore f64", "triangle (Möller–Trumbore)"),
    (Kernel::Polygon, "odd/even f64", "polygon"),
    (Kernel::Sphere, "RT Gems 7 f64", "sphere (Ray Tracing Gems 7)"),
    (Kernel::Cylinder, "textbook f64", "cylinder"),
    (Kernel::Cone, "textbook f64", "cone"),
];

/// Puts the short forms in place; a README without markers is left alone.
pub fn update(page: &Page) -> std::io::Result<()> {
    let mut text = std::fs::read_to_string("README.md")?;
    replace(&mut text, "kernels", &kernels(page));
    if let Some(csv) = peers::results() {
        replace(&mut text, "race", &peers::short_form(&Race::new(&csv)));
    }
    std::fs::write("README.md", text)
}

fn replace(text: &mut String, name: &str, table: &str) {
    let (start, end) = (format!("<!-- speed_vs_error: {name} -->\n"), "<!-- end -->");
    if let Some(from) = text.find(&start).map(|at| at + start.len())
        && let Some(length) = text[from..].find(end)
    {
        text.replace_range(from..from + length, table);
    }
}

fn kernels(page: &Page) -> String {
    let mut out = String::from(
        "| kernel | ns on ordinary rays, textbook → truehit | largest λ error in ulp | wrong hits or misses per million |\n\
         |---|---|---|---|\n",
    );
    for (kernel, textbook, title) in REPRESENTATIVES {
        let (theirs, ours) = (page.sum(kernel, textbook), page.sum(kernel, "truehit"));
        let time = |s: &crate::page::Sum| s.ordinary.map_or("–".to_owned(), |t| ns(t.0.round()).replace(".0", ""));
        let wrong = |s: &crate::page::Sum| {
            let rate = (1e6 * s.wrong as f64 / s.cases as f64).round() as u64;
            thousands(if rate >= 10_000 { (rate + 500) / 1000 * 1000 } else { rate })
        };
        let _ = writeln!(
            out,
            "| {title} | {} → {} | {} → {} | {} → {} |",
            time(&theirs),
            time(&ours),
            ulps(theirs.ulps.last().copied()),
            ulps(ours.ulps.last().copied()),
            wrong(&theirs),
            wrong(&ours),
        );
    }
    out
}
