//! The examples, run as a user runs them: what they write, what they say, how they fail.
//!
//! `cargo test` builds them; `cargo test --test examples` alone does not: `cargo build --profile test --examples` does.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// An empty directory of this test's own.
fn directory(test: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn run(example: &str, directory: &Path, arguments: &[&str]) -> Output {
    // target/debug/deps/examples-… → target/debug/examples
    let built = std::env::current_exe().unwrap().parent().unwrap().with_file_name("examples");
    let program = built.join(format!("{example}{}", std::env::consts::EXE_SUFFIX));
    assert!(program.exists(), "{} is not built: run `cargo build --profile test --examples` first", program.display());
    Command::new(program).args(arguments).current_dir(directory).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn files(directory: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(directory).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Whether it wrote a picture with more than one colour in it, and nothing else.
fn assert_wrote(output: &Output, directory: &Path, name: &str, size: (u32, u32)) {
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "", "the progress bar must hide where there is no terminal");
    assert_eq!(files(directory), [name]);
    let picture = image::open(directory.join(name)).unwrap().into_rgb8();
    assert_eq!(picture.dimensions(), size);
    let first = picture.get_pixel(0, 0);
    assert!(picture.pixels().any(|pixel| pixel != first), "the picture is blank");
}

/// Whether it failed with `message` and left nothing behind.
fn assert_failed(output: &Output, directory: &Path, message: &str) {
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.starts_with("error: ") && stderr.contains(message), "{stderr:?} lacks {message:?}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert_eq!(text(&output.stdout), "");
    assert!(
        files(directory).iter().all(|name| Path::new(name).extension().is_some_and(|e| e == "obj")),
        "{:?}",
        files(directory)
    );
}

#[test]
fn each_writes_its_picture_and_says_what_it_took() {
    for example in ["render", "own_shape", "instancing"] {
        let directory = directory(&format!("writes-{example}"));
        let output = run(example, &directory, &["--size", "48x32", "--samples", "1"]);
        assert_wrote(&output, &directory, &format!("{example}.png"), (48, 32));
        let stdout = text(&output.stdout);
        let last = stdout.lines().last().unwrap();
        assert!(last.contains(" s, ") && last.contains("M rays (") && last.ends_with("M rays/s"), "{last}");
    }
}

#[test]
fn scenes_threads_and_output_can_be_chosen() {
    let directory = directory("chosen");
    let arguments = ["--scene", "flake", "--size", "30x40", "--samples", "2", "--threads", "1", "-o", "here.png"];
    assert_wrote(&run("render", &directory, &arguments), &directory, "here.png", (30, 40));
}

#[test]
fn the_signature_has_a_legend_that_adds_up() {
    let directory = directory("signature");
    let output = run("signature", &directory, &["--size", "60x40"]);
    assert_wrote(&output, &directory, "signature.png", (60, 40));
    let stdout = text(&output.stdout);
    let pixels = stdout.lines().filter_map(|line| line.split_whitespace().nth(2)?.parse::<usize>().ok());
    assert_eq!(pixels.sum::<usize>(), 60 * 40, "{stdout}");
    assert!(stdout.contains("moon gate (polygon with a hole)"), "{stdout}");
}

#[test]
fn meshes_are_framed() {
    let mesh = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/octahedron.obj");
    for size in ["64x32", "32x64"] {
        let directory = directory(&format!("mesh-{size}"));
        let output = run("render", &directory, &["--mesh", mesh, "--size", size, "--samples", "1"]);
        let (width, height) = size.split_once('x').unwrap();
        let (width, height) = (width.parse().unwrap(), height.parse().unwrap());
        assert_wrote(&output, &directory, "render.png", (width, height));
        // The mesh is clay and the rest is not: it is in the picture, and leaves a margin all around.
        let picture = image::open(directory.join("render.png")).unwrap().into_rgb8();
        let is_clay = |[r, _, b]: [u8; 3]| f64::from(r) > 1.4 * f64::from(b);
        let clay: Vec<_> = picture.enumerate_pixels().filter(|(_, _, pixel)| is_clay(pixel.0)).collect();
        println!("{size}: {} pixels of clay", clay.len());
        assert!(clay.len() > 100, "{}", clay.len());
        assert!(clay.iter().all(|(i, j, _)| (1..width - 1).contains(i) && (1..height - 1).contains(j)));
    }
}

#[test]
fn the_report_is_written_where_it_is_wanted() {
    let directory = directory("report");
    let arguments = ["--kernel", "plane", "--cases", "20", "--rounds", "3", "--out", "here"];
    let output = run("speed_vs_error", &directory, &arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "", "the progress bar must hide where there is no terminal");
    assert!(text(&output.stdout).contains("16 of them truehit's, of which 0 break their contract"));
    assert_eq!(files(&directory), ["here"]);
    let csv = fs::read_to_string(directory.join("here/speed-vs-error.csv")).unwrap();
    // Where it comes from, the columns, and 16 families by three kernels.
    assert_eq!(csv.lines().count(), 2 + 48);
    let page = fs::read_to_string(directory.join("here/speed-vs-error.md")).unwrap();
    assert!(page.contains("## Where truehit loses") && page.contains("No row breaks its contract"));

    let directory = self::directory("report-refused");
    assert_failed(&run("speed_vs_error", &directory, &["--kernel", "torus"]), &directory, "none of plane, triangle");
    assert_failed(&run("speed_vs_error", &directory, &[]), &directory, "--out DIR");
    assert_failed(&run("speed_vs_error", &directory, &["--cases", "some"]), &directory, "some");
}

#[test]
fn bad_meshes_are_refused_by_line() {
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for (name, content, message) in [
        ("position", "v 0 0 0\nv 1 zero 0\n".to_owned() + triangle, "position.obj, line 2: position"),
        ("face", format!("{triangle}\nf 1 2 x\n"), "face.obj, line 6: face"),
        ("last", format!("{triangle}f 1 2 x"), "last.obj, line 5: face"),
        ("range", format!("{triangle}\n# more\nf 1 2 4\ng next\nf 1 2 3\n"), "range.obj, line 7: face"),
        ("below", format!("{triangle}f -1 -2 -4\n"), "below.obj, line 5: face"),
        ("nan", format!("# not a number\nv nan 0 0\n{triangle}f 2 3 4\nf 1 2 3\n"), "nan.obj, line 2: a coordinate"),
        ("faceless", "v 0 0 0\n".to_owned(), "faceless.obj: no faces"),
        ("empty", String::new(), "empty.obj: no faces"),
        ("point", "v 1 1 1\nf 1 1 1\n".to_owned(), "single point"),
    ] {
        let directory = directory(&format!("bad-{name}"));
        let file = format!("{name}.obj");
        fs::write(directory.join(&file), content).unwrap();
        let output = run("render", &directory, &["--mesh", &file, "--size", "8x8", "--samples", "1"]);
        assert_failed(&output, &directory, message);
    }
}

#[test]
fn what_cannot_be_read_or_written_is_named() {
    let directory = directory("unreadable");
    for (arguments, message) in [
        (&["--mesh", "nowhere.obj"][..], "cannot read nowhere.obj"),
        (&["--output", "no/such/folder.png"], "cannot write no/such/folder.png"),
        (&["--output", "."], "cannot write ."),
        (&["--scene", "atlantis"], "\"atlantis\""),
        (&["--size", "0x10"], "960x640"),
        (&["--size", "10"], "960x640"),
        (&["--samples", "0"], "1 to 65536"),
        (&["--orbit", "0,90"], "30,20"),
        (&["--eye", "1,2"], "1.5,0,-2"),
        (&["--threads", "many"], "many"),
        (&["--bogus"], "--bogus"),
        (&["stray"], "stray"),
        (&["--mesh", "a.obj", "--scene", "gallery"], "exclude each other"),
    ] {
        let output = run("render", &directory, arguments);
        assert_failed(&output, &directory, message);
    }
    for example in ["signature", "own_shape", "instancing"] {
        assert_failed(&run(example, &directory, &["-o", "no/such/folder.png"]), &directory, "no/such/folder.png");
        assert_failed(&run(example, &directory, &["--mesh", "a.obj"]), &directory, "--mesh");
    }
}

#[test]
fn help_names_the_options() {
    let directory = directory("help");
    for example in ["render", "signature", "own_shape", "instancing"] {
        let output = run(example, &directory, &["--help"]);
        assert!(output.status.success());
        assert!(text(&output.stdout).contains("--size WIDTHxHEIGHT"));
    }
    assert_eq!(files(&directory), [""; 0]);
}
