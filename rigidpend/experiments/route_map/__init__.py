"""Route codes over a plane of two parameters."""
