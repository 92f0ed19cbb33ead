"""The page of `golf-impact explore`: one impact, interactive, in one HTML file."""
