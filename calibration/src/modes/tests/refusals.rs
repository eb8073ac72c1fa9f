//! Logs that cannot be used are refused, with every reason.
