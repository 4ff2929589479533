//! The program as it is used: the command line, the lab and the pictures.

mod cli;
mod cli_refusals;
mod lab;
mod lab_browser;
mod lab_long;
mod plots;
mod terminal;
