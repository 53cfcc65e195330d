//! Two network namespaces with a link between them that the test makes: packets are delayed, lost by a seed, or all cut off.
//!
//! The link is two TUN devices, and threads of the test that carry packets from one to the other. So it needs root, `ip` and
//! /dev/net/tun, and not the kernel's netem, which many kernels leave out.

use nix::sched::{CloneFlags, setns};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::AsRawFd;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

/// The robot's address on the link.
pub const ROBOT: &str = "10.77.0.1";
/// The laptop's.
const LAPTOP: &str = "10.77.0.2";

/// Two computers, as far as the network goes.
pub struct TwoComputers {
    names: [String; 2],
    pub robot: File,
    pub laptop: File,
    is_cut: Arc<AtomicBool>,
    dropped: Arc<AtomicU64>,
}

impl TwoComputers {
    /// None, with a word about it, where this computer does not permit it.
    pub fn new(delay: Duration, loss: f64, seed: u64) -> Option<Self> {
        let skipped = |why: String| {
            println!("SKIPPED: no network namespaces here: {why}");
            None
        };
        if !nix::unistd::geteuid().is_root() {
            return skipped("they need root".to_owned());
        }
        println!("link with {delay:?}, loss {loss}, seed {seed}");
        let id = std::process::id();
        let names = [format!("wormd-r-{id}-{seed}"), format!("wormd-l-{id}-{seed}")];
        for (name, own, other) in [(&names[0], ROBOT, LAPTOP), (&names[1], LAPTOP, ROBOT)] {
            for arguments in [
                format!("netns add {name}"),
                format!("-n {name} link set lo up"),
                format!("-n {name} tuntap add dev link mode tun"),
                format!("-n {name} addr add {own} peer {other} dev link"),
                format!("-n {name} link set dev link up"),
            ] {
                match Command::new("ip").args(arguments.split(' ')).output() {
                    Ok(output) if output.status.success() => {}
                    Ok(output) => {
                        names.iter().for_each(|name| remove(name));
                        return skipped(String::from_utf8_lossy(&output.stderr).trim().to_owned());
                    }
                    Err(error) => return skipped(format!("ip: {error}")),
                }
            }
        }
        let open = |name: &str| File::open(format!("/run/netns/{name}")).expect("the namespace is there");
        let (robot, laptop) = (open(&names[0]), open(&names[1]));
        let is_cut = Arc::new(AtomicBool::new(false));
        let dropped = Arc::new(AtomicU64::new(0));
        let [a, b] = [device(&robot), device(&laptop)];
        for (index, (from, to)) in [(&a, &b), (&b, &a)].into_iter().enumerate() {
            let (sender, receiver) = channel();
            let reader = from.try_clone().expect("a descriptor is free");
            let writer = to.try_clone().expect("a descriptor is free");
            let rng = Xoshiro256PlusPlus::seed_from_u64(seed + index as u64);
            let (is_cut, dropped) = (Arc::clone(&is_cut), Arc::clone(&dropped));
            let carry = move || read_packets(reader, &sender, rng, delay, loss, &is_cut, &dropped);
            std::thread::spawn(carry);
            std::thread::spawn(move || write_packets(writer, &receiver));
        }
        Some(Self {
            names,
            robot,
            laptop,
            is_cut,
            dropped,
        })
    }

    /// Cuts the link, or joins it again. Both ends still believe that there is one.
    pub fn cut(&self, is_cut: bool) {
        self.is_cut.store(is_cut, Ordering::SeqCst);
    }

    /// Packets that were lost.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::SeqCst)
    }
}

impl Drop for TwoComputers {
    fn drop(&mut self) {
        self.names.iter().for_each(|name| remove(name));
    }
}

fn remove(name: &str) {
    let _ = Command::new("ip").args(["netns", "delete", name]).output();
}

/// The end of the link in a namespace. What is opened in a thread there can be used everywhere.
fn device(namespace: &File) -> File {
    let namespace = namespace.try_clone().expect("a descriptor is free");
    let open = move || {
        setns(&namespace, CloneFlags::CLONE_NEWNET).expect("root may enter it");
        let device = File::options()
            .read(true)
            .write(true)
            .open("/dev/net/tun")
            .expect("there is a tun device");
        // SAFETY: all zeros are a valid ifreq, and the kernel reads the name and the flags of it.
        let mut request: libc::ifreq = unsafe { std::mem::zeroed() };
        for (to, from) in request.ifr_name.iter_mut().zip(b"link\0") {
            *to = *from as libc::c_char;
        }
        request.ifr_ifru.ifru_flags = (libc::IFF_TUN | libc::IFF_NO_PI) as libc::c_short;
        // SAFETY: the descriptor is open, and the structure is what this request takes.
        let outcome = unsafe { libc::ioctl(device.as_raw_fd(), libc::TUNSETIFF, &request) };
        assert_eq!(outcome, 0, "{}", std::io::Error::last_os_error());
        device
    };
    std::thread::spawn(open).join().expect("the device opens")
}

fn read_packets(
    mut device: File,
    sender: &Sender<(Instant, Vec<u8>)>,
    mut rng: Xoshiro256PlusPlus,
    delay: Duration,
    loss: f64,
    is_cut: &AtomicBool,
    dropped: &AtomicU64,
) {
    let mut packet = [0; 65_536];
    // Ends when the namespace goes.
    while let Ok(length) = device.read(&mut packet) {
        if is_cut.load(Ordering::SeqCst) || rng.random::<f64>() < loss {
            dropped.fetch_add(1, Ordering::SeqCst);
        } else if sender
            .send((Instant::now() + delay, packet[..length].to_vec()))
            .is_err()
        {
            return;
        }
    }
}

fn write_packets(mut device: File, packets: &Receiver<(Instant, Vec<u8>)>) {
    for (due, packet) in packets {
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        if device.write_all(&packet).is_err() {
            return;
        }
    }
}
