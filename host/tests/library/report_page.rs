//! The report as a file: small, shut to the network, safe against names out of files, and drawn by
//! a real browser without an error.

use jointwatch::assess::compare;
use jointwatch::diagnose::{self, add};
use jointwatch::fit::identify;
use jointwatch::model::file::ModelFile;
use jointwatch::report::page::{self, Asked};
use jointwatch::simulate::{Hide, SimulationOptions, simulate};
use jointwatch::study::Study;
use serde_json::Value;
use std::process::Command;

const SEED: u64 = 3;
/// Largest page without its data.
const MAX_FRAME: usize = 400_000;
/// Largest page with its data, bytes.
const MAX_PAGE: usize = 2_000_000;

/// A rig whose joint has dry friction that its study does not list, and the base model.
fn rig() -> (Study, ModelFile) {
    println!("seed {SEED}");
    let options = SimulationOptions {
        seed: SEED,
        duration_s: 4.0,
        hidden: Some(Hide {
            effect: "coulomb@x".into(),
            share: 0.15,
        }),
        ..SimulationOptions::default()
    };
    let study = simulate(&options).unwrap().study;
    let model = identify::physical(&study).unwrap().model;
    (study, model)
}

fn asked<'a>(study: &'a Study, model: &'a ModelFile) -> Asked<'a> {
    Asked {
        answer: None,
        command: "jointwatch compare study.toml model.json --report page.html".into(),
        study,
        model,
        before: None,
        steps: Vec::new(),
        floors: None,
        judged_on: "validation records".into(),
        diagnosis: None,
        verdict_after: None,
        remarks: Vec::new(),
        response: None,
    }
}

/// The JSON in the page.
fn contents(page: &str) -> Value {
    let (_, after) = page
        .split_once("<script id=\"contents\" type=\"application/json\">")
        .expect("the page holds its contents");
    let (json, _) = after.split_once("</script>").expect("the contents end");
    assert!(!json.contains('<'), "nothing in the contents can end them");
    serde_json::from_str(json).expect("the contents are JSON")
}

fn chromium() -> Option<&'static str> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    names.into_iter().find(|name| {
        let found = Command::new(name).arg("--version").output();
        found.is_ok_and(|o| o.status.success())
    })
}

/// The page as a browser leaves it after its scripts have run; none where there is no browser.
fn drawn(page: &str) -> Option<String> {
    let Some(browser) = chromium() else {
        eprintln!("SKIPPED: there is no chromium, so no browser has drawn this page");
        return None;
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.html");
    std::fs::write(&file, page).unwrap();
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--enable-logging=stderr",
            "--dump-dom",
        ])
        .args(["--virtual-time-budget=10000", "--window-size=1280,800"])
        .arg(format!(
            "--user-data-dir={}",
            folder.path().join("profile").display()
        ))
        .arg(format!("file://{}", file.display()))
        .output()
        .unwrap();
    let log = String::from_utf8_lossy(&output.stderr);
    let console: Vec<&str> = log.lines().filter(|l| l.contains("CONSOLE")).collect();
    assert!(console.is_empty(), "the console holds {console:#?}");
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn assert_drawn(dom: &str) {
    let root = dom.lines().find(|l| l.contains("<html")).unwrap_or(dom);
    assert!(
        root.contains("data-drawn=\"all\""),
        "not everything was drawn: {root}"
    );
    assert!(!root.contains("data-error"), "{root}");
}

#[test]
fn before_and_after_are_on_one_page_and_a_browser_draws_it() {
    let (study, model) = rig();
    let added = add::add(&study, &model, &["coulomb@x".to_string()]).unwrap();
    let page = page::html(&Asked {
        before: Some(&model),
        ..asked(&study, &added.model)
    })
    .unwrap();
    let contents = contents(&page);
    let data = contents.to_string().len();
    println!("{} bytes, {data} of them data", page.len());
    assert!(page.len() <= MAX_PAGE);
    assert!(page.len() - data.min(page.len()) <= MAX_FRAME);

    // The figures are those of `compare`.
    let compared = compare::compare(&study, &added.model).unwrap();
    for (shown, record) in contents["records"]
        .as_array()
        .unwrap()
        .iter()
        .zip(&compared.records)
    {
        assert_eq!(shown["file"], *record.file);
        let figures = &record.axes["x"];
        let after = &shown["axes"][0]["versions"][1];
        assert_eq!(
            after["relative_error"].as_f64(),
            Some(figures.relative_error)
        );
        assert_eq!(after["peak_error"].as_f64(), Some(figures.peak_error));
    }
    let rms = |version: usize| {
        let plane = &contents["axes"][0]["residual"][version]["plane"]["rms"];
        let cells = plane.as_array().unwrap().iter().filter_map(Value::as_f64);
        cells.fold(0.0, f64::max)
    };
    assert!(rms(1) < 0.5 * rms(0), "{} {}", rms(0), rms(1));
    assert!(contents["answer"].as_str().unwrap().contains("falls from"));

    // Nothing is fetched, and the policy says so.
    assert!(page.contains("Content-Security-Policy"));
    assert!(page.contains("default-src 'none'") && !page.contains("unsafe-inline"));
    for fetching in [
        "src=",
        "href=",
        "url(",
        "@import",
        "fetch(",
        "XMLHttpRequest",
        "import(",
    ] {
        assert!(!page.contains(fetching), "{fetching} in the page");
    }
    if let Some(dom) = drawn(&page) {
        assert_drawn(&dom);
        assert!(
            dom.matches("<canvas").count() >= 12,
            "every plot has its canvas"
        );
        assert!(dom.contains("coulomb@x"));
    }
}

#[test]
fn a_diagnosis_shows_its_candidates_with_their_forces() {
    let (study, model) = rig();
    let diagnosis = diagnose::diagnose(&study, &model).unwrap();
    let page = page::html(&Asked {
        floors: Some(diagnosis.noise_floor.clone()),
        diagnosis: Some(&diagnosis),
        ..asked(&study, &model)
    })
    .unwrap();
    let contents = contents(&page);
    let candidates = contents["candidates"].as_array().unwrap();
    assert_eq!(candidates.len(), diagnosis.ranked.len().min(8));
    let best = &diagnosis.ranked[0];
    assert_eq!(
        candidates[0]["name"],
        format!("{}@{}", best.effect, best.axis)
    );
    let forces = contents["records"].as_array().unwrap().iter();
    let mut forces = forces.flat_map(|r| r["axes"].as_array().unwrap());
    assert!(forces.any(|a| {
        a["candidates"]
            .as_array()
            .is_some_and(|c| c.iter().any(Value::is_object))
    }));
    if let Some(dom) = drawn(&page) {
        assert_drawn(&dom);
        assert!(dom.contains("What could be missing"));
    }
}

#[test]
fn names_out_of_files_do_not_run() {
    let (mut study, model) = rig();
    let hostile = "</script><script>document.documentElement.dataset.error='ran'</script><img onerror=alert(1)>";
    study.name = hostile.into();
    study.notes.push(format!("columns not used: {hostile}"));
    for record in &mut study.records {
        record.file = format!("{hostile}{}", record.file);
    }
    let page = page::html(&asked(&study, &model)).unwrap();
    assert_eq!(contents(&page)["title"], hostile);
    // The contents and the scripts, and no more.
    assert_eq!(page.matches("<script").count(), 2);
    assert!(!page.contains("<img"));
    if let Some(dom) = drawn(&page) {
        assert_drawn(&dom);
        assert!(
            dom.contains("&lt;img onerror"),
            "the name is shown as it is"
        );
    }
}
