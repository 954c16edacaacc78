//! TPCAP benchmark files.
