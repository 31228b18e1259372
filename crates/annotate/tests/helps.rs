//! Which tried picture would help most when learnt from.

use serde_json::{Value, json};

use crate::served::{Served, photo, photo_png};

fn png(picture: &image::RgbImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

const MARKS: &str =
    r#"{"box": [40, 40, 140, 60], "grasp": {"start": [70, 50], "end": [110, 50], "jaw_width": 24}, "outline": null}"#;

#[test]
fn a_picture_is_learnt_from_on_trial_and_nothing_is_kept() {
    let served = Served::start();
    let ask = |method: &str, path: &str, body: &str| served.ask(method, path, body.as_bytes());
    assert_eq!(ask("PUT", "/api/images/0/marks", MARKS).status, 200);
    // The part in another colour, twice, and the photo itself.
    let mut other = photo();
    other.pixels_mut().for_each(|pixel| pixel.0[2] ^= 0x55);
    for picture in [png(&other), png(&other), photo_png()] {
        assert_eq!(served.ask("POST", "/api/trial-pictures?name=a.png", &picture).status, 200);
    }
    let question = |model: &str, id: usize| {
        let marks: Value = serde_json::from_str(MARKS).unwrap();
        let body = json!({"teaching": {"model": model}, "marks": marks, "others": [1, 2]}).to_string();
        ask("POST", &format!("/api/trial-pictures/{id}/would-help"), &body)
    };
    let before = ask("GET", "/api/session", "").json();
    // This teacher's trial model finds only the last demonstration, here picture 0, to which picture 1 is equal.
    assert_eq!(question("S", 0).json(), json!([[1, 0.9], [2, 0.1]]));
    assert_eq!(ask("GET", "/api/session", "").json(), before);
    let refused = question("C", 0);
    assert!(refused.status == 422 && refused.text().contains("expected S"), "{} {}", refused.status, refused.text());
    assert_eq!(question("S", 9).status, 404);
}
