//! Logs as they are brought: formats, clocks, gaps, cuts and drafts of a study, each read to the
//! values that are true.

mod accelerometers;
mod bands;
mod cut_logs;
mod drafted_time;
mod driven;
mod encoders;
mod first_day;
mod free_motion;
mod joined;
mod late_force;
mod log_formats;
mod long_records;
mod matlab_files;
mod noise;
mod odd_logs;
mod one_event;
mod one_way;
mod quasi_static;
mod real_logs;
mod records_differ;
mod runs;
mod short_waves;
mod standstill;
mod study_from;
mod time_as_it_is;
mod two_loggers;
