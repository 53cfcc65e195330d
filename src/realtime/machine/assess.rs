//! What the kernel's texts mean for a loop that must be in time. Pure: texts in, judgement out.

use super::Setting;
use crate::realtime::cpus;

/// Longest that a CPU may take to leave its idle state, µs: as late as an ordinary timer may fire (timer slack), and a twentieth
/// of a tick at 1 kHz.
const WAKE_LATENCY_US: u32 = 50;

/// Least share of the time that must be left to real-time threads: no loop needs more.
const REALTIME_FRACTION: f64 = 0.5;

const RT_KERNEL: &str = "a PREEMPT_RT kernel bounds the worst wake lateness (Debian: `apt install linux-image-rt-amd64`; \
     Ubuntu: `pro enable realtime-kernel`; self-built: CONFIG_PREEMPT_RT); without it, rare late ticks of some milliseconds \
     are normal";

/// Clocks that are read in nanoseconds, without a call into the kernel.
const FAST_CLOCKS: [&str; 4] = ["tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "arch_sys_counter"];

/// One way of a CPU to be idle.
#[derive(Debug)]
pub(super) struct IdleState {
    /// The driver's name of it: `C6`.
    pub(super) name: String,
    /// Time to leave it, µs.
    pub(super) latency_us: u32,
    /// Whether the CPU may enter it.
    pub(super) enabled: bool,
}

/// How many CPUs there are; absent: not known.
pub(super) fn count(online: &[usize]) -> Option<Setting> {
    match online {
        [] => None,
        [_] => Some(Setting::bad(
            "CPUs",
            "only one, which the loop shares with all else",
            "take a computer with two CPUs or more, give the virtual machine a second one, or remove `nosmp` and `maxcpus=` \
             from the kernel's options",
        )),
        _ => Some(Setting::good(
            "CPUs",
            format!("{}: {}", online.len(), cpus::list(online)),
        )),
    }
}

/// When the kernel lets a woken thread run. `version` is of `uname -v`, `realtime` of /sys/kernel/realtime, `modes` of
/// /sys/kernel/debug/sched/preempt with the active one in parentheses, `options` the kernel's command line.
pub(super) fn kernel(version: &str, realtime: Option<&str>, modes: Option<&str>, options: &str) -> Setting {
    let is = |word| version.split_whitespace().any(|part| part == word);
    if realtime == Some("1") || is("PREEMPT_RT") || version.contains("PREEMPT RT") {
        return Setting::good("kernel", "fully preemptible (PREEMPT_RT)");
    }
    let preempt_full = "`preempt=full` among the kernel's options lets a woken loop run at once nearly everywhere";
    if is("PREEMPT_DYNAMIC") {
        return match modes.and_then(mode_in_force).or_else(|| mode_asked_for(options)) {
            // A lazy kernel is lazy with ordinary threads only.
            Some(mode @ ("full" | "lazy")) => Setting::bad(
                "kernel",
                format!("preemptible (PREEMPT_DYNAMIC, mode {mode}), not PREEMPT_RT"),
                RT_KERNEL,
            ),
            Some(mode) => Setting::bad(
                "kernel",
                format!("PREEMPT_DYNAMIC, mode {mode}: it finishes what it does before a woken loop may run"),
                format!("{preempt_full}; {RT_KERNEL}"),
            ),
            None => Setting::bad(
                "kernel",
                "PREEMPT_DYNAMIC, mode not readable",
                format!(
                    "{preempt_full}; `mount -t debugfs none /sys/kernel/debug` lets root see the mode; {RT_KERNEL}"
                ),
            ),
        };
    }
    if is("PREEMPT") {
        return Setting::bad("kernel", "preemptible (PREEMPT), not PREEMPT_RT", RT_KERNEL);
    }
    Setting::bad(
        "kernel",
        "not preemptible, or where it volunteers only: it finishes what it does before a woken loop may run",
        RT_KERNEL,
    )
}

fn mode_in_force(modes: &str) -> Option<&str> {
    let (_, rest) = modes.split_once('(')?;
    rest.split_once(')').map(|(mode, _)| mode)
}

/// The last `preempt=` among the kernel's options; what follows `--` is for the first process.
fn mode_asked_for(options: &str) -> Option<&str> {
    let options = options.split_whitespace().take_while(|&option| option != "--");
    options.filter_map(|option| option.strip_prefix("preempt=")).last()
}

/// How the time is read: `current` of those `available`.
pub(super) fn clock_source(current: &str, available: &str) -> Setting {
    let subject = "clock source";
    if FAST_CLOCKS.contains(&current) {
        return Setting::good(subject, current);
    }
    let remedy = match available.split_whitespace().find(|name| FAST_CLOCKS.contains(name)) {
        Some(better) => format!("`echo {better} > /sys/devices/system/clocksource/clocksource0/current_clocksource`"),
        None => "prefer tsc (kernel option tsc=reliable)".to_owned(),
    };
    Setting::bad(subject, current, format!("reading it costs microseconds; {remedy}"))
}

/// Whether the loop has its CPU for itself: `isolated` from other threads, `tickless` without the kernel's periodic tick.
/// Absent: there is but one CPU.
pub(super) fn isolation(
    cpu: Option<usize>,
    isolated: &[usize],
    tickless: &[usize],
    online: &[usize],
) -> Option<Setting> {
    let subject = "CPU isolation";
    let [_, .., last] = online else { return None };
    let options = |cpu| format!("isolcpus={cpu} nohz_full={cpu} rcu_nocbs={cpu}");
    Some(match (cpu, isolated) {
        (Some(cpu), _) if isolated.contains(&cpu) => {
            let tick = if tickless.contains(&cpu) {
                ", and has no periodic tick"
            } else {
                ""
            };
            Setting::good(
                subject,
                format!("the loop's CPU {cpu} is isolated from other threads{tick}"),
            )
        }
        (Some(cpu), _) => Setting::bad(
            subject,
            format!("other threads run on the loop's CPU {cpu}, too"),
            format!("add `{}` to the kernel's options", options(cpu)),
        ),
        (None, []) => Setting::bad(
            subject,
            "none: the loop runs among all other threads",
            format!(
                "add `{}` to the kernel's options, and set realtime.cpu = {last}",
                options(*last)
            ),
        ),
        (None, [.., last]) => Setting::bad(
            subject,
            format!("{} isolated, but the loop is not pinned there", cpus::named(isolated)),
            format!("set realtime.cpu = {last}"),
        ),
    })
}

/// Whether a pinned loop shares the units of its core with another CPU; `siblings` are the CPUs of the core.
pub(super) fn hyper_threading(cpu: usize, siblings: &[usize]) -> Setting {
    let subject = "hyper-threading";
    let others: Vec<usize> = siblings.iter().copied().filter(|&sibling| sibling != cpu).collect();
    let Some(other) = others.first() else {
        return Setting::good(subject, format!("CPU {cpu} has its core for itself"));
    };
    Setting::bad(
        subject,
        format!(
            "CPU {cpu} shares its core with {}, and is slower while that works",
            cpus::named(&others)
        ),
        format!("`echo 0 > /sys/devices/system/cpu/cpu{other}/online`, or `nosmt` among the kernel's options"),
    )
}

/// Who chooses the clock rate: `governors` of the loop's CPU, or of all.
pub(super) fn governor(cpu: Option<usize>, governors: &[(usize, String)]) -> Setting {
    let subject = "CPU governor";
    let slow = governors.iter().filter(|(_, governor)| governor != "performance");
    let (slow, names): (Vec<usize>, Vec<&str>) = slow.map(|(cpu, governor)| (*cpu, governor.as_str())).unzip();
    match (governors, names.first()) {
        ([], _) => Setting::good(subject, "none here: the host or the firmware sets the clock rate"),
        (_, None) => Setting::good(subject, "performance"),
        (_, Some(name)) => {
            let only = cpu.map_or(String::new(), |cpu| format!("-c {cpu} "));
            Setting::bad(
                subject,
                format!("{name} on {}", cpus::named(&slow)),
                format!("`cpupower {only}frequency-set -g performance` saves tens of microseconds per wake"),
            )
        }
    }
}

/// How deep a CPU sleeps: `states` of the loop's CPU, or of all; `limit_us` is what some process asks for at most.
pub(super) fn idle_states(
    cpu: Option<usize>,
    states: &[IdleState],
    driver: Option<&str>,
    limit_us: Option<u32>,
) -> Setting {
    let subject = "idle states";
    let driver = match driver {
        Some(driver) if driver != "none" => format!("driver {driver}"),
        _ => "no driver".to_owned(),
    };
    let may_enter = |state: &&IdleState| state.enabled && limit_us.is_none_or(|limit_us| state.latency_us <= limit_us);
    let Some(deepest) = states.iter().filter(may_enter).max_by_key(|state| state.latency_us) else {
        return Setting::good(subject, format!("none listed ({driver})"));
    };
    let found = format!(
        "the deepest is {}, left within {} µs ({driver})",
        deepest.name, deepest.latency_us
    );
    if deepest.latency_us <= WAKE_LATENCY_US {
        return Setting::good(subject, found);
    }
    let only = cpu.map_or(String::new(), |cpu| format!("-c {cpu} "));
    Setting::bad(
        subject,
        found,
        format!(
            "`cpupower {only}idle-set -D {WAKE_LATENCY_US}` until the next start, `processor.max_cstate=1` (Intel: \
             `intel_idle.max_cstate=1`) among the kernel's options for good, or a process that holds /dev/cpu_dma_latency open"
        ),
    )
}

/// How much time the kernel leaves to real-time threads: `runtime_us` of each `period_us`; -1: all.
pub(super) fn throttling(runtime_us: i64, period_us: i64) -> Setting {
    let subject = "real-time throttling";
    if runtime_us < 0 {
        return Setting::good(subject, "off");
    }
    let found = format!("{runtime_us} of each {period_us} µs may be real time");
    if (runtime_us as f64) < REALTIME_FRACTION * period_us as f64 {
        Setting::bad(
            subject,
            found,
            "`sysctl -w kernel.sched_rt_period_us=1000000 kernel.sched_rt_runtime_us=950000`",
        )
    } else {
        Setting::good(subject, format!("{found}; the loop needs far less"))
    }
}

/// Whether a host lies under this computer, by /proc/cpuinfo, and what it took, by /proc/stat. Absent if the processor does
/// not report it, as ARM's does not.
pub(super) fn virtual_machine(cpu: Option<usize>, cpuinfo: &str, stat: &str) -> Option<Setting> {
    let subject = "virtual machine";
    let flags = cpuinfo.lines().find(|line| line.starts_with("flags"))?;
    if !flags.split_whitespace().any(|flag| flag == "hypervisor") {
        return Some(Setting::good(subject, "none"));
    }
    let stolen = stolen_fraction(cpu, stat).map_or(String::new(), |fraction| {
        format!("; so far it took {:.2} % of the time", fraction * 100.0)
    });
    Some(Setting::bad(
        subject,
        format!(
            "a host can take the CPU away, and each wake and each signal to another CPU may cost a trip to it{stolen}"
        ),
        "run on the computer itself; else pin the virtual CPUs to isolated ones of the host, and add `idle=poll` to the \
         kernel's options here, so that an idle CPU need not be woken by the host",
    ))
}

/// Share of the time since the start that the host ran something else while the loop's CPU, or any, had work: steal time of
/// /proc/stat (man page proc_stat(5)).
fn stolen_fraction(cpu: Option<usize>, stat: &str) -> Option<f64> {
    let name = cpu.map_or("cpu".to_owned(), |cpu| format!("cpu{cpu}"));
    let line = stat
        .lines()
        .find_map(|line| line.strip_prefix(name.as_str())?.strip_prefix(' '))?;
    // User, nice, system, idle, iowait, irq, softirq, steal; the guests' time after them is part of the first two.
    let ticks: Vec<f64> = line
        .split_whitespace()
        .take(8)
        .map_while(|ticks| ticks.parse().ok())
        .collect();
    let total: f64 = ticks.iter().sum();
    (total > 0.0).then_some(ticks.get(7)? / total)
}
