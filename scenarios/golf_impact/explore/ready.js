// The page is there: take the system's choice of light or dark.
dark.active = matchMedia("(prefers-color-scheme: dark)").matches

// What has a name for screen readers passes it on to the part of it that takes the keyboard.
for (const view of Bokeh.index.all_views()) {
  const name = view.model.html_attributes?.["aria-label"]
  const part = view.shadow_el?.querySelector(".noUi-handle, input, select")
  if (name && part) part.setAttribute("aria-label", name)
}
