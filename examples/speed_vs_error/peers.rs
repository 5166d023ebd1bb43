//! The race against other crates and Embree, as `benches/peers` has left it.

use std::fmt::Write;

const RESULTS: &str = "benches/peers/results";
const SETS: [&str; 6] = ["primary", "bounce", "random", "shadow", "bounce any", "random any"];

struct Record<'a> {
    mesh: &'a str,
    engine: &'a str,
    what: &'a str,
    value: f64,
}

/// What the race has left in its CSV.
pub struct Race<'a> {
    records: Vec<Record<'a>>,
    engines: Vec<&'a str>,
}

/// The CSV's text, if there is one.
pub fn results() -> Option<String> {
    std::fs::read_to_string(format!("{RESULTS}/peers.csv")).ok()
}

impl<'a> Race<'a> {
    /// Of lines mesh,"engine",what,value.
    pub fn new(csv: &'a str) -> Self {
        let records: Vec<Record> = csv.lines().skip(1).filter_map(record).collect();
        let mut engines = Vec::new();
        for r in &records {
            if r.engine != "–" && !engines.contains(&r.engine) {
                engines.push(r.engine);
            }
        }
        Self { records, engines }
    }

    fn meshes(&self) -> usize {
        let mut meshes: Vec<&str> = self.records.iter().map(|r| r.mesh).collect();
        meshes.sort_unstable();
        meshes.dedup();
        meshes.len()
    }

    fn values(&self, engine: &str, what: impl Fn(&str) -> bool) -> impl Iterator<Item = f64> {
        self.records.iter().filter(move |r| r.engine == engine && what(r.what)).map(|r| r.value)
    }

    fn sum(&self, engine: &str, what: impl Fn(&str) -> bool) -> f64 {
        self.values(engine, what).sum()
    }

    /// Geometric, over the meshes.
    fn mean(&self, engine: &str, what: &str) -> String {
        let logs: Vec<f64> = self.values(engine, |w| w == what).map(f64::ln).collect();
        if logs.is_empty() {
            return "–".to_owned();
        }
        format!("{:.2}", (logs.iter().sum::<f64>() / logs.len() as f64).exp())
    }
}

/// Speed and error in one table.
pub fn section(out: &mut String) {
    out.push_str("## Meshes\n\n");
    let Some(csv) = results() else {
        let _ = writeln!(out, "`benches/peers` has not been run here: {RESULTS}/peers.csv is missing.\n");
        return;
    };
    let race = Race::new(&csv);
    let _ = write!(
        out,
        "From `benches/peers`, which is run by itself (its README says how) and quoted here:\n\n{}\
         Speed as ratios to {}, geometric means over the {} meshes, and in Mray/s; leaks of {} rays from inside closed\n\
         meshes at vertices, edges and faces; answers that exact arithmetic contradicts among {} rays (contested ones\n\
         and an even sample), and the largest relative error of their λ. Where nothing leaks of so many, fewer than {:.0} in a\n\
         million do, with 95 % confidence.\n\n",
        quoted_notes(),
        race.engines.first().unwrap_or(&"–"),
        race.meshes(),
        race.sum("–", |w| w.starts_with("rays aimed")),
        race.sum("–", |w| w.ends_with("checked")),
        3e6 / race.sum("–", |w| w.starts_with("rays aimed")).max(1.0),
    );
    let _ = writeln!(
        out,
        "| | {} | Mray/s primary | random | leaks: vertices | edges | faces | missed | invented | other triangle | λ off by |",
        SETS.join(" | ")
    );
    let _ = writeln!(out, "|---|{}", "---:|".repeat(15));
    for engine in &race.engines {
        let ratios = SETS.map(|set| race.mean(engine, &format!("{set} ratio")));
        let rates = ["primary", "random"].map(|set| race.mean(engine, &format!("{set} Mray/s")));
        let leaks =
            ["vertices", "edges", "faces"].map(|k| race.sum(engine, |w| w == format!("leaks at {k}")).to_string());
        let wrong = ["missed", "invented", "other triangle"].map(|k| race.sum(engine, |w| w.ends_with(k)).to_string());
        let off = race.values(engine, |w| w.ends_with("λ error")).fold(0.0, f64::max);
        let off = if off == 0.0 { "0".to_owned() } else { format!("{off:.0e}") };
        let bold = if engine.starts_with("truehit") { "**" } else { "" };
        let _ = writeln!(
            out,
            "| {bold}{engine}{bold} | {} | {} | {} | {} | {off} |",
            ratios.join(" | "),
            rates.join(" | "),
            leaks.join(" | "),
            wrong.join(" | "),
        );
    }
    out.push('\n');
}

/// The README's table: some engines, single rays' sets, all leaks.
pub fn short_form(race: &Race) -> String {
    let shown = [
        "Embree robust",
        "Embree robust, packets",
        "Embree fast",
        "truehit",
        "truehit, slices",
        "obvhs CWBVH",
        "parry3d",
    ];
    let mut out = format!(
        "| speed, {} = 1 | primary | bounce | random | shadow | leaks |\n|---|---:|---:|---:|---:|---:|\n",
        race.engines.first().unwrap_or(&"–")
    );
    for engine in shown.into_iter().filter(|e| race.engines.contains(e)) {
        let ratios = ["primary", "bounce", "random", "shadow"].map(|set| race.mean(engine, &format!("{set} ratio")));
        let leaks = thousands(race.sum(engine, |w| w.starts_with("leaks at")) as u64);
        let bold = if engine.starts_with("truehit") { "**" } else { "" };
        let name = engine.strip_suffix(", slices").map_or_else(
            || format!("{bold}{engine}{bold}"),
            |engine| format!("{bold}{engine}{bold}, `intersect_each`, `occludes_each`"),
        );
        let _ = writeln!(out, "| {name} | {} | {bold}{leaks}{bold} |", ratios.join(" | "));
    }
    out
}

/// 1,234,567
pub fn thousands(n: u64) -> String {
    if n < 1000 { n.to_string() } else { format!("{},{:03}", thousands(n / 1000), n % 1000) }
}

fn record(line: &str) -> Option<Record<'_>> {
    let (mesh, rest) = line.split_once(",\"")?;
    let (engine, rest) = rest.split_once("\",")?;
    let (what, value) = rest.rsplit_once(',')?;
    Some(Record { mesh, engine, what, value: value.parse().ok()? })
}

/// Machine, commit, meshes: the head of the race's own page.
fn quoted_notes() -> String {
    let page = std::fs::read_to_string(format!("{RESULTS}/peers.md")).unwrap_or_default();
    let head = page.lines().skip(1).take_while(|l| !l.starts_with("## ")).filter(|l| !l.is_empty());
    let quoted: Vec<String> = head.map(|l| format!("> {l}")).collect();
    if quoted.is_empty() { String::new() } else { quoted.join("\n>\n") + "\n\n" }
}
