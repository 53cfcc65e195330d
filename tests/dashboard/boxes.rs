//! Boxes of the black box, as a browser and `curl -C -` download them.

use super::http::request;
use super::watched::start;
use super::worm::Worm;
use testkit::log_sample::{crawl, write_log};

#[test]
fn a_download_that_broke_off_goes_on_where_it_ended() {
    let folder = tempfile::tempdir().expect("a folder");
    let name = "box-000012-20261124T201533Z-motor-stall.mcap";
    write_log(&folder.path().join(name), &crawl(1.0));
    let all = std::fs::read(folder.path().join(name)).expect("is there");
    std::fs::write(folder.path().join("thin-000013-20261124T201540Z.mcap.part"), &all).expect("can be written");
    std::fs::write(folder.path().join("secret.mcap"), "secret").expect("can be written");
    let elsewhere = folder.path().join("secret.mcap");
    let link = "box-000014-20261124T201550Z-link-fault.mcap";
    std::os::unix::fs::symlink(elsewhere, folder.path().join(link)).expect("can be made");
    let worm = Worm::on_a_steady_computer("d-boxes");
    let path = folder.path().to_string_lossy();
    let arguments = ["dashboard", "--listen", "127.0.0.1:0", "--black-box", &path];
    let (_dashboard, address) = start(worm.wormd(&arguments).into_command());
    let get = |path: &str, headers: &[&str]| request(address, "GET", path, headers, "");

    let listed = get("/api/boxes", &[]).json();
    let boxes = listed["boxes"].as_array().expect("a list");
    assert_eq!(boxes.len(), 1, "{listed}");
    assert_eq!((&boxes[0]["name"], &boxes[0]["number"]), (&name.into(), &12.into()));
    assert_eq!(boxes[0]["bytes"], all.len());

    let whole = get("/boxes/12", &[]);
    assert_eq!((whole.status, &whole.bytes), (200, &all));
    let tag = whole.head.lines().find_map(|line| line.strip_prefix("etag: "));
    let tag = tag.unwrap_or_else(|| panic!("{}", whole.head)).trim().to_owned();
    let path = format!("/boxes/{name}");
    let half = all.len() / 2;
    for (headers, status, bytes) in [
        (vec![format!("Range: bytes={half}-")], 206, &all[half..]),
        (
            vec![format!("Range: bytes={half}-"), format!("If-Range: {tag}")],
            206,
            &all[half..],
        ),
        (
            vec![
                format!("Range: bytes={half}-"),
                "If-Range: \"of another file\"".to_owned(),
            ],
            200,
            &all[..],
        ),
        (vec!["Range: bytes=-7".to_owned()], 206, &all[all.len() - 7..]),
        (vec![format!("Range: bytes={}-", all.len())], 416, &[]),
        (vec![format!("If-None-Match: {tag}")], 304, &[]),
    ] {
        let headers: Vec<&str> = headers.iter().map(String::as_str).collect();
        let reply = get(&path, &headers);
        assert_eq!(reply.status, status, "{headers:?}: {}", reply.head);
        if status == 416 {
            assert_eq!(reply.json()["error"], format!("{name} has {} bytes", all.len()));
            continue;
        }
        assert!(reply.bytes == bytes, "{headers:?}: {} bytes", reply.bytes.len());
    }
    for path in [
        "/boxes/13",
        "/boxes/14",
        &format!("/boxes/{link}"),
        "/boxes/thin-000013-20261124T201540Z.mcap.part",
        "/boxes/secret.mcap",
        "/boxes/..%2fsecret.mcap",
        "/boxes/99",
    ] {
        assert_eq!(get(path, &[]).status, 404, "{path}");
    }
    assert!(
        get("/", &[]).body.contains("boxes-title"),
        "the page has a place for them"
    );
}
