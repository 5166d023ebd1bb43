//! The figures as Markdown and CSV.

use crate::race::Figure;
use std::fmt::Write;

const SETS: [&str; 6] = ["primary", "bounce", "random", "shadow", "bounce any", "random any"];

/// Date, CPU, compiler flags, commit: what a figure means nothing without.
pub fn machine(embree: Option<String>) -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let cpu = cpu.lines().find_map(|l| l.strip_prefix("model name")?.split_once(": ")).map_or("CPU unknown", |m| m.1);
    let output = |program: &str, args: &[&str]| {
        let output = std::process::Command::new(program).args(args).output().ok()?;
        Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
    };
    let rustc = output("rustc", &["-V"]).unwrap_or_default();
    let commit = output("git", &["-C", env!("CARGO_MANIFEST_DIR"), "describe", "--always", "--dirty"]);
    let simd: Vec<&str> = ["avx2", "fma", "avx512f"]
        .into_iter()
        .zip([is_x86("avx2"), is_x86("fma"), is_x86("avx512f")])
        .filter_map(|(name, has)| has.then_some(name))
        .collect();
    let built = if cfg!(target_feature = "avx2") { "native build" } else { "baseline build" };
    format!(
        "{}: {cpu} ({}); {rustc}, {built}; truehit {}; {}; one thread, CPU time.",
        output("date", &["-u", "+%F"]).unwrap_or_else(|| "no date".to_owned()),
        simd.join(", "),
        commit.unwrap_or_default(),
        embree.unwrap_or_else(|| "no Embree".to_owned()),
    )
}

fn is_x86(feature: &str) -> bool {
    #[cfg(target_arch = "x86_64")]
    return match feature {
        "avx2" => std::arch::is_x86_feature_detected!("avx2"),
        "fma" => std::arch::is_x86_feature_detected!("fma"),
        _ => std::arch::is_x86_feature_detected!("avx512f"),
    };
    #[cfg(not(target_arch = "x86_64"))]
    return !feature.is_ascii();
}

/// One line a figure.
pub fn csv(figures: &[Figure]) -> String {
    let mut out = String::from("mesh,engine,what,value\n");
    for f in figures {
        // Engine names hold commas.
        let _ = writeln!(out, "{},\"{}\",{},{}", f.mesh, f.engine, f.what, f.value);
    }
    out
}

/// The tables.
pub fn markdown(figures: &[Figure], engines: &[&str], notes: &[String]) -> String {
    let mut meshes: Vec<&str> = figures.iter().map(|f| f.mesh.as_str()).collect();
    meshes.dedup();
    let get = |mesh: &str, engine: &str, what: &str| {
        figures.iter().find(|f| f.mesh == mesh && f.engine == engine && f.what == what).map(|f| f.value)
    };
    let mut out = String::from("# truehit and its peers\n\n");
    let _ = writeln!(out, "{}\n", notes.join("\n\n"));

    let mut table = |title: &str, columns: &[String], cell: &dyn Fn(&str, usize) -> String| {
        let _ = writeln!(out, "## {title}\n\n| | {} |", columns.join(" | "));
        let _ = writeln!(out, "|---|{}", "---:|".repeat(columns.len()));
        for engine in engines {
            let cells: Vec<String> = (0..columns.len()).map(|i| cell(engine, i)).collect();
            let _ = writeln!(out, "| {engine} | {} |", cells.join(" | "));
        }
        out.push('\n');
    };
    let number = |x: Option<f64>, digits: usize| x.map_or("–".to_owned(), |x| format!("{x:.digits$}"));
    let sets = SETS.map(String::from);
    let geometric = |engine: &str, i: usize| {
        let what = format!("{} ratio", SETS[i]);
        let logs: Option<Vec<f64>> = meshes.iter().map(|m| get(m, engine, &what).map(f64::ln)).collect();
        logs.map(|l| (l.iter().sum::<f64>() / l.len() as f64).exp())
    };
    table(&format!("Speed, ratio to {}: geometric mean of {} meshes", engines[0], meshes.len()), &sets, &|e, i| {
        number(geometric(e, i), 2)
    });
    for mesh in &meshes {
        table(&format!("{mesh}: speed, ratio (Mray/s)"), &sets, &|e, i| {
            let ratio = number(get(mesh, e, &format!("{} ratio", SETS[i])), 2);
            format!("{ratio} ({})", number(get(mesh, e, &format!("{} Mray/s", SETS[i])), 1))
        });
    }
    let columns = |what: &[&str]| what.iter().map(|&w| w.to_owned()).collect::<Vec<_>>();
    for mesh in &meshes {
        let contested = |i: usize| get(mesh, "–", &format!("{} contested", SETS[i])).unwrap_or(0.0);
        let checked = |i: usize| get(mesh, "–", &format!("{} checked", SETS[i])).unwrap_or(0.0);
        let heads: Vec<String> =
            (0..6).map(|i| format!("{} ({} checked, {} contested)", SETS[i], checked(i), contested(i))).collect();
        table(
            &format!("{mesh}: answers that exact arithmetic contradicts: missed / invented / other triangle"),
            &heads,
            &|e, i| {
                let wrong = |kind: &str| number(get(mesh, e, &format!("{} {kind}", SETS[i])), 0);
                match SETS[i].ends_with("any") || SETS[i] == "shadow" {
                    true => format!("{} / {}", wrong("missed"), wrong("invented")),
                    false => format!("{} / {} / {}", wrong("missed"), wrong("invented"), wrong("other triangle")),
                }
            },
        );
    }
    for mesh in &meshes {
        let aimed = ["vertices", "edges", "faces"];
        let Some(total) = aimed.iter().map(|a| get(mesh, "–", &format!("rays aimed at {a}"))).sum::<Option<f64>>()
        else {
            continue;
        };
        table(
            &format!("{mesh}: rays that leak out, of {total} from inside, closest hit / any hit"),
            &columns(&["at vertices", "on edges", "on faces", "all"]),
            &|e, i| {
                let at = |kind: &str, i: usize| get(mesh, e, &format!("{kind} at {}", aimed[i])).unwrap_or(0.0);
                let sum = |kind: &str| if i < 3 { at(kind, i) } else { (0..3).map(|i| at(kind, i)).sum() };
                format!("{} / {}", sum("leaks"), sum("any-hit leaks"))
            },
        );
    }
    for mesh in &meshes {
        table(
            &format!("{mesh}: build on one thread, memory with its own mesh"),
            &columns(&["Mtri/s", "bytes/triangle", "at the peak"]),
            &|e, i| {
                let what = ["build Mtri/s", "bytes/triangle", "peak bytes/triangle"][i];
                number(get(mesh, e, what), if i == 0 { 2 } else { 0 })
            },
        );
    }
    out
}
