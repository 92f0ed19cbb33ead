// Pinned cases, and files to download.
const COLOURS = ["#CC79A7", "#009E73", "#D55E00", "#999933", "#882255", "#888888", "#44AA99", "#DDCC77"]
let pins = []

function pin(name = "") {
  if (pins.length == COLOURS.length) return
  const color = COLOURS.find((colour) => pins.every((one) => one.color != colour))
  pins = [...pins, {...shown, color, name: name || titleOf(shown.values), query: query()}]
  drawPins()
}
function drawPins() {
  get("pin").disabled = pins.length == COLOURS.length
  const button = (label, n, onclick) => tag("button", {type: "button", textContent: label, ariaLabel: `${label} pin ${n}`, onclick})
  const rows = pins.map((one, n) => tag("tr", {},
    tag("th", {scope: "row"}, tag("span", {style: `color: ${one.color}`, ariaHidden: "true"}, "━━ "),
      tag("input", {type: "text", value: one.name, ariaLabel: `Name of pin ${n + 1}`, onchange: ({target}) => { one.name = target.value }})),
    ...one.cells.map((row) => tag("td", {className: row.level}, row.value === "" ? "–" : format(row, row.value).join(" ").trim())),
    tag("td", {}, button("Reopen", n + 1, () => change(one.values)), " ",
      button("Remove", n + 1, () => { pins = pins.filter((other) => other != one); drawPins(); get("pin").focus() }))))
  const head = [{label: "case"}, ...facts.readouts, {label: "do"}].map(({label, level = ""}) => tag("th", {scope: "col", className: level}, label))
  get("pins").replaceChildren(...(pins.length ? [tag("thead", {}, tag("tr", {}, ...head)), tag("tbody", {}, ...rows)] : []))
  drawCharts()
}

// Open a case, beside another one that is pinned: one step of undo.
function openBeside(values, beside, name) {
  const before = shown.values
  if (beside && request(beside) && !pins.some((one) => one.query == query())) pin(name)
  change(values, before)
}

// DOWNLOADS: files are made here. Columns are in SI units.

function csv(columns, rows) {
  // Of an impact without separation some results don't exist.
  const cell = (x) => typeof x == "string" ? `"${x.replaceAll('"', '""')}"` : Number.isNaN(x) ? "" : x
  const likeOf = (name) => name.endsWith("_energy") ? "kinetic_energy" : name.endsWith("_momentum") ? "momentum" : name == "time" ? "touch_time" : name
  const head = columns.map((name) => [facts.units[likeOf(name)]].filter((unit) => unit && unit != "1").reduce((text, unit) => `${text} (${unit})`, name))
  return [head, ...rows.map((row) => columns.map((name) => cell(row[name])))].map((row) => `${row}\n`).join("")
}
function svg(name) {
  const copy = charts[name].svg.cloneNode(true)
  copy.prepend(make("style", {}, document.querySelector("style").textContent), get("hatches").cloneNode(true))
  return new XMLSerializer().serializeToString(place(copy, {xmlns: "http://www.w3.org/2000/svg", width: 2 * WIDTH, height: 2 * HEIGHT}))
}
function download(choice) {
  const {path} = shown, names = Object.keys(path), tables = {
    "path.csv": () => csv(names, path.time.map((_, n) => Object.fromEntries(names.map((name) => [name, path[name][n]])))),
    "pins.csv": () => csv(["name", "query", ...facts.metrics], pins.map((one) => ({...one.metrics, name: one.name, query: one.query}))),
  }
  const text = tables[choice]?.() ?? svg(choice.replace(".svg", ""))
  tag("a", {href: URL.createObjectURL(new Blob([text])), download: `golf-impact-${choice}`}).click()
}
