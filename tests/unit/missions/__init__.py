"""Mission files, frames, splines, and the formats that programs share."""
