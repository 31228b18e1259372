//! Tried pictures: jaws that touch a neighbour, the refused picture that helps most, two hundred pictures in one
//! action, a low minimum score, a part at the border, and the row of pictures.

use image::{Rgb, RgbImage};
use serde_json::{Value, json};

use super::page::{HOLD, Page, repository, shipped_photo};
use super::photo_to_grasp::patiently;
use crate::support::pendulum_twice;

/// A page with the pendulum's marked photo, at the step that teaches.
pub fn marked() -> Page {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(shipped_photo(), folder.path().join("photo.png")).unwrap();
    let marks = repository().join("datasets/demonstrations/pendulum/annotation.json");
    std::fs::copy(marks, folder.path().join("photo.json")).unwrap();
    let page = Page::open_in(folder, &["photo.png"]);
    page.wait_for("the marks", "return document.querySelectorAll('.todo li.done').length === 3");
    page.click("#tab-teach");
    page
}

/// A page whose model S was taught from the pendulum's photo.
pub fn taught() -> Page {
    let page = marked();
    page.choose_model("S");
    page.click("#teach-start");
    patiently(&page, "a model", "return !document.getElementById('go-try').hidden");
    page.click("#tab-try");
    page
}

/// Adds several pictures in one action.
pub fn add(page: &Page, pictures: &[(String, RgbImage)]) {
    let paths: Vec<_> = pictures.iter().map(|(name, _)| page.folder.path().join(name)).collect();
    for (path, (_, picture)) in paths.iter().zip(pictures) {
        picture.save(path).unwrap();
    }
    let paths: Vec<_> = paths.iter().map(|path| path.to_str().unwrap()).collect();
    page.browser.find("#picture-input").unwrap().type_text(&paths.join("\n")).unwrap();
}

/// Whether this number of pictures has been searched.
fn looked_at(count: usize) -> String {
    format!(
        "const words = [...document.querySelectorAll('#strip button')].map((b) => b.innerText);
        return words.length === {count} && words.every((w) => /found/.test(w))"
    )
}

pub fn photo() -> RgbImage {
    image::open(shipped_photo()).unwrap().into_rgb8()
}

fn crop(picture: &RgbImage, [x, y]: [u32; 2]) -> RgbImage {
    image::imageops::crop_imm(picture, x, y, 320, 240).to_image()
}

/// The file that a button saves.
fn saved(page: &Page, css: &str) -> String {
    let script = "const made = URL.createObjectURL; let blob;
        URL.createObjectURL = (given) => made.call(URL, (blob = given));
        document.querySelector(arguments[0]).click(); URL.createObjectURL = made; return blob.text()";
    page.browser.run(script, &[json!(css)]).unwrap().as_str().unwrap().to_owned()
}

/// Asserts that the scores beside the parts do not cover each other, at this zoom and at a third of it.
fn assert_tags_apart(page: &Page) {
    let overlaps = "const r = [...document.querySelectorAll('#overlay .tag')].map((t) => t.getBoundingClientRect());
        return [r.length, r.flatMap((a, i) => r.slice(i + 1).filter((b) => a.left < b.right && b.left < a.right
            && a.top + 3 < b.bottom - 3 && b.top + 3 < a.bottom - 3)).length]";
    assert_eq!(page.browser.run(overlaps, &[]).unwrap(), json!([2, 0]));
    for _ in 0..5 {
        page.browser.run("document.getElementById('zoom-out').click()", &[]).unwrap();
    }
    page.settle_frames();
    assert_eq!(page.browser.run(overlaps, &[]).unwrap(), json!([2, 0]), "smaller");
    page.browser.run("document.getElementById('zoom-fit').click()", &[]).unwrap();
    page.settle_frames();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn jaws_that_would_touch_a_neighbour_are_told() {
    let page = taught();
    add(&page, &[("near.png".to_owned(), pendulum_twice([59, -6]))]);
    patiently(&page, "both parts", "return document.querySelectorAll('#found .found').length === 2");
    let warnings = "return [...document.querySelectorAll('#found .warning')].map((p) => p.innerText)";
    let told = page.browser.run(warnings, &[]).unwrap();
    let told: Vec<&str> = told.as_array().unwrap().iter().map(|text| text.as_str().unwrap()).collect();
    assert!(told.iter().any(|text| text.starts_with("Warning: the jaws would touch part ")), "{told:?}");
    page.settle_frames();
    let drawn = "return document.querySelectorAll('#overlay .touching').length";
    assert_eq!(page.browser.run(drawn, &[]).unwrap(), json!(told.len()));
    let csv = saved(&page, "#save-csv");
    assert!(csv.lines().next().unwrap().ends_with(",jaws_touch"), "{csv}");
    let record: Value = serde_json::from_str(saved(&page, "#save-json").lines().next().unwrap()).unwrap();
    let touching = record["detections"].as_array().unwrap().iter().filter(|one| one["jaws_touch"] != json!([]));
    assert_eq!(touching.count(), told.len(), "{record}");
    // Texts for screen readers must not make the page longer.
    let room = page.browser.run("return document.documentElement.scrollHeight - innerHeight", &[]).unwrap();
    assert_eq!(room, json!(0), "the panel scrolls, not the page");
    page.screenshot("tried-1-jaws");
    assert_tags_apart(&page);
    page.assert_accessible("jaws that touch");
    page.browser.emulate(390, 800, false).unwrap();
    page.settle_frames();
    assert_tags_apart(&page);
    page.screenshot("tried-1-jaws-small");
    page.assert_accessible("jaws that touch, on a small screen");
    page.assert_quiet();
}

/// The photo with the right third of the part covered.
fn covered() -> RgbImage {
    let mut covered = photo();
    for y in 150..300 {
        for x in 344..400 {
            covered.put_pixel(x, y, Rgb([120, 130, 70]));
        }
    }
    covered
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn the_page_says_which_refused_picture_helps_most() {
    let page = taught();
    let covered = covered();
    let places = [[150, 90], [190, 120], [170, 60]];
    let pictures: Vec<_> =
        places.iter().enumerate().map(|(i, &place)| (format!("covered-{i}.png"), crop(&covered, place))).collect();
    add(&page, &pictures);
    let told =
        "const text = document.getElementById('helps').innerText; return text.includes('the part is found in') && text";
    let told = patiently(&page, "advice", told);
    let told = told.as_str().unwrap();
    assert!(told.contains("the part is found in 2 of the 2 other pictures in which it is refused"), "{told}");
    page.screenshot("tried-2-helps");
    page.assert_accessible("which picture helps");
    let name = told.split(' ').next().unwrap().to_owned();
    page.browser.run("document.querySelector('#helps button')?.click()", &[]).unwrap();
    page.wait_for("that picture", &format!("return document.getElementById('photo').alt === 'Photo {name}'"));
    let learn = "const b = [...document.querySelectorAll('#found button')].find((b) => /learn from it/.test(b.innerText)); if (b) b.click(); return Boolean(b)";
    page.wait_for("the button", learn);
    // The prediction is correct.
    let learnt = "const text = document.getElementById('learnt').innerText; return text.startsWith('The new model finds') && text";
    let learnt = patiently(&page, "what was learnt", learnt);
    assert!(learnt.as_str().unwrap().contains("finds the part in 3 of 3 pictures"), "{learnt}");
    page.wait_for("no more advice", "return document.getElementById('helps').hidden");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn two_hundred_pictures_are_tried_and_saved() {
    const COUNT: usize = 200;
    /// Maximum distance of a detected grasp from the mean of all of them, in pixels.
    const MAX_OFF_PX: f64 = 2.0;
    let page = taught();
    let photo = photo();
    let place = |number: usize| [(120 + number * 7 % 100) as u32, (60 + number * 13 % 90) as u32];
    let is_empty = |number: usize| number % 10 == 9;
    let pictures: Vec<_> = (0..COUNT)
        .map(|number| {
            let plain = || RgbImage::from_pixel(320, 240, Rgb([140, 140, 135]));
            let picture = if is_empty(number) { plain() } else { crop(&photo, place(number)) };
            (format!("{number:03}.png"), picture)
        })
        .collect();
    add(&page, &pictures);
    page.wait_for(
        "progress",
        "const bar = document.getElementById('looked'); return !bar.hidden && bar.value > 0 && bar.value < bar.max",
    );
    page.assert_accessible("two hundred pictures on their way");
    patiently(&page, "all of them", &looked_at(COUNT));
    let count = page.text("#least-score-count");
    assert!(count.contains("in 180 of 200 pictures"), "{count}");
    page.screenshot("tried-3-batch");
    let csv = saved(&page, "#save-csv");
    assert_eq!(csv.lines().filter(|line| line.contains(",true,")).count(), 180, "{csv}");
    assert!(csv.lines().any(|line| line.starts_with("009.png,0,false")), "{csv}");
    let json = saved(&page, "#save-json");
    let records: Vec<Value> = json.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(records.len(), COUNT);
    let mut places = Vec::new();
    for (number, record) in records.iter().enumerate() {
        assert_eq!(record["image"], json!(format!("{number:03}.png")));
        let found = record["detections"].as_array().unwrap().iter().filter(|one| one["found"] == json!(true));
        let found: Vec<_> = found.map(|one| ["x", "y"].map(|axis| one["grasp"][axis].as_f64().unwrap())).collect();
        assert_eq!(found.len(), usize::from(!is_empty(number)), "{record}");
        let [x, y] = place(number).map(f64::from);
        places.extend(found.into_iter().map(|at| [at[0] + x, at[1] + y]));
    }
    // All show the same part of the same photo.
    let middle = |axis: usize| places.iter().map(|at| at[axis]).sum::<f64>() / places.len() as f64;
    let middle = [middle(0), middle(1)];
    assert!((middle[0] - HOLD[0]).hypot(middle[1] - HOLD[1]) < 40.0, "{middle:?}");
    let off = places.iter().map(|at| (at[0] - middle[0]).hypot(at[1] - middle[1])).fold(0.0, f64::max);
    assert!(off < MAX_OFF_PX, "{off} px");
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn pictures_of_the_folder_are_shown_once_they_are_taken_in() {
    let page = Page::open();
    for k in 0..2 {
        std::fs::copy(shipped_photo(), page.folder.path().join(format!("other{k}.png"))).unwrap();
    }
    page.click("#tab-try");
    page.browser.run("document.getElementById('add-others').click()", &[]).unwrap();
    page.wait_for("the list", "return document.querySelectorAll('#folder-list button').length === 2");
    page.click("#folder-all");
    let is_shown = "const photo = document.getElementById('photo');
        return !photo.hidden && photo.naturalWidth === 640 && photo.alt === 'Photo other0.png'";
    page.wait_for("the first of them", is_shown);
    assert_eq!(page.browser.run("return document.querySelectorAll('#strip button').length", &[]).unwrap(), json!(2));
    assert!(page.browser.run("return document.getElementById('empty').hidden", &[]).unwrap().as_bool().unwrap());
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn an_unreadable_picture_of_the_folder_does_not_stop_those_after_it() {
    let page = Page::open();
    let photo = std::fs::read(shipped_photo()).unwrap();
    for (name, bytes) in [("a.png", &photo[..]), ("b.png", &photo[..200]), ("c.png", &photo[..])] {
        std::fs::write(page.folder.path().join(name), bytes).unwrap();
    }
    page.click("#tab-try");
    page.browser.run("document.getElementById('add-others').click()", &[]).unwrap();
    page.wait_for("the list", "return document.querySelectorAll('#folder-list button').length === 3");
    page.click("#folder-all");
    page.wait_for("its name", "return document.getElementById('toasts').innerText.includes('b.png')");
    page.wait_for("the others", "return document.querySelectorAll('#strip button').length === 2");
    page.wait_for("one left", "return document.getElementById('add-others').innerText === 'From this folder (1)…'");
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_search_without_an_answer_is_repeated_and_one_that_fails_is_not_waited_for() {
    let page = taught();
    // The first search gets no answer, its repetition an error.
    let fail = "const send = window.fetch; let count = 0;
        window.fetch = async (path, options) => {
            if (!path.endsWith('/detect')) return send(path, options);
            while (document.querySelectorAll('#strip button').length < 2) await new Promise(requestAnimationFrame);
            count += 1;
            if (count === 1) throw new TypeError('no connection');
            return count === 2 ? new Response('{\"error\": \"too dark\"}', { status: 422 }) : send(path, options);
        }";
    page.browser.run(fail, &[]).unwrap();
    add(&page, &["a.png", "b.png"].map(|name| (name.to_owned(), photo())));
    patiently(&page, "the second picture", "return document.getElementById('strip').innerText.includes('1 found')");
    page.settle_frames();
    assert_eq!(page.text("#found"), "too dark\n\nRemove this picture");
    let count = page.text("#least-score-count");
    assert!(count.ends_with("in 1 of 1 pictures."), "{count}");
    assert_eq!(page.browser.run("return document.getElementById('looked').hidden", &[]).unwrap(), json!(true));
    page.assert_quiet();
}

/// The texts of all elements that a selector names.
fn texts(page: &Page, css: &str) -> Vec<String> {
    let script = "return [...document.querySelectorAll(arguments[0])].map((e) => e.innerText)";
    let texts = page.browser.run(script, &[json!(css)]).unwrap();
    texts.as_array().unwrap().iter().map(|text| text.as_str().unwrap().to_owned()).collect()
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn below_the_model_s_limit_the_page_warns_and_all_counts_agree() {
    let page = taught();
    let pictures = [("covered.png", crop(&covered(), [150, 90])), ("whole.png", crop(&photo(), [150, 90]))];
    add(&page, &pictures.map(|(name, picture)| (name.to_owned(), picture)));
    patiently(&page, "both pictures", &looked_at(2));
    assert!(page.text("#least-score-count").starts_with("Found 1 of "), "{}", page.text("#least-score-count"));
    let slide = "const s = document.getElementById('least-score'); s.value = 0; s.dispatchEvent(new Event('input'))";
    page.browser.run(slide, &[]).unwrap();
    page.wait_for("the warning", "return document.getElementById('least-score-count').className === 'warning'");
    page.settle_frames();
    let count = page.text("#least-score-count");
    assert!(count.contains("1 of them reaches the model’s limit of 0.50"), "{count}");
    let rows = texts(&page, "#strip button span:last-child");
    assert!(rows.iter().all(|row| row.ends_with("above 0.00") || row == "1 found"), "{rows:?}");
    let sum: usize = rows.iter().map(|row| row.split(' ').next().unwrap().parse::<usize>().unwrap()).sum();
    assert!(count.starts_with(&format!("Above 0.00: {sum} of {sum} candidates, in 2 of 2 pictures")), "{count}");
    let titles = texts(&page, "#found .found h3");
    assert!(
        titles.iter().any(|title| title.contains("Above the slider, below the model’s limit of 0.50")),
        "{titles:?}"
    );
    let drawn = "return document.querySelectorAll('#overlay .refused').length";
    assert!(page.browser.run(drawn, &[]).unwrap().as_u64().unwrap() > 0, "they are drawn as refused");
    page.screenshot("tried-4-low-score");
    page.assert_accessible("a low minimum score");
    page.click("#least-score-back");
    page.wait_for("the limit", "return document.getElementById('least-score').value === '0.5'");
    page.settle_frames();
    assert!(page.text("#least-score-count").starts_with("Found 1 of "), "{}", page.text("#least-score-count"));
    // Nothing can be learnt from a picture without the part.
    let not_here =
        "[...document.querySelectorAll('#found button')].find((b) => b.innerText === 'The part is not here').click()";
    page.browser.run(not_here, &[]).unwrap();
    page.wait_for("its word", "return document.getElementById('found').innerText.includes('You said that')");
    let found = page.text("#found");
    assert!(!found.contains("learn from it") && !found.contains("What would help"), "{found}");
    let is_cut =
        "const span = document.querySelector('#strip span:last-child'); return span.scrollWidth > span.clientWidth";
    assert_eq!(page.browser.run(is_cut, &[]).unwrap(), json!(false), "{:?}", texts(&page, "#strip button"));
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn a_part_at_the_border_is_told_and_the_result_is_below_the_picture_on_a_phone() {
    let page = taught();
    add(&page, &[("border.png".to_owned(), crop(&photo(), [262, 100]))]);
    patiently(&page, "a detection", "return document.querySelector('#found .found') !== null");
    let warnings = texts(&page, "#found .warning");
    assert!(warnings.iter().any(|text| text.starts_with("The part touches the border")), "{warnings:?}");
    page.browser.emulate(390, 844, false).unwrap();
    page.settle_frames();
    let below = "const rect = (css) => document.querySelector(css).getBoundingClientRect();
        return rect('#found').top - rect('#strip').bottom";
    let below = page.browser.run(below, &[]).unwrap().as_f64().unwrap();
    assert!((0.0..40.0).contains(&below), "{below} px");
    page.screenshot("tried-5-phone");
    page.assert_accessible("the result on a phone");
    // The button is far below the picture, which is scrolled into view.
    let zoom = "const b = [...document.querySelectorAll('#found button')].find((b) => b.innerText === 'Zoom to it');
        b.scrollIntoView({block: 'start'}); const before = scrollY; b.click(); return before";
    assert!(page.browser.run(zoom, &[]).unwrap().as_f64().unwrap() > 0.0, "the page is scrolled");
    page.settle_frames();
    let in_sight = "const r = document.getElementById('stage').getBoundingClientRect();
        return r.top >= -1 && r.bottom <= innerHeight + 1";
    assert_eq!(page.browser.run(in_sight, &[]).unwrap(), json!(true));
    page.assert_quiet();
}

#[test]
#[ignore = "make test-browser: needs Chromium"]
fn the_row_is_sorted_by_name_and_follows_the_shown_picture() {
    let page = Page::open();
    page.click("#tab-try");
    let pictures: Vec<_> = (1..=12).rev().map(|number| (format!("p{number}.png"), photo())).collect();
    add(&page, &pictures);
    let shown = |name: &str| format!("return document.getElementById('photo').alt === 'Photo {name}'");
    page.wait_for("the first", &shown("p1.png"));
    page.settle_frames();
    let sorted: Vec<_> = (1..=12).map(|number| format!("p{number}.png")).collect();
    assert_eq!(texts(&page, "#strip button span:nth-child(2)"), sorted);
    page.click("#zoom-in");
    page.settle_frames();
    let width = "return document.getElementById('photo').getBoundingClientRect().width";
    let zoomed = page.browser.run(width, &[]).unwrap();
    let in_sight = "const rect = (css) => document.querySelector(css).getBoundingClientRect();
        const [at, row] = [rect('#strip [aria-current=true]'), rect('#strip')];
        return at.left >= row.left - 1 && at.right <= row.right + 1";
    for (key, numbers) in [("n", (2..=12).collect::<Vec<_>>()), ("m", (1..=11).rev().collect())] {
        for number in numbers {
            page.browser.press(&[key]).unwrap();
            page.wait_for("the picture", &shown(&format!("p{number}.png")));
            page.settle_frames();
            assert_eq!(page.browser.run(in_sight, &[]).unwrap(), json!(true), "p{number}.png");
            assert_eq!(page.browser.run(width, &[]).unwrap(), zoomed, "p{number}.png");
        }
    }
    page.assert_quiet();
}
