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

/// Speed and error in one table.
pub fn section(out: &mut String) {
    out.push_str("## Meshes\n\n");
    let Ok(csv) = std::fs::read_to_string(format!("{RESULTS}/peers.csv")) else {
        let _ = writeln!(out, "`benches/peers` has not been run here: {RESULTS}/peers.csv is missing.\n");
        return;
    };
    // mesh,"engine",what,value
    let records: Vec<Record> = csv.lines().skip(1).filter_map(record).collect();
    let (mut engines, mut meshes): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
    for r in &records {
        if !meshes.contains(&r.mesh) {
            meshes.push(r.mesh);
        }
        if r.engine != "–" && !engines.contains(&r.engine) {
            engines.push(r.engine);
        }
    }
    let values = |engine: &str, what: &dyn Fn(&str) -> bool| -> Vec<f64> {
        records.iter().filter(|r| r.engine == engine && what(r.what)).map(|r| r.value).collect()
    };
    let sum = |engine: &str, what: &dyn Fn(&str) -> bool| values(engine, what).iter().sum::<f64>();
    let aimed = sum("–", &|w| w.starts_with("rays aimed"));
    let checked = sum("–", &|w| w.ends_with("checked"));
    let _ = write!(
        out,
        "From `benches/peers`, which is run by itself (its README says how) and quoted here:\n\n{}\
         Speed as ratios to {}, geometric means over the meshes, and in Mray/s; leaks of {aimed} rays from inside closed\n\
         meshes at vertices, edges and faces; answers that exact arithmetic contradicts among {checked} rays (contested ones\n\
         and an even sample), and the largest relative error of their λ.\n\n",
        quoted_notes(),
        engines.first().unwrap_or(&"–"),
    );
    let _ = writeln!(
        out,
        "| | {} | Mray/s primary | random | leaks: vertices | edges | faces | missed | invented | other triangle | λ off by |",
        SETS.join(" | ")
    );
    let _ = writeln!(out, "|---|{}", "---:|".repeat(15));
    let mean = |engine: &str, what: &str| {
        let values = values(engine, &|w| w == what);
        let logs = values.iter().map(|x| x.ln()).sum::<f64>() / values.len() as f64;
        if values.is_empty() { "–".to_owned() } else { format!("{:.2}", logs.exp()) }
    };
    for engine in &engines {
        let ratios = SETS.map(|set| mean(engine, &format!("{set} ratio")));
        let rates = ["primary", "random"].map(|set| mean(engine, &format!("{set} Mray/s")));
        let leaks = ["vertices", "edges", "faces"].map(|k| sum(engine, &|w| w == format!("leaks at {k}")).to_string());
        let wrong = ["missed", "invented", "other triangle"].map(|k| sum(engine, &|w| w.ends_with(k)).to_string());
        let off = values(engine, &|w| w.ends_with("λ error")).into_iter().fold(0.0, f64::max);
        let bold = if engine.starts_with("truehit") { "**" } else { "" };
        let _ = writeln!(
            out,
            "| {bold}{engine}{bold} | {} | {} | {} | {} | {off:.0e} |",
            ratios.join(" | "),
            rates.join(" | "),
            leaks.join(" | "),
            wrong.join(" | "),
        );
    }
    out.push('\n');
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
