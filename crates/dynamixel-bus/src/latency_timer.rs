//! The latency timer of USB adapters, which collect bytes before they pass them on.
//!
//! An FTDI chip (U2D2, most cheap adapters) waits 16 ms for more bytes unless told otherwise: four ticks of a 250 Hz loop.
//! The flag `ASYNC_LOW_LATENCY` makes its driver set 1 ms; sysfs shows whether that worked. Other ports and pseudo-terminals have no
//! such timer.

use std::os::fd::{AsRawFd, BorrowedFd};
use std::path::Path;

use super::Finding;

/// `struct serial_struct` of `linux/serial.h`.
#[repr(C)]
struct SerialStruct {
    kind: libc::c_int,
    line: libc::c_int,
    port: libc::c_uint,
    irq: libc::c_int,
    flags: libc::c_int,
    xmit_fifo_size: libc::c_int,
    custom_divisor: libc::c_int,
    baud_base: libc::c_int,
    close_delay: libc::c_ushort,
    io_type: libc::c_char,
    reserved: [libc::c_char; 1],
    hub6: libc::c_int,
    closing_wait: libc::c_ushort,
    closing_wait2: libc::c_ushort,
    iomem_base: *mut libc::c_uchar,
    iomem_reg_shift: libc::c_ushort,
    port_high: libc::c_uint,
    iomap_base: libc::c_ulong,
}

impl SerialStruct {
    const EMPTY: Self = Self {
        kind: 0,
        line: 0,
        port: 0,
        irq: 0,
        flags: 0,
        xmit_fifo_size: 0,
        custom_divisor: 0,
        baud_base: 0,
        close_delay: 0,
        io_type: 0,
        reserved: [0],
        hub6: 0,
        closing_wait: 0,
        closing_wait2: 0,
        iomem_base: std::ptr::null_mut(),
        iomem_reg_shift: 0,
        port_high: 0,
        iomap_base: 0,
    };
}

/// `ASYNC_LOW_LATENCY` of `linux/tty_flags.h`.
const LOW_LATENCY: libc::c_int = 1 << 13;

/// Longest latency that is tolerated, in ms.
const TOLERATED_MS: u32 = 1;

/// Sets the shortest latency. Reports a timer that was longer, and one that cannot be changed.
pub(super) fn correct(port: BorrowedFd<'_>, path: &Path) -> Option<Finding> {
    let before_ms = latency_timer_ms(path);
    let asked = ask_for_low_latency(port);
    // A port without a timer has nothing to correct, whatever the ioctl returns.
    let before_ms = before_ms.filter(|&timer_ms| timer_ms > TOLERATED_MS)?;
    let after_ms = latency_timer_ms(path).unwrap_or(before_ms);
    let what = format!(
        "{}: the USB adapter holds bytes back for up to {before_ms} ms",
        path.display()
    );
    if after_ms <= TOLERATED_MS {
        return Some(Finding::corrected(
            what,
            format!("low latency asked for, now {after_ms} ms"),
        ));
    }
    let refusal = asked
        .err()
        .map(|error| format!(" (the driver refused: {error})"))
        .unwrap_or_default();
    let file = format!(
        "/sys/class/tty/{}/device/latency_timer",
        device_name(path).unwrap_or_default()
    );
    Some(Finding::open(
        what,
        format!("as root: echo 1 > {file}, or a udev rule that does so{refusal}"),
    ))
}

fn ask_for_low_latency(port: BorrowedFd<'_>) -> std::io::Result<()> {
    let mut settings = SerialStruct::EMPTY;
    // SAFETY: the descriptor is open; TIOCGSERIAL fills in a `serial_struct`, which `SerialStruct` is laid out as, and any bytes are
    // valid in its integers and its raw pointer.
    if unsafe { libc::ioctl(port.as_raw_fd(), libc::TIOCGSERIAL, &raw mut settings) } != 0 {
        return Err(std::io::Error::last_os_error());
    }
    if settings.flags & LOW_LATENCY != 0 {
        return Ok(());
    }
    settings.flags |= LOW_LATENCY;
    // SAFETY: the descriptor is open; TIOCSSERIAL only reads the `serial_struct`.
    if unsafe { libc::ioctl(port.as_raw_fd(), libc::TIOCSSERIAL, &raw const settings) } != 0 {
        return Err(std::io::Error::last_os_error());
    }
    Ok(())
}

/// The timer according to sysfs; none for ports that have none.
fn latency_timer_ms(path: &Path) -> Option<u32> {
    let file = format!("/sys/class/tty/{}/device/latency_timer", device_name(path)?);
    std::fs::read_to_string(file).ok()?.trim().parse().ok()
}

/// `ttyUSB0` for `/dev/serial/by-id/…`.
fn device_name(path: &Path) -> Option<String> {
    let device = path.canonicalize().ok()?;
    Some(device.file_name()?.to_str()?.to_owned())
}
