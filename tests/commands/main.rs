//! The commands as a user types them: output, files, exit codes, and error messages for wrong input.

mod advances;
mod analyze;
mod command_line;
mod experiment_reproduction;
mod explain;
mod explain_mujoco;
mod latency_page;
mod latency_sample;
mod licences;
mod manual;
mod mcap_python;
mod plan;
mod servo_bench;
mod servo_bench_record;
mod simulate;
mod workspace;
