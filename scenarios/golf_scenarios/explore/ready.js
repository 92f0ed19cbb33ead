// The page is there: take the system's choice of light or dark, and name what only looks named.
dark.active = matchMedia("(prefers-color-scheme: dark)").matches
