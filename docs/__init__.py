"""The documentation: pages, and what writes those that the code dictates."""
