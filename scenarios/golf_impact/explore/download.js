// Files are made in the browser, of what the page holds. A choice is its file's name.
const choice = cb_obj.value
if (choice == "") return
cb_obj.value = ""
const [name, kind] = choice.split(".")

function csv(columns) {
  const cell = (x) => typeof x == "string" ? `"${x.replaceAll('"', '""')}"` : String(x)
  const names = Object.keys(columns)
  const lines = Array.from(columns[names[0]], (_, i) => names.map((one) => cell(columns[one][i])).join(","))
  return new Blob([[names.join(","), ...lines].join("\n") + "\n"], {type: "text/csv"})
}
const some = (data, wanted) => Object.fromEntries(Object.entries(data).filter(([, column]) => wanted(column)))

async function made() {
  if (kind != "csv") return Bokeh.index.find_one(figures[name]).export(kind).to_blob()
  // Curves are columns of arrays: the table hasn't these.
  return csv(name == "path" ? path.data : some(pins.data, (column) => typeof column[0] != "object"))
}

made().then((blob) => {
  const link = document.createElement("a")
  link.href = URL.createObjectURL(blob)
  link.download = `golf-impact-${choice}`
  link.click()
  // Not at once: the browser may not have begun to read it.
  setTimeout(() => URL.revokeObjectURL(link.href), 60000)
})
