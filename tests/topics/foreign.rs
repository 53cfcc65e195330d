//! What other users may have put where the topics go. These tests need root, which can give files to others.

use super::home::{Home, segments};
use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt, chown, symlink};
use std::path::Path;
use wormd::topics::{Controller, Hub, Instance, InstanceError, RoleError, RoleLock};

/// The user nobody.
const NOBODY: u32 = 65534;

fn needs_root() -> bool {
    let is_root = nix::unistd::geteuid().is_root();
    if !is_root {
        println!("SKIPPED: files of another user need root");
    }
    !is_root
}

fn give_to_nobody(path: &Path) {
    chown(path, Some(NOBODY), Some(NOBODY)).expect("root may");
}

#[test]
fn a_root_of_another_user_or_open_to_all_is_refused() {
    if needs_root() {
        return;
    }
    let home = Home::new();
    let root = home.root().join("r");
    fs::create_dir(&root).expect("create");
    fs::set_permissions(&root, Permissions::from_mode(0o777)).expect("is ours");
    let error = Instance::new(&root, "worm1").expect_err("others may replace what is in it");
    assert!(matches!(error, InstanceError::OpenRoot { mode: 0o777, .. }), "{error}");
    assert!(error.to_string().contains("chmod +t"), "{error}");
    fs::set_permissions(&root, Permissions::from_mode(0o1777)).expect("is ours");
    Instance::new(&root, "worm1").expect("as /dev/shm is");
    give_to_nobody(&root);
    let error = Instance::new(&root, "worm1").expect_err("its owner may replace what is in it");
    assert!(
        matches!(
            error,
            InstanceError::ForeignRoot {
                owner: NOBODY,
                user: 0,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn a_folder_of_another_user_with_a_link_in_it_has_nothing_truncated() {
    if needs_root() {
        return;
    }
    let home = Home::new();
    let precious = home.root().join("precious");
    fs::write(&precious, "do not touch").expect("write");
    let folder = home.root().join("worm1");
    fs::create_dir(&folder).expect("create");
    symlink(&precious, folder.join("controller.lock")).expect("link");
    give_to_nobody(&folder);
    let error = Instance::new(home.root(), "worm1").expect_err("it is nobody's");
    assert!(matches!(error, InstanceError::Foreign { owner: NOBODY, .. }), "{error}");
    // The same link in a folder that is ours.
    chown(&folder, Some(0), Some(0)).expect("root may");
    let instance = home.instance("worm1");
    let error = RoleLock::<Controller>::take(&instance).expect_err("a link is no lock");
    assert!(matches!(error, RoleError::Lock(_)), "{error}");
    assert_eq!(fs::read_to_string(&precious).expect("read"), "do not touch");
}

#[test]
fn a_lock_that_belongs_to_another_user_is_not_written() {
    if needs_root() {
        return;
    }
    let home = Home::new();
    let instance = home.instance("worm1");
    let lock = instance.folder().join("controller.lock");
    fs::write(&lock, "nobody's").expect("write");
    give_to_nobody(&lock);
    let error = RoleLock::<Controller>::take(&instance).expect_err("it is nobody's");
    assert!(
        error.to_string().contains(&format!("belongs to user {NOBODY}")),
        "{error}"
    );
    assert_eq!(fs::read_to_string(&lock).expect("read"), "nobody's");
    fs::remove_file(lock).expect("remove");
}

#[test]
fn a_foreign_file_with_the_prefix_does_not_keep_a_worm_from_starting() {
    if needs_root() {
        return;
    }
    let home = Home::new();
    let instance = home.instance("worm1");
    let planted = Path::new("/dev/shm").join(format!("{}planted", instance.prefix()));
    fs::write(&planted, "").expect("write");
    give_to_nobody(&planted);
    for _ in 0..2 {
        Hub::open(&instance)
            .expect("a start")
            .command_client()
            .expect("a client");
    }
    assert_eq!(
        segments(&instance),
        [planted.as_path()],
        "it is left alone, and nothing else is left"
    );
    assert_eq!(planted.metadata().expect("is there").uid(), NOBODY);
    fs::remove_file(planted).expect("remove");
}

#[test]
fn a_lock_that_was_replaced_is_not_removed_by_its_earlier_holder() {
    let home = Home::new();
    let instance = home.instance("worm1");
    let first = RoleLock::<Controller>::take(&instance).expect("free");
    fs::remove_dir_all(instance.folder()).expect("is there");
    let second = RoleLock::<Controller>::take(&instance).expect("the file is gone");
    drop(first);
    assert_eq!(RoleLock::<Controller>::holder(&instance), Some(std::process::id()));
    drop(second);
}
