//! A project: reopening it, its versions, pictures without the part, wrongly refused pictures, and the end of the
//! server.

use std::net::TcpListener;
use std::path::Path;

use image::{Rgb, RgbImage};
use sdg_demonstration::Annotation;
use serde_json::json;

use super::page::{BOX, HOLD, Page, repository, shipped_photo};
use super::photo_to_grasp::patiently;

/// Opens a project with copies of the pendulum's photo under these names, each with the shipped marks.
pub fn open(further: &[&str], photos: &[&str]) -> Page {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("project");
    std::fs::create_dir(&project).unwrap();
    let marks = std::fs::read_to_string(repository().join("datasets/demonstrations/pendulum/annotation.json")).unwrap();
    for name in photos {
        std::fs::copy(shipped_photo(), project.join(format!("{name}.png"))).unwrap();
        let marks = marks.replace("image.png", &format!("{name}.png"));
        std::fs::write(project.join(format!("{name}.json")), marks).unwrap();
    }
    let page = Page::open_in(folder, &[&["project"], further].concat());
    shown(&page);
    page
}

fn shown(page: &Page) {
    page.wait_for("the photo", "const p = document.getElementById('photo'); return p.complete && p.naturalWidth");
    page.wait_for("the marks", "return document.querySelectorAll('.todo li.done').length === 3");
}

pub fn annotation(path: &Path) -> Annotation {
    let facts = sdg_demonstration::ImageFacts { width: 640, height: 480, file_name: None };
    Annotation::read(&std::fs::read(path).unwrap(), &facts).unwrap().remove(0)
}

/// A port that was free a moment ago.
pub fn free_port() -> String {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port().to_string()
}

/// Waits until the browser keeps marks on photo.png that were not saved.
pub fn are_kept(page: &Page) {
    let kept = "return Object.entries(localStorage).some(([key, kept]) =>
        key.startsWith('kept-marks:') && kept.includes('photo.png'))";
    page.wait_for("kept here", kept);
}

fn teach_s(page: &Page, count: usize) {
    page.click("#tab-teach");
    page.choose_model("S");
    page.click("#teach-start");
    let taught = format!("return document.querySelectorAll('#version-list li').length === {count}");
    patiently(page, "a version", &taught);
}

fn try_picture(page: &Page, name: &str, picture: &RgbImage) {
    let path = page.folder.path().join(name);
    picture.save(&path).unwrap();
    page.click("#tab-try");
    page.browser.find("#picture-input").unwrap().type_text(path.to_str().unwrap()).unwrap();
    page.wait_for(name, &format!("return document.getElementById('photo').alt === 'Photo {name}'"));
    // The answer for the previous picture stays until the next frame.
    page.settle_frames();
    patiently(
        page,
        "an answer",
        "return /Nothing is accepted|Found the part/.test(document.getElementById('found').innerText)",
    );
}

fn photo() -> RgbImage {
    image::open(shipped_photo()).unwrap().into_rgb8()
}

/// The photo with half of the part covered.
fn half_covered() -> RgbImage {
    let mut picture = photo();
    for y in 150..300 {
        for x in 318..400 {
            picture.put_pixel(x, y, Rgb([120, 130, 70]));
        }
    }
    picture
}

/// Two copies of the part: its surroundings are copied to another corner.
fn two_parts() -> RgbImage {
    let mut picture = photo();
    let [x, y, width, height] = [BOX[0] - 8.0, BOX[1] - 8.0, BOX[2] - BOX[0] + 16.0, BOX[3] - BOX[1] + 16.0];
    let part = image::imageops::crop_imm(&picture, x as u32, y as u32, width as u32, height as u32).to_image();
    image::imageops::replace(&mut picture, &part, 10, 10);
    picture
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn several_found_ones_have_numbers() {
    let page = open(&[], &["photo"]);
    teach_s(&page, 1);
    try_picture(&page, "two.png", &two_parts());
    page.settle_frames();
    let found = page.text("#found");
    assert!(found.contains("1: Found the part") && found.contains("2: Found the part"), "{found}");
    let tags =
        "return [...document.querySelectorAll('#overlay .tag')].map((tag) => tag.textContent.slice(0, 2)).sort()";
    assert_eq!(page.browser.run(tags, &[]).unwrap(), json!(["1:", "2:"]));
    let places = "return [...document.querySelectorAll('#found .pose')].map((p) => p.innerText)";
    for place in page.browser.run(places, &[]).unwrap().as_array().unwrap() {
        let place = place.as_str().unwrap();
        assert!(place.starts_with("x ") && place.contains(" px, ") && place.contains('°'), "{place}");
    }
    page.screenshot("project-11-two");
    page.assert_accessible("two found");

    // The minimum score applies to the list, to the picture and to the row.
    let count = page.text("#least-score-count");
    assert!(count.starts_with("Found 2 of ") && count.contains("at 0.50, in 1 of 1 pictures"), "{count}");
    let slide =
        "const s = document.getElementById('least-score'); s.value = arguments[0]; s.dispatchEvent(new Event('input'))";
    page.browser.run(slide, &[json!("1")]).unwrap();
    page.wait_for("nothing", "return document.getElementById('found').innerText.includes('Nothing is accepted')");
    let count = page.text("#least-score-count");
    assert!(count.starts_with("Found 0 of ") && count.contains("--min-score 1.00"), "{count}");
    assert!(page.text("#strip").contains("nothing found"), "{}", page.text("#strip"));
    page.screenshot("project-13-least-score");
    page.assert_accessible("nothing at the highest least score");
    page.browser.run(slide, &[json!("0.5")]).unwrap();

    // Zoomed in, the part fills more of the stage.
    let scale = "return document.getElementById('photo').getBoundingClientRect().width";
    let whole = page.browser.run(scale, &[]).unwrap().as_f64().unwrap();
    page.browser
        .run("[...document.querySelectorAll('#found button')].find((b) => b.innerText === 'Zoom to it').click()", &[])
        .unwrap();
    page.wait_for("the part to fill the stage", &format!("{scale} > {}", 1.5 * whole));

    // Another picture, without detections, comes first when the row is sorted.
    try_picture(&page, "empty.png", &RgbImage::from_pixel(640, 480, Rgb([140, 140, 135])));
    let row = "return [...document.querySelectorAll('#strip button')].map((b) => b.children[1].innerText)";
    assert_eq!(page.browser.run(row, &[]).unwrap(), json!(["two.png", "empty.png"]));
    for by in ["score", "state"] {
        let sort = "const s = document.getElementById('sort-pictures'); s.value = arguments[0]; s.dispatchEvent(new Event('change'))";
        page.browser.run(sort, &[json!("added")]).unwrap();
        page.browser.run(sort, &[json!(by)]).unwrap();
        page.settle_frames();
        assert_eq!(page.browser.run(row, &[]).unwrap(), json!(["empty.png", "two.png"]), "{by}");
    }
    page.click("#strip li:nth-child(2) button");
    page.wait_for("the other picture", "return document.getElementById('photo').alt === 'Photo two.png'");
    // The detections in all pictures as files: CSV, or JSON with one object per picture.
    let saved = |css: &str| {
        let script = "const made = URL.createObjectURL; let blob;
            URL.createObjectURL = (given) => made.call(URL, (blob = given));
            document.querySelector(arguments[0]).click(); URL.createObjectURL = made; return blob.text()";
        page.browser.run(script, &[json!(css)]).unwrap().as_str().unwrap().to_owned()
    };
    let csv = saved("#save-csv");
    let lines: Vec<&str> = csv.lines().collect();
    assert!(lines[0].starts_with("image,number,found,score,x_px,y_px,angle_deg,width_px"), "{csv}");
    assert!(lines.iter().filter(|line| line.starts_with("two.png,") && line.contains(",true,")).count() == 2, "{csv}");
    assert!(lines.iter().any(|line| line.starts_with("empty.png,")), "{csv}");
    let records: Vec<serde_json::Value> =
        saved("#save-json").lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((&records[0]["image"], records.len()), (&json!("two.png"), 2));
    let grasp = &records[0]["detections"][0]["grasp"];
    assert!(grasp["x"].is_number() && grasp["angle_deg"].is_number() && grasp["width_px"].is_number(), "{grasp}");
    page.screenshot("project-14-sorted");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_refused_one_says_why_and_is_learnt_from() {
    let page = open(&[], &["photo"]);
    teach_s(&page, 1);
    try_picture(&page, "covered.png", &half_covered());
    page.settle_frames();
    let found = page.text("#found");
    assert!(found.contains("Refused") && found.contains("Why:"), "{found}");
    assert!(found.contains("Right after all: learn from it") && found.contains("The part is not here"), "{found}");
    let dots = "return document.querySelectorAll('#overlay .differs path').length";
    assert!(page.browser.run(dots, &[]).unwrap().as_u64().unwrap() > 0, "where it differs is shown");
    page.screenshot("project-1-refused");
    page.click("#show-differences");
    page.settle_frames();
    assert_eq!(page.browser.run(dots, &[]).unwrap(), json!(0), "what differs can be switched off");
    page.assert_accessible("without the marks of what differs");
    page.click("#show-differences");
    page.settle_frames();
    page.assert_accessible("a refused detection");
    page.click(".found button");
    page.wait_for(
        "a demonstration",
        "return document.getElementById('found').innerText.includes('Now a demonstration')",
    );
    // Model S is taught in seconds: it learns immediately, and the page reports the effect, even if there is none.
    let told = "const text = document.getElementById('learnt').innerText; return text.startsWith('The new model finds') && text";
    patiently(&page, "the change", told);
    page.settle_frames();
    let learnt = page.text("#learnt");
    assert!(learnt.contains("of 1 pictures; the one before: in 0."), "{learnt}");
    let is_found = page.text("#found").contains("Found the part");
    assert!(
        learnt.contains(if is_found { "In 1 picture more is found: covered.png." } else { "No picture has changed" }),
        "{learnt}"
    );
    page.screenshot("project-16-learnt");
    page.assert_accessible("what was learnt");
    let marks = page.folder.path().join("project/covered.json");
    let facts = sdg_demonstration::ImageFacts { width: 640, height: 480, file_name: Some("covered.png") };
    let read = Annotation::read(&std::fs::read(marks).unwrap(), &facts).unwrap().remove(0);
    let grasp = read.grasp.unwrap().center();
    assert!((grasp.x - HOLD[0]).hypot(grasp.y - HOLD[1]) < 40.0, "{grasp:?}");
    // A picture declared to be without the part makes the model outdated.
    try_picture(&page, "empty.png", &RgbImage::from_pixel(640, 480, Rgb([140, 140, 135])));
    let not_here =
        "[...document.querySelectorAll('#found button')].find((b) => b.innerText === 'The part is not here').click()";
    page.browser.run(not_here, &[]).unwrap();
    page.wait_for("its word", "return document.getElementById('found').innerText.includes('You said that')");
    page.click("#tab-teach");
    page.wait_for(
        "the version to be stale",
        "return document.getElementById('version-list').innerText.includes('stale')",
    );
    page.wait_for("the old result", "return !document.getElementById('teach-old').hidden");
    page.screenshot("project-2-stale");
    page.assert_accessible("versions");
    // "Teach again" also works in the last step.
    page.click("#tab-try");
    assert!(page.text("#try-intro").contains("This model is old"), "{}", page.text("#try-intro"));
    let again = "[...document.querySelectorAll('#found button')].find((b) => b.innerText === 'Teach again').click()";
    page.browser.run(again, &[]).unwrap();
    let taught = "return document.querySelectorAll('#version-list li').length === 3
        && document.getElementById('teach-old').hidden && !document.getElementById('go-try').hidden";
    patiently(&page, "another version", taught);
    // With another symmetry the result is outdated, until the earlier symmetry is chosen again.
    page.click("#tab-teach");
    for (turns, is_old) in [("2", true), ("1", false)] {
        let choose = format!("document.querySelector('[name=symmetry][value=\"{turns}\"]').click()");
        page.browser.run(&choose, &[]).unwrap();
        page.wait_for("the result's age", &format!("return document.getElementById('teach-old').hidden !== {is_old}"));
    }
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_picture_without_the_part_is_kept_and_versions_are_compared_after_opening_again() {
    let mut page = open(&[], &["photo"]);
    teach_s(&page, 1);
    try_picture(&page, "other.png", &image::imageops::rotate180(&photo()));
    try_picture(&page, "empty.png", &RgbImage::from_pixel(640, 480, Rgb([140, 140, 135])));
    let not_here =
        "[...document.querySelectorAll('#found button')].find((b) => b.innerText === 'The part is not here')";
    page.browser.run(&format!("{not_here}.click()"), &[]).unwrap();
    page.wait_for(
        "its word",
        "return document.getElementById('found').innerText.includes('You said that the part is not here')",
    );
    page.settle_frames();
    page.screenshot("project-3-not-here");
    page.assert_accessible("a picture without the part");
    teach_s(&page, 2);
    assert!(page.text("#version-list").contains("1 without the part"), "{}", page.text("#version-list"));

    // After closing and reopening, everything is still there. The page is closed first; otherwise it would call the
    // server in between.
    page.browser.open("about:blank").unwrap();
    page.stop_server();
    page.start_server();
    page.browser.open(&page.url.clone()).unwrap();
    shown(&page);
    page.click("#tab-teach");
    page.wait_for("both versions", "return document.querySelectorAll('#version-list li').length === 2");
    let preselected = "return document.querySelector('[name=model]:checked').value";
    assert_eq!(page.browser.run(preselected, &[]).unwrap(), json!("S"));
    for number in [1, 2] {
        page.click(&format!("#version-list li:nth-child({number}) input"));
        page.settle_frames();
    }
    page.click("#version-list li:nth-child(2) button");
    let compared = "const text = document.getElementById('compared').innerText;
        return text.includes('other.png') && text.includes('empty.png') && text";
    patiently(&page, "the table", compared);
    // Each checkbox is beside its label, the button is inside the card, and "in use" does not look like a warning.
    let layout = "const cards = [...document.querySelectorAll('#version-list li')];
        const middle = (r) => (r.top + r.bottom) / 2, rect = (e) => e.getBoundingClientRect();
        const word = (label) => { const range = document.createRange(); range.selectNode(label.lastChild); return rect(range); };
        const beside = cards.every((card) => { const label = card.querySelector('label');
            return Math.abs(middle(rect(label.firstChild)) - middle(word(label))) < 4; });
        const inside = cards.every((card) => [...card.querySelectorAll('button')].every((b) =>
            rect(b).right <= rect(card).right && rect(b).bottom <= rect(card).bottom));
        return [beside, inside, document.querySelector('.used').innerText, getComputedStyle(document.querySelector('.used')).color !==
            getComputedStyle(document.querySelector('.stale')).color]";
    assert_eq!(page.browser.run(layout, &[]).unwrap(), json!([true, true, "in use", true]));
    page.screenshot("project-4-compared");
    page.assert_accessible("two versions compared");
    page.click("#version-list li:nth-child(1) button");
    page.wait_for("the first in use", "return document.querySelector('#version-list li').innerText.includes('in use')");
    page.click("#tab-try");
    page.wait_for("what was said", "return document.getElementById('strip').innerText.includes('✓ not here')");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn unreadable_pictures_are_named_until_the_note_is_confirmed() {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("project");
    std::fs::create_dir(&project).unwrap();
    std::fs::copy(shipped_photo(), project.join("photo.png")).unwrap();
    for name in ["cut", "short"] {
        std::fs::write(project.join(format!("{name}.png")), &std::fs::read(shipped_photo()).unwrap()[..200]).unwrap();
    }
    let page = Page::open_in(folder, &["project"]);
    page.wait_for("the photo", "const p = document.getElementById('photo'); return p.complete && p.naturalWidth");
    // Other notes end after 3.5 seconds.
    std::thread::sleep(std::time::Duration::from_secs(5));
    let sentences = "return [...document.querySelectorAll('#toasts p')].map((p) => p.innerText)";
    let sentences = page.browser.run(sentences, &[]).unwrap();
    let sentences: Vec<&str> = sentences.as_array().unwrap().iter().map(|one| one.as_str().unwrap()).collect();
    assert_eq!(sentences.len(), 2, "{sentences:?}");
    for (name, sentence) in ["cut.png", "short.png"].iter().zip(&sentences) {
        assert!(sentence.contains(name) && sentence.ends_with("this picture is left out."), "{sentence}");
    }
    page.screenshot("project-9-unreadable");
    page.assert_accessible("unreadable pictures");
    page.click("#toasts button");
    page.wait_for("no note", "return document.getElementById('toasts').children.length === 0");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn the_server_s_end_is_told_and_marks_are_kept_in_the_browser() {
    let mut page = open(&["--port", &free_port(), "--token-file", "key"], &["earlier", "photo", "third"]);
    // The photo is removed, restored and removed again: the restarted server gives the other photo the number of the
    // removed one.
    for again in [true, false] {
        page.click("#remove-photo");
        page.wait_for("the other photo", "return document.getElementById('photo').alt === 'Photo photo.png'");
        page.settle_frames();
        if again {
            page.screenshot("project-8-taken-out");
            page.assert_accessible("a photo taken out");
            page.click("#toasts button");
            page.wait_for("it again", "return document.getElementById('photo').alt === 'Photo earlier.png'");
        }
    }
    let address = |page: &Page| page.browser.run("return document.getElementById('photo').src", &[]).unwrap();
    let shown = address(&page);
    page.stop_server();
    page.wait_for("the banner", "return !document.getElementById('lost').hidden");
    page.settle_frames();
    page.screenshot("project-5-lost");
    page.assert_accessible("without its server");
    assert_eq!(page.browser.run("return document.getElementById('photo').naturalWidth", &[]).unwrap(), json!(640));
    for _ in 0..5 {
        page.browser.press(&["]"]).unwrap();
    }
    are_kept(&page);
    assert!(page.text("#saved").starts_with("Not saved"), "{}", page.text("#saved"));
    // photo.json is a LabelMe file and stays unchanged: changes are written beside it.
    let saved = page.folder.path().join("project/photo.coco.json");
    assert!(!saved.exists());
    page.start_server();
    page.wait_for("no banner", "return document.getElementById('lost').hidden");
    let line = page.wait_for(
        "saved",
        "const line = document.getElementById('saved').innerText; return line.startsWith('Saved in') && line",
    );
    assert_eq!(line, json!("Saved in photo.coco.json"));
    let turned = |path: &Path| annotation(path).grasp.unwrap().angle();
    let by = turned(&saved).degrees() - turned(&saved.with_file_name("photo.json")).degrees();
    assert!((by - 5.0).abs() < 0.1, "five keys turn by five degrees: {by}");
    assert!(!saved.with_file_name("earlier.coco.json").exists(), "the other photo is left alone");
    // The next photo has the number that this one had before; the browser must not take it for this one.
    page.browser.press(&["n"]).unwrap();
    page.wait_for("the next photo", "return document.getElementById('photo').alt === 'Photo third.png'");
    assert_ne!(address(&page), shown);
    page.wait_for(
        "nothing kept any more",
        "return !Object.keys(localStorage).some((key) => key.startsWith('kept-marks'))",
    );

    // Restarted with another token, the server refuses this page, which says what to do.
    page.stop_server();
    std::fs::remove_file(page.folder.path().join("key")).unwrap();
    page.start_server();
    page.wait_for("the other key", "return document.getElementById('lost').innerText.includes('another key')");
    page.settle_frames();
    page.screenshot("project-9-another-key");
    page.assert_accessible("another key");
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_photo_that_is_opened_during_a_drag_does_not_get_its_marks() {
    let page = open(&[], &["a", "b"]);
    let pointer = |actions: serde_json::Value| {
        let mouse =
            json!({"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions});
        page.browser.perform(&json!([mouse])).unwrap();
    };
    let to = |[x, y]: [f64; 2]| json!({"type": "pointerMove", "duration": 20, "x": x.round(), "y": y.round()});
    let [x, y] = page.handle("[data-edge='se'] .knob");
    pointer(json!([to([x, y]), {"type": "pointerDown", "button": 0}, to([x - 20.0, y])]));
    page.browser.press(&["n"]).unwrap();
    page.settle_frames();
    assert_eq!(page.browser.run("return document.getElementById('photo').alt", &[]).unwrap(), json!("Photo a.png"));
    page.browser.run("document.querySelectorAll('#strip button')[1].click()", &[]).unwrap();
    pointer(json!([to([x - 40.0, y]), {"type": "pointerUp", "button": 0}]));
    let unchanged = "return import('/page/store.js').then(({ state }) => [state.current,
        ...state.images.map((photo) => JSON.stringify(photo.marks) === photo.committed && !photo.past.length)])";
    assert_eq!(page.browser.run(unchanged, &[]).unwrap(), json!([1, true, true]));
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn marks_that_another_page_changed_are_adopted_when_this_one_is_used_again() {
    let page = open(&[], &["photo"]);
    let saved = page.folder.path().join("project/photo.coco.json");
    let before = annotation(&saved.with_file_name("photo.json")).bbox.x1;
    let change = "return import('/page/store.js').then(({ state }) => {
            const marks = structuredClone(state.images[0].marks);
            marks.box[0] -= 5;
            return fetch('/api/images/0/marks', { method: 'PUT', body: JSON.stringify(marks) });
        }).then((answer) => { dispatchEvent(new Event('focus')); return answer.ok; })";
    assert_eq!(page.browser.run(change, &[]).unwrap(), json!(true));
    page.wait_for("the change", "return !document.getElementById('undo').disabled");
    page.browser.press(&["]"]).unwrap();
    page.settle();
    let after = annotation(&saved).bbox.x1;
    assert!((after - (before - 5.0)).abs() < 0.1, "{before} {after}");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn kept_marks_wait_for_their_project_while_another_is_open_at_the_same_port() {
    let mut page = open(&["--port", &free_port(), "--token-file", "key"], &["photo"]);
    let [project, other] = ["project", "other"].map(|name| page.folder.path().join(name));
    std::fs::create_dir(&other).unwrap();
    for name in ["photo.png", "photo.json"] {
        std::fs::copy(project.join(name), other.join(name)).unwrap();
    }
    page.stop_server();
    page.wait_for("the banner", "return !document.getElementById('lost').hidden");
    page.browser.press(&["]"]).unwrap();
    are_kept(&page);
    page.browser.run("window.isOld = true", &[]).unwrap();
    page.arguments[0] = "other".to_owned();
    page.start_server();
    page.wait_for(
        "the other project",
        "return !window.isOld && document.querySelectorAll('.todo li.done').length === 3",
    );
    // Longer than the interval at which the page checks the server and removes marks that were sent.
    page.wait_for("a check of the server", "return new Promise((done) => setTimeout(() => done(true), 3500))");
    assert_eq!(page.text("#saved"), "Saved in photo.json");
    are_kept(&page);
    page.stop_server();
    page.arguments[0] = "project".to_owned();
    page.start_server();
    let sent = "return document.getElementById('saved')?.innerText === 'Saved in photo.coco.json'";
    page.wait_for("the marks to be sent", sent);
    let is_changed = [&project, &other].map(|folder| folder.join("photo.coco.json").exists());
    assert_eq!(is_changed, [true, false]);
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn marks_kept_by_another_tab_stay_until_they_are_saved() {
    let mut page = open(&["--port", &free_port(), "--token-file", "key"], &["photo"]);
    // As a tab that was closed while the server did not answer; this tab has not noticed that.
    let keep = "return import('/page/store.js').then(({ state }) => {
            const [{ name, sent }] = state.images;
            const marks = JSON.parse(sent);
            marks.box[0] -= 5;
            localStorage.setItem(`kept-marks:${state.project}`, JSON.stringify({ [name]: { was: sent, marks } }));
        })";
    page.browser.run(keep, &[]).unwrap();
    // Longer than the interval at which the page checks the server and removes its own marks.
    page.wait_for("a check of the server", "return new Promise((done) => setTimeout(() => done(true), 3500))");
    are_kept(&page);
    page.stop_server();
    page.wait_for("the banner", "return !document.getElementById('lost').hidden");
    page.start_server();
    page.wait_for("saved", "return document.getElementById('saved').innerText === 'Saved in photo.coco.json'");
    let [before, after] = ["photo.json", "photo.coco.json"]
        .map(|name| annotation(&page.folder.path().join("project").join(name)).bbox.x1);
    assert!((after - (before - 5.0)).abs() < 0.1, "{before} {after}");
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn marks_kept_by_another_tab_that_have_arrived_are_removed() {
    let page = open(&[], &["photo"]);
    // As a tab that was closed while its last request was on the way.
    let keep = "return import('/page/store.js').then(({ state }) => {
            const [{ name, sent }] = state.images;
            const was = JSON.parse(sent);
            was.box[0] -= 5;
            const entry = { was: JSON.stringify(was), marks: JSON.parse(sent) };
            localStorage.setItem(`kept-marks:${state.project}`, JSON.stringify({ [name]: entry }));
        })";
    page.browser.run(keep, &[]).unwrap();
    let is_removed = "return !Object.keys(localStorage).some((key) => key.startsWith('kept-marks:'))";
    page.wait_for("the removal", is_removed);
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn pictures_are_searched_again_if_another_page_changes_the_region_before_a_teaching() {
    let page = open(&[], &["photo"]);
    // This page learns of both during the teaching, which then fails.
    let change = "return import('/page/store.js').then(({ adoptModels, state }) => {
            const { generation, models, region, teaching } = state;
            state.teaching = { ...teaching, status: 'running' };
            adoptModels({ models, region: { x: 0, y: 0, width: 9, height: 9, picture: null } });
            state.teaching = teaching;
            const isSearched = state.generation > generation;
            adoptModels({ models, region });
            return isSearched;
        })";
    assert_eq!(page.browser.run(change, &[]).unwrap(), json!(true));
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn kept_marks_are_sent_although_their_file_has_a_box_of_the_outline() {
    let mut page = open(&["--port", &free_port(), "--token-file", "key"], &["photo"]);
    let draw = "return Promise.all(['store', 'editing'].map((name) => import(`/page/${name}.js`)))
        .then(([{ marks }, { commit }]) => {
            Object.assign(marks(), { box: null, outline: [[260, 170], [385, 170], [385, 275], [260, 275]] });
            commit();
        })";
    page.browser.run(draw, &[]).unwrap();
    page.wait_for("saved", "return document.getElementById('saved').innerText === 'Saved in photo.coco.json'");
    page.stop_server();
    page.wait_for("the banner", "return !document.getElementById('lost').hidden");
    page.browser.press(&["]"]).unwrap();
    are_kept(&page);
    page.browser.open("about:blank").unwrap();
    page.start_server();
    page.browser.open(&page.url.clone()).unwrap();
    let sent = "return document.getElementById('toasts').innerText.includes('kept in this browser are saved now')";
    page.wait_for("the marks to be sent", sent);
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn on_a_full_disk_a_banner_stays_and_saving_is_tried_again() {
    let page = open(&[], &["photo"]);
    let saved = page.folder.path().join("project/photo.coco.json");
    page.fill_disk(true);
    page.browser.press(&["]"]).unwrap();
    page.wait_for("the banner", "return !document.getElementById('unsaved').hidden");
    let banner = page.text("#unsaved");
    assert!(banner.starts_with("Not saved: the marks on photo.png (") && banner.contains("too large"), "{banner}");
    // The message stays in another step of the page, and after 3.5 seconds.
    page.click("#tab-try");
    page.settle_frames();
    page.wait_for("another try", "return new Promise((done) => setTimeout(() => done(true), 3500))");
    assert_eq!(page.text("#unsaved"), banner);
    page.screenshot("project-15-full-disk");
    page.assert_accessible("a full disk");
    assert!(!saved.exists());
    page.fill_disk(false);
    page.wait_for("no banner", "return document.getElementById('unsaved').hidden");
    assert!(saved.exists());
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_click_corrects_the_outline_and_is_undone() {
    let page = Page::open();
    page.draw_box();
    page.wait_for("the outline", "return document.querySelector('#do-outline.done') !== null");
    page.settle();
    let area = |page: &Page| page.saved().outline.unwrap().area();
    let before = area(&page);
    // A corner of the box that contains only table is marked as part of the object.
    page.click("[data-tool=in]");
    page.browser.drag(&[page.on_screen([270.0, 265.0])]).unwrap();
    page.settle();
    let with_table = area(&page);
    assert!(with_table > before + 200.0, "{before} {with_table}");
    page.screenshot("project-6-clicked");
    page.browser.press(&["\u{e009}", "z"]).unwrap();
    page.settle();
    assert_eq!(area(&page), before);
    page.assert_accessible("clicking the outline");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn that_an_outline_has_no_holes_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let middle = [0.5 * (BOX[0] + BOX[2]), 0.5 * (BOX[1] + BOX[3])];
    let washer = RgbImage::from_fn(640, 480, |x, y| {
        let radius = (f64::from(x) - middle[0]).hypot(f64::from(y) - middle[1]);
        // A table with two greys, and a dark ring on it.
        let table = if (x / 8 + y / 8).is_multiple_of(2) { 150 } else { 156 };
        Rgb([if (25.0..56.0).contains(&radius) { 70 } else { table }; 3])
    });
    washer.save(folder.path().join("photo.png")).unwrap();
    let page = Page::open_in(folder, &["photo.png"]);
    page.wait_for("the photo", "return document.getElementById('photo').naturalWidth");
    page.draw_box();
    page.wait_for("the outline", "return document.querySelector('#do-outline.done') !== null");
    page.settle();
    let area = std::f64::consts::PI * 56.0 * 56.0;
    let found = page.saved().outline.unwrap().area();
    assert!((found / area - 1.0).abs() < 0.05, "{found} of {area}");
    page.click("[data-tool=out]");
    page.browser.drag(&[page.on_screen(middle)]).unwrap();
    page.wait_for("a word of the hole", "return document.getElementById('toasts').innerText.includes('without holes')");
    page.settle();
    let after = page.saved().outline.unwrap().area();
    assert!((after / area - 1.0).abs() < 0.05, "{after} of {area}");
    page.screenshot("project-10-hole");
    page.assert_accessible("a click in a hole");
    // For a round outline, the page asks whether the part looks the same when rotated.
    page.click("#tab-teach");
    page.wait_for("the question", "return document.getElementById('symmetry').open");
    assert!(page.text("#symmetry-why").contains("Any turn"), "{}", page.text("#symmetry-why"));
    page.screenshot("project-12-symmetry");
    page.assert_accessible("the question of turns");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn at_360_px_nothing_lies_on_the_part_or_the_tools() {
    let page = Page::open();
    page.browser.emulate(360, 740, false).unwrap();
    page.settle_frames();
    page.draw_box();
    page.wait_for("the outline", "return document.querySelector('#do-outline.done') !== null");
    page.settle();
    page.browser.drag(&[page.on_screen(HOLD)]).unwrap();
    page.wait_for("the gripper", "return document.querySelector('#do-grasp.done') !== null");
    page.settle();
    let overlap = "const rect = (css) => document.querySelector(css).getBoundingClientRect();
        const meets = (a, b) => a.width && b.width && a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
        const hint = rect('#hint'), part = rect('#overlay .outline .line'), tools = rect('#tools');
        return [meets(hint, part), [...document.querySelectorAll('#toasts p')].some((p) => meets(p.getBoundingClientRect(), tools)),
            Math.max(part.width, part.height)]";
    let told = page.browser.run(overlap, &[]).unwrap();
    assert_eq!((&told[0], &told[1]), (&json!(false), &json!(false)));
    // The page zooms in after the box is drawn, so that the part is large compared with its handles.
    assert!(told[2].as_f64().unwrap() > 120.0, "{told}");
    page.screenshot("project-7-360");
    page.assert_quiet();
}
