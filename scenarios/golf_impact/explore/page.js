// The page: what the user sets goes to evaluator.py as a request; its results fill figures and tables.
const get = (id) => document.getElementById(id)
const facts = JSON.parse(get("facts").textContent)
const models = {}
const model = (name) => models[name] ??= Bokeh.documents[0].get_model_by_name(name)
const quantities = new Map(facts.quantities.map((quantity) => [quantity.name, quantity]))
const HINT = "Move a slider, or type any number that the FMU allows, also with a unit (95mph). Point at a curve, or press Play, to see one instant in all pictures."
const COLOURS = ["#CC79A7", "#009E73", "#D55E00", "#999933", "#882255", "#888888", "#44AA99", "#DDCC77"]

// Bokeh 3.9 writes the style sheet of every part at every paint, mostly the same again, and reads CSS properties in between: each time
// the browser computes all styles anew. Equal sheets are left alone, and properties, which are those of page.css for :root, are kept.
function replace(path, kind, name, method) {
  const {prototype} = Bokeh.require(path)[kind], old = prototype[name]
  if (!old) console.warn(`Bokeh ${Bokeh.version} has no ${kind}.${name}`)
  prototype[name] = function (...values) { return method.call(this, old, ...values) }
}
const properties = new Map()
replace("core/dom", "InlineStyleSheet", "_update", function (old, css) { if (css != this.css) old.call(this, css) })
replace("core/visuals/visual", "VisualProperties", "_get_css_value", function (old, name) {
  const key = this.css_prefix + name
  if (!properties.has(key)) properties.set(key, getComputedStyle(document.documentElement).getPropertyValue(key))
  return properties.get(key)
})
// Nothing on the page is placed beside the element of a glyph renderer, whose place changes with every curve.
const RENDERER = ["models/renderers/glyph_renderer", "GlyphRendererView"]
replace(...RENDERER, "update_position", () => {})
// Nothing is selected, muted or decimated, and no range follows data: of five glyphs of a renderer one is kept up to date.
replace(...RENDERER, "set_data", async function () {
  this.all_indices = this.model.view.indices
  await this.glyph.set_data(this.model.data_source, this.all_indices)
  await this.set_visuals()
  this._update_masked_indices()
})
replace(...RENDERER, "set_visuals", async function () {
  this.glyph.set_visuals(this.model.data_source, this.all_indices)
  this.glyph.after_visuals()
  await this.glyph.after_lazy_visuals()
})
replace(...RENDERER, "map_data", function () { this.glyph.map_data() })
// Figures are painted from here: see `repaint`.
replace("models/plots/plot", "PlotView", "schedule_paint", () => {})

// Numbers: a request at a time, to this machine's server or to the worker; both take and return JSON.

async function viaServer(body) {
  const response = await fetch("impact", {method: "POST", body})
  if (!response.ok) throw new Error(`the server replies with status ${response.status}`)
  return response.text()
}

let worker = null
const viaWorker = (body) => new Promise((resolve, reject) => {
  worker.onmessage = ({data}) => data.failed ? reject(new Error(data.failed)) : resolve(data.result)
  worker.onerror = (event) => reject(new Error(event.message || "worker.js or pyodide/pyodide.mjs can't be loaded"))
  worker.postMessage(body)
})
const evaluate = async (request) => JSON.parse(await (facts.exported ? viaWorker : viaServer)(JSON.stringify(request)))

function report(text, failed = false) {
  get("runtime").textContent = text
  get("runtime").classList.toggle("failed", failed)
}

async function startWorker() {
  report("Loading Python (some 6 MB): the controls work as soon as it is there.")
  const late = setTimeout(() => report("Python has not started within 60 s: reload the page, or try another browser.", true), 60000)
  worker = new Worker("worker.js", {type: "module"})
  showCheck(await evaluate({check: true}).finally(() => clearTimeout(late)))
}

function showCheck({count, worst}) {
  const same = worst <= 1e-12, numbers = `${count} numbers agree with the FMUs' within ${worst.toExponential(1)}`
  report(`The physics runs in ${facts.exported ? "your browser" : "golf-impact"}; ${numbers}${same ? "" : ": don't rely on them"}.`, !same)
}

function requestCheck() {
  report("Building the FMUs if need be, and comparing the examples' numbers with theirs.")
  request("check", {check: true}, showCheck)
}

// The newest request of a kind waits while another runs; none is queued.
const waiting = new Map()
let running = null
async function run() {
  try {
    for (const [kind, [message, use]] of waiting) {
      waiting.delete(kind)
      use(await evaluate(message))
    }
  } catch (error) {
    report(`No new numbers: ${error.message}. Reload the page when that is mended.`, true)
    setReady(false)
  }
  running = null
}
function request(kind, message, use) {
  waiting.set(kind, [message, use])
  return running ??= run()
}

// State: the result that is shown, the values requested last, and the pins (results with name and color).
let shown = facts.result
let requested = {...shown.values}
let pins = [], drawnPins = null
const unit = () => get("unit").value
const unitOf = (quantity) => quantity.unit in facts.speeds ? unit() : quantity.unit
const size = (quantity) => quantity.unit in facts.speeds ? facts.speeds[unit()] : quantity.scale
const fromSi = (quantity, value) => Number((value / size(quantity)).toPrecision(8))

function setReady(ready) {
  for (const fieldset of document.querySelectorAll("fieldset:not(.wide)")) fieldset.disabled = !ready
  if (ready) document.body.dataset.ready = "yes"
  else delete document.body.dataset.ready
}

// Launch and flight, more than half of the evaluation, wait until no slider moves but their own.
function requestImpact(values = {}, shot = true) {
  Object.assign(requested, values)
  return request("impact", {values: requested, unit: unit(), shot: shot && !isSimple()}, (result) => show(result, Object.keys(values)[0], shot))
}
const requestSweep = () => request("sweep", {values: shown.values, over: get("over").value}, drawSweep)

// Undo: values before each change, of a slider before it began to move.
const past = []
let moving = null, sweepSoon = 0
function change(values, shot) {
  past.push(shown.values)
  get("undo").disabled = false
  return requestImpact(values, shot)
}
function undo() {
  const now = JSON.stringify(shown.values)
  let values = past.pop()
  while (past.length && JSON.stringify(values) == now) values = past.pop()
  get("undo").disabled = !past.length
  requestImpact(values)
}

// The simple level is law 2 without exponent and COR line.
const SIMPLE = {...facts.defaults, law: 2}
const isSimple = () => get("level").value == "simple"
const opening = () => isSimple() ? SIMPLE : {...facts.defaults, ...facts.opening}
function setLevel(level) {
  get("level").value = document.documentElement.dataset.level = level
  for (const option of get("picture").options) option.hidden = isSimple() && !facts.simple_pictures.includes(option.value)
  if (get("picture").selectedOptions[0].hidden) get("picture").value = "force"
  choosePicture()
  // Where there is room below the few controls.
  if (isSimple() && innerWidth >= 760) get("controls").append(get("tasks"))
  else get("hint").after(get("tasks"))
}
function changeLevel() {
  setLevel(get("level").value)
  const hidden = ["law", "exponent", "restitution_at_rest", "ball_speed"].some((name) => shown.values[name] != SIMPLE[name])
  if (isSimple() && hidden) change(SIMPLE)
  else requestImpact()
}
const address = () => new URL(`?${shown.query}${isSimple() ? "&level=simple" : ""}`, location).href
const setAddress = () => history.replaceState(null, "", address())

// On a phone one picture is beside the sliders.
function choosePicture() {
  for (const picture of document.querySelectorAll(".picture")) picture.classList.toggle("chosen", picture.id == `picture_${get("picture").value}`)
}

function show(result, control, shot) {
  for (const place of document.querySelectorAll(".refused")) place.textContent = ""
  get("announced").textContent = result.refused || result.state || Object.values(result.remarks).join(" ")
  if ("refused" in result) {
    const place = get(`${result.about || control}_refused`) ?? get("hint")
    place.textContent = result.refused
    place.closest("details")?.setAttribute("open", "")
    // Another control can't correct an unreadable text: the next request has the last accepted value.
    if (result.unread) requested[result.about] = shown.values[result.about]
    return
  }
  // What examples say is of controls that the simple level hasn't.
  shown = {...result, hint: !isSimple() && result.hint || HINT}
  if (!shot) for (const row of shown.readouts.slice(-3)) row.value = "…"
  if (shot && !moving) setAddress()
  draw(shot)
  // So do S and COR over a variable.
  clearTimeout(sweepSoon)
  sweepSoon = setTimeout(() => shot ? requestSweep() : requestImpact(), 200)
}

// Painting: those figures in sight in which something has changed, at once, so that the next frame has them; layout, pictures out of
// sight and the address wait until nothing has changed for a while.
const unseen = new Set(), pending = new Set(), views = new Map()
let frame = 0, late = 0

function viewOf(figure) {
  if (!views.has(figure)) views.set(figure, Bokeh.index.find_one(figure))
  return views.get(figure)
}

function paintFrame() {
  frame = 0
  for (const figure of pending) {
    const view = viewOf(figure)
    if (view._invalidate_all || view._invalidated_painters.size) view.paint()
  }
  pending.clear()
}

const figures = () => Bokeh.documents[0].roots()
function repaint(some = figures()) {
  for (const figure of some) if (!unseen.has(figure)) pending.add(figure)
  frame ||= setTimeout(paintFrame)
  clearTimeout(late)
  late = setTimeout(() => {
    for (const figure of figures()) viewOf(figure).repaint()
    setAddress()
  }, 400)
}

// Drawing

// Why a control has no effect.
const IDLE = {
  b: ({restitution_at_rest}) => restitution_at_rest && "no effect: the COR line determines the damping",
  restitution_slope: ({restitution_at_rest}) => !restitution_at_rest && "no effect while COR at zero speed is 0",
  reference_compression: ({exponent}) => exponent == 1 && "no effect while n is 1",
}

function drawControls({values, remarks}) {
  for (const [name, quantity] of quantities) {
    const field = get(name), slider = get(`${name}_slider`), value = fromSi(quantity, values[name]), why = IDLE[name]?.(values)
    // What is being typed stays.
    if (name != typing && (Number(field.value) != value || !field.value)) field.value = value
    if (field.ariaValueNow != value) field.ariaValueNow = value
    if (slider) slider.value = value
    if (name in IDLE)
      for (const control of [field, slider, get("over").querySelector(`[value=${name}]`)]) if (control) control.disabled = why
    setText(get(`${name}_idle`), why || remarks[name] || "")
  }
  if (get("over").selectedOptions[0].disabled) get("over").value = "club_speed"
  get("controls").law.value = values.law
}

// Texts are set where they have changed.
function setText(element, text) { if (element.textContent != text) element.textContent = text }

// A table of two columns: its rows are made once.
function drawRows(table, rows) {
  if (!table.rows.length) table.append(...rows.map(({id = "", label}) => tag("tr", {id, className: levelOf(id)},
    tag("th", {scope: "row"}, label, tag("small")), tag("td", {}, "", tag("span"), tag("small")))))
  rows.forEach(({meaning = "", value, printed = ""}, n) => {
    const [small, span, other] = table.rows[n].querySelectorAll("small, span")
    setText(small, meaning); setText(span, value); setText(other, printed)
  })
}

function draw(shot = true) {
  const {path, flight, ranges} = shown
  drawControls(shown)
  for (const id of ["ball", "club"]) get(id).value = shown[id]
  get("command").value = shown.command || address()
  setText(get("same"), shown.command ? "The same case as a command" : "The same case as a link (golf-impact run has no loft, attack angle and friction)")
  setText(get("copy"), shown.command ? "Copy command" : "Copy link")
  for (const id of ["source", "hint", "state"]) setText(get(id), shown[id])
  setText(get("equations"), shown.equations.join("\n"))
  drawRows(get("readouts"), shown.readouts.map((row) => ({...row, id: row.metric})))
  const [smash, restitution, , ball] = shown.readouts
  setText(get("summary").firstChild, `S ${smash.value}  COR ${restitution.value}  ${ball.value}`)
  for (const name in ranges) if (shot || name != "distance" && name != "height") {
    const all = [ranges, ...pins.map((pin) => pin.ranges)].map((ranges) => ranges[name])
    model(`${name}_range`).setv({start: Math.min(...all.map(([low]) => low)), end: Math.max(...all.map(([, high]) => high))})
  }
  model("path").data = path
  if (shot) model("flight_path").data = flight
  if (drawnPins != pins) model("pinned").data = columns(["color", ...Object.keys({...path, ...flight})], pins.map((pin) => ({...pin, ...pin.path, ...pin.flight})))
  drawnPins = pins
  const top = model("force_range").end
  model("peak").setv({x: shown.metrics.time_of_max_force, y: top, text: shown.peak})
  model("area").setv({x: 0, y: top, text: shown.area})
  model("velocities").left[0].axis_label = `velocity (${unit()})`
  moveCursor()
}

const columns = (names, rows) => Object.fromEntries(names.map((name) => [name, rows.map((row) => row[name])]))

function tag(name, attributes, ...children) {
  const element = Object.assign(document.createElement(name), attributes)
  element.append(...children)
  return element
}

function drawSweep({swept, over}) {
  const quantity = quantities.get(over), scale = quantity.scale / size(quantity)
  model("swept").data = {...swept, x: swept.x.map((value) => value / size(quantity))}
  model("here").data = {x: [shown.values[over] / size(quantity)]}
  model("sweep").x_range.setv({start: quantity.low * scale, end: quantity.high * scale})
  model("sweep").below[0].axis_label = `${quantity.label} (${unitOf(quantity)})`
  repaint([model("sweep")])
}

// Cursor: the sample that is nearest by some distance is shown in all pictures.
const nearest = (distance) => shown.path.time.reduce((best, _, i) => distance(i) < distance(best) ? i : best, 0)

function moveCursor() {
  const {path} = shown, start = path.time[0], duration = path.time.at(-1) - start
  const at = start + Number(get("scrub").value) * duration, i = nearest((i) => Math.abs(path.time[i] - at))
  model("cursor").data = Object.fromEntries(Object.entries(path).map(([name, column]) => [name, [column[i]]]))
  const text = (name, scale, digits, unit) => `${(path[name][i] * scale).toFixed(digits).replace("-", "−")} ${unit}`
  drawRows(get("cursor"), Object.entries({
    time: text("time", 1e6, 1, "µs"), force: text("force", 1, 0, "N"), compression: text("compression", 1e3, 2, "mm"),
    club: text("club_shown", 1, 2, unit()), ball: text("ball_shown", 1, 2, unit()), played: `${Math.round(PLAYED / duration / 100) * 100} × slower`,
  }).map(([label, value]) => ({label, value})))
  repaint()
}

// Pointer or finger: the cursor goes to the nearest sample, unless the animation plays.
function point(picture, {x, y}) {
  if (playing()) return
  const {time, compression, force} = shown.path, {x_range, y_range} = picture
  const far = (i) => Math.hypot((compression[i] - x) / (x_range.end - x_range.start), (force[i] - y) / (y_range.end - y_range.start))
  if (picture.name == "loop") x = time[nearest(far)]
  get("scrub").value = (x - time[0]) / (time.at(-1) - time[0])
  moveCursor()
}

const PLAYED = 6  // s for the whole run
const still = matchMedia("(prefers-reduced-motion: reduce)")
const playing = () => get("play").ariaPressed == "true"
function play() {
  get("play").ariaPressed = !playing()
  get("play").textContent = playing() ? "⏸ Pause" : "▶ Play"
  const scrub = get("scrub"), begin = performance.now() / 1000 - PLAYED * scrub.value
  const frame = (now) => {
    if (!playing()) return
    const share = (now / 1000 - begin) / PLAYED % 1
    // Less motion: twelve stills.
    scrub.value = still.matches ? Math.floor(12 * share) / 12 : share
    moveCursor()
    requestAnimationFrame(frame)
  }
  requestAnimationFrame(frame)
}

// Pins

function pin(name = "") {
  if (pins.length == COLOURS.length) return
  const color = COLOURS.find((colour) => pins.every((pin) => pin.color != colour))
  pins = [...pins, {...shown, color, name: name || shown.title}]
  drawPins()
}

const levelOf = (metric) => metric && !facts.simple.includes(metric) ? "all" : ""
function drawPins() {
  drawnPins = null
  get("pin").disabled = pins.length == COLOURS.length
  const button = (label, n, click) => tag("button", {type: "button", textContent: label, ariaLabel: `${label} pin ${n}`, onclick: click})
  const rows = pins.map((pin, n) => tag("tr", {},
    tag("th", {scope: "row"}, tag("span", {style: `color: ${pin.color}`, ariaHidden: "true"}, "━━ "),
      tag("input", {type: "text", value: pin.name, ariaLabel: `Name of pin ${n + 1}`, onchange: ({target}) => { pin.name = target.value }})),
    ...pin.readouts.map(({metric, value}) => tag("td", {className: levelOf(metric)}, value)),
    tag("td", {}, button("Reopen", n + 1, () => change(pin.values)), " ",
      button("Remove", n + 1, () => { pins = pins.filter((other) => other != pin); drawPins(); get("pin").focus() }))))
  const labels = [{label: "case"}, ...shown.readouts, {label: ""}]
  const head = labels.map(({label, metric}) => tag("th", {scope: "col", className: levelOf(metric)}, label))
  get("pins").replaceChildren(...(pins.length ? [tag("thead", {}, tag("tr", {}, ...head)), tag("tbody", {}, ...rows)] : []))
  draw()
}

async function changeUnit() {
  for (const [name, quantity] of quantities) if (quantity.unit in facts.speeds) {
    get(`${name}_unit`).textContent = unit()
    Object.assign(get(`${name}_slider`), {min: Math.round(quantity.low / size(quantity)), max: Math.round(quantity.high / size(quantity))})
  }
  for (const pin of pins) request(pin.color, {values: pin.values, unit: unit()}, (result) => Object.assign(pin, result))
  await requestImpact()
  drawPins()
}

async function openExample({name, values, beside}) {
  if (beside) {
    await requestImpact({...facts.defaults, ...beside})
    if (!pins.some(({query}) => query == shown.query)) pin(name.split(" | ")[0])
  }
  change(values)
}

// Downloads: files are made in the browser. Curves and metrics are physical quantities in SI.

function csv(columns) {
  const cell = (x) => typeof x == "string" ? `"${x.replaceAll('"', '""')}"` : x
  const names = Object.keys(columns).filter((name) => name in facts.units)
  const head = names.map((name) => facts.units[name] ? `${name} (${facts.units[name]})` : name)
  const rows = columns[names[0]].map((_, n) => names.map((name) => cell(columns[name][n])))
  return new Blob([head, ...rows].map((row) => `${row}\n`), {type: "text/csv"})
}

async function fileOf(choice) {
  if (choice == "path.csv") return csv(shown.path)
  if (choice == "pins.csv") return csv(columns(["name", "query", ...Object.keys(shown.metrics)], pins.map((pin) => ({...pin, ...pin.metrics}))))
  const [name, kind] = choice.split(".")
  return viewOf(model(name)).export(kind).to_blob()
}

async function download(choice) {
  const href = URL.createObjectURL(await fileOf(choice))
  tag("a", {href, download: `golf-impact-${choice}`}).click()
}

function setDark(dark) {
  document.documentElement.dataset.theme = dark ? "dark" : "light"
  properties.clear()
  get("dark").textContent = dark ? "Light" : "Dark"
  // Canvases are painted again to take the colours.
  for (const figure of figures()) viewOf(figure).request_repaint()
  repaint()
}

// Controls

let typing = null
function setQuantity({type, target: {name, type: kind, value}}) {
  // A field is read when its text is complete, a slider while it moves.
  if (kind == "range" && type == "change") moving = null
  if (kind == "text") typing = type == "input" ? name : null
  if (!name || type != (kind == "range" ? "input" : "change")) return
  const quantity = quantities.get(name), values = {[name]: quantity ? {text: value, unit: unitOf(quantity)} : value}
  const shot = kind != "range" || quantity.group == "Loft and flight"
  if (moving == name) requestImpact(values, shot)
  else change(values, shot)
  moving = kind == "range" ? name : null
}

// Arrow keys step a field: by its slider's step, or by a unit of the second digit.
function stepField(event) {
  const {target, key} = event, {name, type, value} = target, quantity = quantities.get(name)
  if (type != "text" || !/^Arrow(Up|Down)$/.test(key) || !Number.isFinite(Number(value))) return
  event.preventDefault()
  const step = quantity.step ?? 10 ** Math.floor(Math.log10(Math.abs(value) || 1) - 1)
  target.value = Number((Number(value) + (key == "ArrowUp" ? step : -step)).toPrecision(8))
  setQuantity({type: "change", target})
}

function listen() {
  get("controls").oninput = get("controls").onchange = setQuantity
  get("controls").onkeydown = stepField
  get("controls").onfocusout = () => { typing = null }
  for (const kind of ["ball", "club"])
    get(kind).onchange = ({target}) => change(facts[`${kind}s`].find(({name}) => name == target.value)?.values)
  for (const button of document.querySelectorAll("nav button")) button.onclick = () => openExample(facts.examples[button.value])
  document.querySelectorAll("#tasks div > a").forEach((link, n) => link.onclick = (event) => {
    const {name, values} = facts.tasks[n]
    openExample({name, values: {...facts.defaults, ...values}, beside: values})
    event.preventDefault()
  })
  get("level").onchange = changeLevel
  get("undo").onclick = undo
  get("reset").onclick = () => change(opening())
  get("pin").onclick = () => pin()
  get("unit").onchange = changeUnit
  get("over").onchange = requestSweep
  get("check").onclick = requestCheck
  get("copy").onclick = () => {
    get("command").select()
    document.execCommand("copy")
    get("hint").textContent = `The ${shown.command ? "command" : "link"} is copied.`
  }
  get("download").onchange = ({target}) => { download(target.value); target.value = "" }
}

// On paper pictures are copies in light colours: their size follows the sheet.
let copies = [], screenTheme = "light"
function beforePrint() {
  screenTheme = document.documentElement.dataset.theme
  setDark(false)
  copies = figures().map((figure) => {
    const view = viewOf(figure)
    view.repaint()
    const {canvas} = view.export("png"), {width, height} = view.bbox
    canvas.style.aspectRatio = `${width} / ${height}`
    canvas.className = "copy"
    view.el.parentElement.after(canvas)
    return canvas
  })
}
function afterPrint() {
  for (const canvas of copies) canvas.remove()
  setDark(screenTheme == "dark")
}

async function start() {
  while (!Bokeh.documents[0]?.is_idle) await new Promise(requestAnimationFrame)
  const figureOf = (element) => model(element.id.replace("picture_", ""))
  const sight = new IntersectionObserver((all) => {
    for (const {target, isIntersecting} of all) {
      unseen[isIntersecting ? "delete" : "add"](figureOf(target))
      if (isIntersecting) repaint([figureOf(target)])
    }
  })
  // A canvas of another size is empty.
  const sizes = new ResizeObserver((all) => { for (const {target} of all) viewOf(figureOf(target)).repaint() })
  for (const picture of document.querySelectorAll(".picture, #animation")) { sight.observe(picture); sizes.observe(picture) }
  // Bokeh's layers for events are no controls.
  for (const figure of figures()) viewOf(figure).canvas_view.events_el.tabIndex = -1
  addEventListener("beforeprint", beforePrint)
  addEventListener("afterprint", afterPrint)
  setDark(matchMedia("(prefers-color-scheme: dark)").matches)
  get("dark").onclick = () => setDark(document.documentElement.dataset.theme != "dark")
  get("play").onclick = play
  get("scrub").oninput = moveCursor
  get("picture").onchange = choosePicture
  for (const name of ["loop", "force", "energies", "momenta", "velocities", "positions"])
    for (const event of ["mousemove", "tap"]) model(name).on_event(event, (at) => point(model(name), at))
  if (innerWidth < 760) for (const group of document.querySelectorAll("#controls details")) group.open = false
  const {level = "all", ...given} = Object.fromEntries(new URLSearchParams(location.search))
  setLevel(level == "simple" ? level : "all")
  get("tasks").open = isSimple() && innerWidth >= 760
  draw()
  if (facts.exported) await startWorker()
  listen()
  requested = Object.keys(given).length ? {...isSimple() && {law: 2}, ...given} : opening()
  await requestImpact()
  requested = {...shown.values}
  setReady(true)
}
start().catch((error) => report(`The controls don't work: ${error.message}.`, true))
