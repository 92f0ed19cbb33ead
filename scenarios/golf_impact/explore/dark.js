// Light or dark: the colours are in page.html; canvases are painted again to take them.
document.documentElement.dataset.theme = cb_obj.active ? "dark" : "light"
cb_obj.label = cb_obj.active ? "Light" : "Dark"
for (const figure of Object.values(figures)) {
  Bokeh.index.find_one(figure).request_repaint()
  for (const part of figure.center) if (part.type == "Legend") part.change.emit()
}
