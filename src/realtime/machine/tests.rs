use super::assess::{self, IdleState};
use super::{Setting, settings};

/// Case, judgement, whether it should be good, and a part of what should be found or else be told to do.
type Case = (&'static str, Option<Setting>, bool, &'static str);

fn idle(name: &str, latency_us: u32, enabled: bool) -> IdleState {
    IdleState {
        name: name.to_owned(),
        latency_us,
        enabled,
    }
}

/// Of a notebook, whose two deepest are far too slow.
fn notebook() -> [IdleState; 4] {
    [
        idle("POLL", 0, true),
        idle("C1_ACPI", 1, true),
        idle("C2_ACPI", 151, true),
        idle("C3_ACPI", 1034, false),
    ]
}

fn governors(names: &[&str]) -> Vec<(usize, String)> {
    names.iter().map(|&name| name.to_owned()).enumerate().collect()
}

fn kernels() -> Vec<Case> {
    let assess = |version, modes, options| Some(assess::kernel(version, None, modes, options));
    let dynamic = "#1 SMP PREEMPT_DYNAMIC Debian 6.12.9-1 (2025-01-10)";
    vec![
        (
            "PREEMPT_RT",
            assess("#1 SMP PREEMPT_RT Debian 6.12.9-1", None, ""),
            true,
            "PREEMPT_RT",
        ),
        (
            "before it was merged",
            assess("#1 SMP PREEMPT RT", None, ""),
            true,
            "PREEMPT_RT",
        ),
        (
            "by its own file",
            Some(assess::kernel("#1 SMP", Some("1"), None, "")),
            true,
            "PREEMPT_RT",
        ),
        (
            "full",
            assess(dynamic, Some("none voluntary (full)"), ""),
            false,
            "linux-image-rt",
        ),
        (
            "voluntary",
            assess(dynamic, Some("none (voluntary) full lazy"), ""),
            false,
            "`preempt=full`",
        ),
        (
            "asked for at the start",
            assess(dynamic, None, "quiet preempt=full -- preempt=none"),
            false,
            "a PREEMPT_RT kernel bounds",
        ),
        (
            "not readable",
            assess(dynamic, None, "quiet"),
            false,
            "mount -t debugfs",
        ),
        (
            "always preemptible",
            assess("#1 SMP PREEMPT", None, ""),
            false,
            "linux-image-rt",
        ),
        (
            "a server's",
            assess("#45-Ubuntu SMP", None, ""),
            false,
            "linux-image-rt",
        ),
    ]
}

fn cpus() -> Vec<Case> {
    let two: &[usize] = &[0, 1];
    vec![
        ("two CPUs", assess::count(two), true, "2: 0-1"),
        ("one CPU", assess::count(&[0]), false, "two CPUs or more"),
        (
            "not isolated",
            assess::isolation(None, &[], &[], two),
            false,
            "isolcpus=1 nohz_full=1 rcu_nocbs=1",
        ),
        (
            "not isolated, not pinned",
            assess::isolation(None, &[], &[], two),
            false,
            "realtime.cpu = 1",
        ),
        (
            "pinned elsewhere",
            assess::isolation(Some(0), &[1], &[], two),
            false,
            "isolcpus=0 ",
        ),
        (
            "isolated in vain",
            assess::isolation(None, &[1], &[1], two),
            false,
            "realtime.cpu = 1",
        ),
        (
            "isolated",
            assess::isolation(Some(1), &[1], &[], two),
            true,
            "isolated from other threads",
        ),
        (
            "tickless",
            assess::isolation(Some(1), &[1], &[1], two),
            true,
            "no periodic tick",
        ),
        (
            "its own core",
            Some(assess::hyper_threading(1, &[1])),
            true,
            "for itself",
        ),
        (
            "a shared core",
            Some(assess::hyper_threading(1, &[1, 5])),
            false,
            "cpu5/online",
        ),
    ]
}

fn clocks_and_sleep() -> Vec<Case> {
    let clock = |current| Some(assess::clock_source(current, "tsc hpet acpi_pm"));
    let governor = |cpu, names: &[&str]| Some(assess::governor(cpu, &governors(names)));
    let idle_states = |states: &[IdleState], limit| Some(assess::idle_states(None, states, Some("acpi_idle"), limit));
    vec![
        ("tsc", clock("tsc"), true, "tsc"),
        ("hpet beside tsc", clock("hpet"), false, "echo tsc >"),
        (
            "hpet alone",
            Some(assess::clock_source("hpet", "hpet acpi_pm")),
            false,
            "tsc=reliable",
        ),
        (
            "performance",
            governor(None, &["performance", "performance"]),
            true,
            "performance",
        ),
        (
            "schedutil",
            governor(None, &["performance", "schedutil"]),
            false,
            "cpupower frequency-set -g performance",
        ),
        (
            "schedutil where pinned",
            governor(Some(0), &["schedutil"]),
            false,
            "cpupower -c 0 frequency-set",
        ),
        ("no governor", governor(None, &[]), true, "the host or the firmware"),
        (
            "a notebook",
            idle_states(&notebook(), None),
            false,
            "cpupower idle-set -D 50",
        ),
        (
            "a notebook, held awake",
            idle_states(&notebook(), Some(10)),
            true,
            "C1_ACPI, left within 1 µs",
        ),
        (
            "a notebook, at ease",
            idle_states(&notebook(), Some(2_000_000_000)),
            false,
            "processor.max_cstate=1",
        ),
        ("shallow", idle_states(&notebook()[..2], None), true, "acpi_idle"),
        (
            "no idle states",
            Some(assess::idle_states(None, &[], Some("none"), None)),
            true,
            "none listed",
        ),
        (
            "throttled a little",
            Some(assess::throttling(950_000, 1_000_000)),
            true,
            "far less",
        ),
        ("not throttled", Some(assess::throttling(-1, 1_000_000)), true, "off"),
        (
            "no real time left",
            Some(assess::throttling(0, 1_000_000)),
            false,
            "sched_rt_runtime_us=950000",
        ),
    ]
}

fn hosts() -> Vec<Case> {
    let guest = "processor\t: 0\nflags\t\t: fpu tsc hypervisor lahf_lm\n";
    let metal = "processor\t: 0\nflags\t\t: fpu tsc lahf_lm\n";
    vec![
        ("a guest", assess::virtual_machine(None, guest, ""), false, "idle=poll"),
        ("its own master", assess::virtual_machine(None, metal, ""), true, "none"),
    ]
}

#[test]
fn every_setting_is_judged_with_a_remedy() {
    let tables = [kernels(), cpus(), clocks_and_sleep(), hosts()];
    for (case, setting, good, part) in tables.into_iter().flatten() {
        let setting = setting.expect(case);
        assert_eq!(setting.good, good, "{case}: {setting:?}");
        let text = setting.remedy.as_ref().unwrap_or(&setting.found);
        assert!(text.contains(part), "{case}: {setting:?}");
        assert_eq!(setting.remedy.is_none(), good, "{case}: {setting:?}");
    }
}

#[test]
fn what_cannot_be_judged_is_left_out() {
    assert_eq!(assess::count(&[]), None);
    assert_eq!(assess::isolation(None, &[], &[], &[0]), None);
    assert_eq!(
        assess::virtual_machine(None, "processor\t: 0\nFeatures\t: fp asimd\n", ""),
        None
    );
}

#[test]
fn the_time_that_the_host_took_is_that_of_the_loops_cpu() {
    let stat = "cpu  60 0 20 100 0 0 0 20 0 0\ncpu0 30 0 10 50 0 0 0 10 0 0\ncpu1 50 0 10 40 0 0 0 0 0 0\nintr 7\n";
    for (cpu, part) in [(None, "took 10.00 %"), (Some(1), "took 0.00 %")] {
        let setting = assess::virtual_machine(cpu, "flags : hypervisor\n", stat).expect("the processor tells");
        assert!(setting.found.contains(part), "{}", setting.found);
    }
    let untold = assess::virtual_machine(Some(2), "flags : hypervisor\n", stat).expect("the processor tells");
    assert!(!untold.found.contains("took"), "{}", untold.found);
}

/// Whatever computer this is: its files are read, and what is not good comes with a remedy.
#[test]
fn this_computer_is_judged() {
    for cpu in [None, Some(0), Some(1023)] {
        let settings = settings(cpu);
        for subject in ["CPUs", "kernel", "CPU governor", "idle states"] {
            assert!(settings.iter().any(|setting| setting.subject == subject), "{subject}");
        }
        for setting in settings {
            assert_eq!(setting.good, setting.remedy.is_none(), "{setting:?}");
        }
    }
}
