//! How the computer is set for a loop that must be in time: the kernel, its CPUs, and what else runs on them.
//!
//! [`settings`] reads the kernel's files; what they mean is judged in `assess`, which sees only their texts.

mod assess;

use super::cpus;
use assess::IdleState;
use serde::Serialize;
use std::fs::File;
use std::io::Read;

/// One of the computer's settings, and whether it suits the loop.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Setting {
    /// What was checked: `kernel`, `CPU governor`.
    pub subject: &'static str,
    /// What was found, in words.
    pub found: String,
    /// Whether it suits a real-time loop.
    pub good: bool,
    /// What to do about it: commands, kernel options, keys; null where nothing needs doing.
    pub remedy: Option<String>,
}

impl Setting {
    pub(crate) fn good(subject: &'static str, found: impl Into<String>) -> Self {
        Self {
            subject,
            found: found.into(),
            good: true,
            remedy: None,
        }
    }

    pub(crate) fn bad(subject: &'static str, found: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            subject,
            found: found.into(),
            good: false,
            remedy: Some(remedy.into()),
        }
    }
}

/// The computer's settings, for a loop that is pinned to `cpu`; absent: to none. What this computer has no file for is left
/// out.
pub fn settings(cpu: Option<usize>) -> Vec<Setting> {
    let online = cpus::online();
    // A loop cannot be pinned to a CPU that is not there: that request is refused, and the loop runs on any.
    let cpu = cpu.filter(|cpu| online.contains(cpu));
    let used = cpu.map_or_else(|| online.clone(), |cpu| vec![cpu]);
    let settings = [
        assess::count(&online),
        kernel(),
        clock_source(),
        isolation(cpu, &online),
        hyper_threading(cpu),
        Some(governor(cpu, &used)),
        Some(idle_states(cpu, &used)),
        throttling(),
        virtual_machine(cpu),
    ];
    settings.into_iter().flatten().collect()
}

fn read(path: &str) -> Option<String> {
    std::fs::read_to_string(path).ok().map(|text| text.trim().to_owned())
}

/// A file of one CPU (kernel doc sysfs-devices-system-cpu).
fn read_cpu(cpu: usize, file: &str) -> Option<String> {
    read(&format!("/sys/devices/system/cpu/cpu{cpu}/{file}"))
}

fn kernel() -> Option<Setting> {
    let version = read("/proc/sys/kernel/version")?;
    let realtime = read("/sys/kernel/realtime");
    let modes = read("/sys/kernel/debug/sched/preempt");
    let options = read("/proc/cmdline").unwrap_or_default();
    Some(assess::kernel(
        &version,
        realtime.as_deref(),
        modes.as_deref(),
        &options,
    ))
}

fn clock_source() -> Option<Setting> {
    let folder = "/sys/devices/system/clocksource/clocksource0";
    let current = read(&format!("{folder}/current_clocksource"))?;
    let available = read(&format!("{folder}/available_clocksource")).unwrap_or_default();
    Some(assess::clock_source(&current, &available))
}

fn isolation(cpu: Option<usize>, online: &[usize]) -> Option<Setting> {
    let mut isolated = cpus::parse(&read("/sys/devices/system/cpu/isolated")?);
    isolated.retain(|cpu| online.contains(cpu));
    let tickless = read("/sys/devices/system/cpu/nohz_full").map(|text| cpus::parse(&text));
    assess::isolation(cpu, &isolated, &tickless.unwrap_or_default(), online)
}

fn hyper_threading(cpu: Option<usize>) -> Option<Setting> {
    let cpu = cpu?;
    let siblings = read_cpu(cpu, "topology/thread_siblings_list")?;
    Some(assess::hyper_threading(cpu, &cpus::parse(&siblings)))
}

fn governor(cpu: Option<usize>, used: &[usize]) -> Setting {
    let governors: Vec<(usize, String)> = used
        .iter()
        .filter_map(|&used| Some((used, read_cpu(used, "cpufreq/scaling_governor")?)))
        .collect();
    assess::governor(cpu, &governors)
}

fn idle_states(cpu: Option<usize>, used: &[usize]) -> Setting {
    let states: Vec<IdleState> = used.iter().flat_map(|&used| idle_states_of(used)).collect();
    let driver = read("/sys/devices/system/cpu/cpuidle/current_driver");
    assess::idle_states(cpu, &states, driver.as_deref(), wake_latency_limit_us())
}

/// The CPU's idle states (kernel doc cpuidle), those first that sleep least deep.
fn idle_states_of(cpu: usize) -> impl Iterator<Item = IdleState> {
    (0..).map_while(move |number| {
        let read = |file| read_cpu(cpu, &format!("cpuidle/state{number}/{file}"));
        Some(IdleState {
            name: read("name")?,
            latency_us: read("latency")?.parse().ok()?,
            enabled: read("disable").is_none_or(|disable| disable == "0"),
        })
    })
}

/// The latency that no CPU's idle state may exceed now, because some process asks for it, µs (kernel doc pm_qos_interface).
fn wake_latency_limit_us() -> Option<u32> {
    let mut bytes = [0; 4];
    File::open("/dev/cpu_dma_latency").ok()?.read_exact(&mut bytes).ok()?;
    u32::try_from(i32::from_ne_bytes(bytes)).ok()
}

fn throttling() -> Option<Setting> {
    let runtime_us = read("/proc/sys/kernel/sched_rt_runtime_us")?.parse().ok()?;
    let period_us = read("/proc/sys/kernel/sched_rt_period_us")?.parse().ok()?;
    Some(assess::throttling(runtime_us, period_us))
}

fn virtual_machine(cpu: Option<usize>) -> Option<Setting> {
    assess::virtual_machine(cpu, &read("/proc/cpuinfo")?, &read("/proc/stat").unwrap_or_default())
}

#[cfg(test)]
mod tests;
