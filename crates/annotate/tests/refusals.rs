//! Requests that the real server refuses.

use crate::served;
use served::Served;

#[test]
fn the_page_opens_with_its_address_and_leaves_a_cookie() {
    let served = Served::start();
    let page = served.send("GET", &format!("/?token={}", served.token), &[("Host", &served.host())], b"");
    assert_eq!(page.status, 200);
    assert!(page.text().contains("<title>Teach a grasp</title>"));
    let head = page.head.to_lowercase();
    assert!(head.contains(&format!("set-cookie: {}; path=/; httponly; samesite=strict", served.cookie())), "{head}");
    assert!(head.contains("content-security-policy: default-src 'none'"), "{head}");
    assert!(head.contains("referrer-policy: no-referrer"), "{head}");
}

#[test]
fn wrong_and_missing_tokens_are_refused_everywhere() {
    let served = Served::start();
    let (host, wrong) = (served.host(), format!("sdg-annotate-{}={}", served.port, "0".repeat(32)));
    for (method, path) in [
        ("GET", "/"),
        ("GET", "/?token=0123456789abcdef0123456789abcdef"),
        ("GET", "/page/main.js"),
        ("GET", "/api/session"),
        ("GET", "/api/images/0/picture"),
        ("PUT", "/api/images/0/marks"),
        ("POST", "/api/teaching"),
        ("POST", "/api/trial-pictures?name=a.png"),
        ("GET", "/api/live"),
        ("POST", "/api/live/0/photo"),
        ("GET", "/nowhere"),
    ] {
        for headers in [vec![("Host", host.as_str())], vec![("Host", host.as_str()), ("Cookie", wrong.as_str())]] {
            let answer = served.send(method, path, &headers, b"{}");
            assert_eq!(answer.status, 401, "{method} {path}");
            assert!(!answer.head.to_lowercase().contains("set-cookie"), "{method} {path}");
        }
    }
}

#[test]
fn foreign_hosts_and_origins_are_refused_though_they_have_the_token() {
    let served = Served::start();
    let (host, cookie) = (served.host(), served.cookie());
    for foreign in ["evil.example", "127.0.0.1:1", "evil.example:80"] {
        assert_eq!(
            served.send("GET", "/api/session", &[("Host", foreign), ("Cookie", cookie.as_str())], b"").status,
            403
        );
    }
    for foreign in ["http://evil.example", "null", "http://127.0.0.1:1"] {
        let headers = [("Host", host.as_str()), ("Cookie", cookie.as_str()), ("Origin", foreign)];
        let answer = served.send("PUT", "/api/images/0/marks", &headers, b"{\"box\": [1, 1, 50, 50]}");
        assert_eq!(answer.status, 403, "{foreign}");
    }
    assert!(!served.folder.path().join("photo.json").exists(), "nothing was written");
}

#[test]
fn no_path_leads_to_other_files() {
    let served = Served::start();
    for path in [
        "/page/../Cargo.toml",
        "/page/..%2f..%2fCargo.toml",
        "/page/%2e%2e/%2e%2e/secret.txt",
        "/page/secret.txt",
        "/../secret.txt",
        "/secret.txt",
        "/api/images/../../secret.txt",
        "/api/images/..%2fsecret.txt/picture",
        "/api/images/1/picture",
        "/api/images/-1/picture",
        "/api/images/18446744073709551616/picture",
        "/api/trial-pictures/0/picture",
        "/page//etc/passwd",
    ] {
        let answer = served.ask("GET", path, b"");
        assert!([400, 404].contains(&answer.status), "{path}: {}", answer.status);
        assert!(!answer.text().contains("not for the page"), "{path}");
    }
}

#[test]
fn a_picture_s_name_cannot_choose_where_it_is_written() {
    let served = Served::start();
    let trial =
        served.ask("POST", "/api/trial-pictures?name=..%2f..%2f..%2ftmp%2fevil%00.png", &served::photo_png()).json();
    assert_eq!(trial["name"], "evil\0.png");
    let view = served.ask("POST", "/api/trial-pictures/0/accept", b"{\"box\": [40, 40, 140, 60]}").json();
    assert_eq!(view["name"], "evil_.png");
    assert!(served.folder.path().join("evil_.png").exists() && served.folder.path().join("evil_.json").exists());
}

#[test]
fn oversized_bodies_are_refused() {
    let served = Served::start();
    let large = vec![b' '; (1 << 20) + 1];
    for (method, path) in [
        ("PUT", "/api/images/0/marks"),
        ("POST", "/api/images/0/outline"),
        ("PUT", "/api/label"),
        ("POST", "/api/teaching"),
        ("POST", "/api/trial-pictures/0/accept"),
    ] {
        assert_eq!(served.ask(method, path, &large).status, 413, "{path}");
    }
    let picture = vec![0; (64 << 20) + 1];
    assert_eq!(served.ask("POST", "/api/trial-pictures?name=a.png", &picture).status, 413);
    // Pictures may be larger than marks: bytes after the end of a PNG are ignored.
    let mut photo = served::photo_png();
    photo.resize(3 << 20, 0);
    assert_eq!(served.ask("POST", "/api/trial-pictures?name=a.png", &photo).status, 200);
}

#[test]
fn requests_without_sense_are_told_in_one_line() {
    let served = Served::start();
    let refused = |method: &str, path: &str, body: &[u8], parts: &[&str]| {
        let answer = served.ask(method, path, body);
        let text = answer.text();
        assert!((400..500).contains(&answer.status), "{path}: {} {text}", answer.status);
        let error: serde_json::Value = serde_json::from_str(&text).unwrap_or_else(|_| panic!("{path}: {text}"));
        let error = error["error"].as_str().unwrap();
        assert!(!error.contains('\n'), "{error}");
        parts.iter().for_each(|part| assert!(error.contains(part), "expected \"{part}\" in: {error}"));
    };
    refused("PUT", "/api/images/0/marks", b"box", &["marks", "JSON"]);
    refused("PUT", "/api/images/0/marks", b"{\"bux\": 1}", &["bux"]);
    refused("PUT", "/api/images/7/marks", b"{}", &["numbered below 1", "7"]);
    refused("PUT", "/api/label", b"{\"label\": \"  \"}", &["name", "letters"]);
    refused("POST", "/api/trial-pictures?name=a.png", b"GIF89a....", &["a.png", "expected a PNG, JPEG"]);
    refused("POST", "/api/teaching", b"{\"model\": \"Z\"}", &["teaching", "unknown variant"]);
    refused("POST", "/api/teaching", b"{\"model\": \"C\"}", &["photo.png", "a box and a grasp"]);
    refused("POST", "/api/teaching", b"{\"model\": \"C\", \"steps\": 0}", &["steps", "1 to 1000000"]);
    refused("POST", "/api/teaching", b"{\"model\": \"C\", \"time_budget_secs\": -1}", &["time limit", "-1"]);
    refused("GET", "/api/images/0/samples/0", b"", &["photo.png"]);
}

#[test]
fn strokes_and_names_have_maximum_lengths() {
    let served = Served::start();
    let outline = |strokes: usize, points: usize| {
        let points = vec!["[60, 50]"; points].join(",");
        let strokes = vec![format!("{{\"points\": [{points}], \"is_inside\": true}}"); strokes].join(",");
        let body = format!("{{\"box\": [40, 40, 140, 60], \"strokes\": [{strokes}]}}");
        served.ask("POST", "/api/images/0/outline", body.as_bytes())
    };
    assert_eq!(outline(1, 1000).status, 200);
    for (strokes, points) in [(101, 1), (1, 1001)] {
        let refused = outline(strokes, points);
        let found = format!("{strokes}, the longest of {points}");
        assert!(refused.status == 422 && refused.text().contains(&found), "{} {}", refused.status, refused.text());
    }
    let rename = |letters: usize| {
        let body = format!("{{\"label\": \"{}\"}}", "ä".repeat(letters));
        served.ask("PUT", "/api/label", body.as_bytes())
    };
    assert_eq!(rename(80).status, 200);
    let refused = rename(81);
    assert!(refused.status == 422 && refused.text().contains("1 to 80 letters"), "{}", refused.text());
}

#[test]
fn more_pictures_than_a_session_keeps_are_refused() {
    let (folder, tried) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for name in ["rod.png", "other.png"] {
        std::fs::write(folder.path().join(name), served::photo_png()).unwrap();
    }
    let tiny = tried.path().join("0.png");
    image::RgbImage::new(8, 8).save(&tiny).unwrap();
    for number in 1..500 {
        std::fs::copy(&tiny, tried.path().join(format!("{number}.png"))).unwrap();
    }
    let served = Served::of_photo_and_tried(folder, "rod.png", tried.path());
    let session = served.ask("GET", "/api/session", b"").json();
    assert_eq!(
        (session["others"][0]["name"].as_str(), session["trial_pictures"].as_array().unwrap().len()),
        (Some("other.png"), 500)
    );
    for (path, body) in [("/api/others/0/try", Vec::new()), ("/api/trial-pictures?name=a.png", served::photo_png())] {
        let refused = served.ask("POST", path, &body);
        assert!(
            refused.status == 409 && refused.text().contains("500"),
            "{path}: {} {}",
            refused.status,
            refused.text()
        );
    }
}
