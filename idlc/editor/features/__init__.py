"""One module for each group of requests that editors send."""
