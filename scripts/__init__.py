"""What is done with a checkout beside the package."""
