//! `cyclictest`, where it is installed: the usual reference for wake latency.

use super::settings::Benchmark;
use crate::latency::outcome::Cyclictest;
use std::process::Command;

/// How long it runs at most, s.
const MAX_S: u64 = 5;

/// Runs it with the loop's rate, priority and CPU, beside the running loop.
///
/// # Errors
/// A sentence for the operator.
pub(super) fn run(benchmark: &Benchmark) -> Result<Cyclictest, String> {
    let seconds = benchmark.options.duration.as_secs().clamp(1, MAX_S);
    let interval_us = benchmark.period_ns() / 1000;
    let mut arguments = vec![
        "--quiet".to_owned(),
        "--mlockall".to_owned(),
        "--threads=1".to_owned(),
        format!("--interval={interval_us}"),
        format!("--duration={seconds}"),
        format!("--priority={}", benchmark.config.realtime.priority),
    ];
    arguments.extend(benchmark.config.realtime.cpu.map(|cpu| format!("--affinity={cpu}")));
    let command = format!("cyclictest {}", arguments.join(" "));
    let output = Command::new("cyclictest")
        .args(&arguments)
        .output()
        .map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => {
                "cyclictest is not installed: it comes with the package rt-tests".to_owned()
            }
            _ => format!("cyclictest: {error}"),
        })?;
    let text = String::from_utf8_lossy(&output.stdout);
    let [min_us, mean_us, max_us] = ["Min:", "Avg:", "Max:"].map(|key| number_behind(&text, key));
    match (min_us, mean_us, max_us) {
        (Some(min_us), Some(mean_us), Some(max_us)) => Ok(Cyclictest {
            command,
            min_us,
            mean_us,
            max_us,
        }),
        _ => Err(format!(
            "`{command}` did not report a result: {}",
            String::from_utf8_lossy(&output.stderr).trim()
        )),
    }
}

/// The number behind a key such as `Avg:` on the line of a thread.
fn number_behind(text: &str, key: &str) -> Option<f64> {
    let line = text.lines().find(|line| line.trim_start().starts_with("T:"))?;
    let (_, rest) = line.split_once(key)?;
    rest.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::number_behind;

    #[test]
    fn its_line_is_read() {
        let text = "# /dev/cpu_dma_latency set to 0us\nT: 0 (48329) P:80 I:1000 C:   4998 Min:     12 Act:   47 Avg:   52 Max:     731\n";
        let numbers = ["Min:", "Avg:", "Max:"].map(|key| number_behind(text, key));
        assert_eq!(numbers, [Some(12.0), Some(52.0), Some(731.0)]);
        assert_eq!(number_behind("nothing", "Min:"), None);
    }
}
