//! TODO(twin)
