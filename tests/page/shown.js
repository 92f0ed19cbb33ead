// What the page shows, of what is visible: [part, name, text]. Places in pictures are those of their own boxes, in whole units.
const all = (css, from = document) => [...from.querySelectorAll(css)].filter((x) => x.checkVisibility({visibilityProperty: true}))
const get = (id) => document.getElementById(id)
const text = (x) => x.textContent.replace(/[\s\u200b]+/g, " ").trim()
const places = (x, ...names) => names.map((name) => Math.round(x.getAttribute(name))).join(",")
const found = [], show = (part, name, ...texts) => found.push([part, name, texts.flat().filter(Boolean).join("; ")])

for (const id of ["hint", "headline", "state"]) show("head", id, text(get(id)))
show("head", "source", get("about").open && "unfolded", text(get("source")))
for (const id of ["command", "address"]) show("head", id, get(id).value.replace(/^file:.*#/, "#"))
show("head", "chosen", all("select").map((x) => `${x.id} ${x.value}`), all("[name=law]:checked").map((x) => `law ${x.value}`))
show("head", "disabled", all(":is(button, select, option, input):disabled").map((x) => x.id || text(x)))

for (const x of all("#controls [type=text]")) {
  const slider = get(`${x.name}_slider`), notes = ["idle", "refused"].map((kind) => text(get(`${x.name}_${kind}`)))
  const range = slider && `slider ${slider.value} from ${slider.min} to ${slider.max}: ${slider.ariaValueText}`
  show("controls", x.name, `${text(x.labels[0])} = ${x.value}`, x.ariaInvalid == "true" && "invalid", notes, range)
}
show("controls", "law", text(get("law_refused")))

for (const x of all("data")) show("results", x.id, all("th, td", x.closest("tr")).flatMap((cell) => [...cell.childNodes].map(text)), x.value && Number(x.value).toPrecision(10))
show("results", "equations", get("equations").innerHTML.replace(/<sub>(.)<.sub>/g, "_$1").split("\n"))

show("cursor", "at", all("#cursor tr").map((x) => [...x.cells].map(text).join(" ")), `slider ${get("scrub").value}: ${get("scrub").ariaValueText}`, all("#play").map((x) => `${text(x)} ${x.ariaPressed}`))
const body = (x) => ["x", "cx", "rx", "ry"].filter((name) => x.hasAttribute(name)).map((name) => `${name} ${Number(x.getAttribute(name)).toFixed(3)}`)
show("cursor", "bodies", all("#animation :is(rect, ellipse)").map((x) => body(x).join(" ")))
const figures = all("figure").map((x) => [x.id.replace("_figure", ""), x.querySelector("svg"), text((x.querySelector("label") ?? x.querySelector("figcaption")).firstChild)])
const marks = (svg) => all(".cursor, circle", svg).map((x) => x.matches("circle") ? places(x, "cx", "cy") : places(x, "x1", "x2"))
show("cursor", "dots", figures.map(([name, svg]) => `${name} ${marks(svg).join(" ")}`))

const anchors = {start: ">", middle: "|", end: "<"}
const label = (x) => x.hasAttribute("x") ? `${text(x)} ${anchors[x.getAttribute("text-anchor") ?? "start"]}${places(x, "x", "y")}` : text(x)
function curve(path) {
  const points = path.getAttribute("d").split(/[MLZ]/).filter(Boolean).map((point) => point.split(/[,H]/).map(Number))
  const some = [0, 1, 2, 3, 4].map((n) => points[Math.round(n * (points.length - 1) / 4)].slice(0, 2).map(Math.round))
  const means = [0, 1].map((n) => (points.reduce((sum, point) => sum + point[n], 0) / points.length).toFixed(2))
  return `${path.getAttribute("class")} ${path.getAttribute("style") ?? ""}(${points.length}) ${some.join(" ")} ⌀ ${means}`
}
for (const [name, svg, title] of figures) {
  show("pictures", name, title, svg.getAttribute("aria-label"), all("text", svg).filter(text).map(label))
  show("pictures", `${name}.curves`, all("path", svg).map(curve))
}

for (const [n, row] of all("#pins tr").entries()) show("pins", `pin ${n}`, all("th, td", row).map((x) => [...x.children].map((child) => child.value || child.ariaLabel || child.style.color).join(" ") || text(x)))
for (const [n, x] of all(":is(#tasks, #worksheet, #key) :is(table, p)").entries()) show("sheets", `part ${n}`, all("tr", x).map((row) => all("th, td", row).map(text).join(", ")), x.matches("p") && text(x))
return found
