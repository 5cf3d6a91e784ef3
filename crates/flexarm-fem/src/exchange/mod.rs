//! Reduced matrices from and to other FE programs.
