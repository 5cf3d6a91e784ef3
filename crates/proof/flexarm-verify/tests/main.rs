//! The case studies, and the program that runs them.

mod program;
mod quick;
