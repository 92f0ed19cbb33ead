// The page: what the user sets goes to evaluator.py as a request; its results fill figures and tables.
const get = (id) => document.getElementById(id)
const facts = JSON.parse(get("facts").textContent)
const models = {}
const model = (name) => models[name] ??= Bokeh.documents[0].get_model_by_name(name)
const quantities = new Map(facts.quantities.map((quantity) => [quantity.name, quantity]))
const figures = ["animation", "force", "loop", "energies", "velocities", "positions", "sweep", "flight"]
const COLOURS = ["#CC79A7", "#009E73", "#D55E00", "#999933", "#882255", "#888888", "#44AA99", "#DDCC77"]
const HINT = "Move a slider, or type any number that the FMU allows. Point at a curve, or press Play, to see one instant in all pictures."

// Bokeh 3.9 writes the style sheet of every part at every paint, mostly the same again, and reads CSS properties in between: each time
// the browser computes all styles anew. Equal sheets are left alone, and properties, which are those of page.css for :root, are kept.
const sheet = Bokeh.require("core/dom").InlineStyleSheet.prototype, update = sheet._update, properties = new Map()
sheet._update = function (css) { if (css != this.css) update.call(this, css) }
Bokeh.require("core/visuals/visual").VisualProperties.prototype._get_css_value = function (name) {
  const key = this.css_prefix + name
  if (!properties.has(key)) properties.set(key, getComputedStyle(document.documentElement).getPropertyValue(key))
  return properties.get(key)
}
addEventListener("resize", () => properties.clear())
// Nothing on the page is placed beside the element of a glyph renderer, whose place changes with every curve.
Bokeh.require("models/renderers/glyph_renderer").GlyphRendererView.prototype.update_position = () => {}

// Numbers: a request at a time, to this machine's server or to the worker.

async function viaServer(request) {
  const response = await fetch("impact", {method: "POST", body: JSON.stringify(request)})
  if (!response.ok) throw new Error(`the server replies with status ${response.status}`)
  return response.json()
}

let worker = null
const post = (message) => new Promise((resolve, reject) => {
  worker.onmessage = ({data}) => data.failed ? reject(new Error(data.failed)) : resolve(data)
  worker.onerror = (event) => reject(new Error(event.message || "worker.js or pyodide/pyodide.mjs can't be loaded"))
  worker.postMessage(message)
})
const evaluate = facts.worker ? async (request) => (await post({request})).result : viaServer

function report(text, failed = false) {
  get("runtime").textContent = text
  get("runtime").classList.toggle("failed", failed)
}

async function startWorker() {
  report("Loading Python (some 6 MB): the sliders work as soon as it is there.")
  const seconds = 60
  const late = setTimeout(() => report(`Python has not started within ${seconds} s: reload the page, or try another browser.`, true), 1000 * seconds)
  try {
    worker = new Worker("worker.js", {type: "module"})
    const carried = {...facts, result: null, worker: null}
    const {check} = await post({load: {...facts.worker, facts: JSON.stringify(carried)}})
    const same = check.worst <= 1e-12
    const words = `${check.count} numbers agree with the FMU's within ${check.worst.toExponential(1)}`
    const differ = `the numbers differ from the FMU's by up to ${check.worst.toExponential(1)}: don't rely on them`
    report(`This page runs the FMU's physics in your browser (Python ${facts.worker.version}); ${same ? words : differ}.`, !same)
  } finally {
    clearTimeout(late)
  }
}

// The newest request of a kind waits while another runs; none is queued.
const waiting = new Map()
let running = null
async function run() {
  try {
    while (waiting.size) {
      const [kind, [request, use]] = waiting.entries().next().value
      waiting.delete(kind)
      use(await evaluate(request))
      // S and COR over a variable wait until no slider moves.
      if (kind == "impact" && !waiting.has("impact")) waiting.set("sweep", [{values: shown.values, over: get("over").value}, drawSweep])
    }
  } catch (error) {
    report(`No new numbers: ${error.message}. Reload the page when that is mended.`, true)
    delete document.body.dataset.ready
  }
  running = null
}
function request(kind, message, use) {
  waiting.set(kind, [message, use])
  running ??= run()
  return running
}

// State: the result that is shown, the values requested last, and the pins (results with name and color).
let shown = facts.result
let requested = {...shown.values}
let pins = []
const unit = () => get("unit").value
const size = (quantity) => quantity.unit in facts.speeds ? facts.speeds[unit()] : quantity.scale
// 15 digits: 45.93 g are 0.04593 kg to the last digit.
const toSi = (quantity, value) => size(quantity) == 1 ? value : Number((value * size(quantity)).toPrecision(15))
const fromSi = (quantity, value) => Number((value / size(quantity)).toPrecision(8))

function requestImpact(values, control) {
  Object.assign(requested, values)
  return request("impact", {values: {...requested}, unit: unit()}, (result) => show(result, control))
}

function show(result, control) {
  for (const place of document.querySelectorAll(".refused")) place.textContent = ""
  if ("refused" in result) {
    const place = get(`${result.about || control}_refused`)
    if (place) place.textContent = result.refused
    else get("hint").textContent = result.refused
    return
  }
  shown = result
  if (!waiting.has("impact")) requested = {...result.values}
  history.replaceState(null, "", `?${result.query}`)
  draw()
}

// Drawing

function draw() {
  const {values, path, flight, ranges} = shown
  for (const [name, quantity] of quantities) {
    const field = get(name), slider = get(`${name}_slider`), value = fromSi(quantity, values[name])
    if (document.activeElement != field || Number(field.value) != value) field.value = value
    if (slider) slider.value = value
  }
  for (const button of document.getElementsByName("law")) button.checked = Number(button.value) == values.law
  const ball = facts.balls.find((ball) => facts.contact.every((name) => values[name] == (ball.values[name] ?? facts.defaults[name])))
  get("ball").value = ball?.name ?? ""
  get("club").value = String(facts.clubs.findIndex((club) => club.name == shown.example)).replace("-1", "")
  get("source").textContent = ball?.source ?? ""
  get("hint").textContent = shown.hint || HINT
  get("state").textContent = shown.state
  get("command").value = shown.command
  const rows = shown.readouts.map(({metric, label, meaning, value, printed}) => {
    const row = tag("tr", {}, tag("th", {scope: "row"}, label, tag("small", {}, meaning)), tag("td", {}, value, ...(printed ? [tag("small", {}, printed)] : [])))
    row.dataset.metric = metric
    return row
  })
  get("readouts").replaceChildren(tag("tbody", {}, ...rows))
  for (const name in ranges) {
    const all = [ranges, ...pins.map((pin) => pin.ranges)].map((ranges) => ranges[name])
    // The scene is to scale: that of the present case.
    const used = name.startsWith("scene") ? [ranges[name]] : all
    model(`${name}_range`).setv({start: Math.min(...used.map(([low]) => low)), end: Math.max(...used.map(([, high]) => high))})
  }
  model("path").data = path
  model("flight_path").data = flight
  const columns = Object.keys({...path, ...flight}).map((name) => [name, pins.map((pin) => pin.path[name] ?? pin.flight[name])])
  model("pinned").data = {color: pins.map((pin) => pin.color), ...Object.fromEntries(columns)}
  model("peak").setv({x: shown.metrics.time_of_max_force, y: shown.metrics.max_force, text: shown.peak})
  model("area").setv({x: 0, y: model("force_range").end, text: shown.area})
  model("velocities").left[0].axis_label = `velocity (${unit()})`
  moveCursor()
}

function tag(name, attributes, ...children) {
  const element = Object.assign(document.createElement(name), attributes)
  element.append(...children)
  return element
}

function drawSweep({refused, swept, over}) {
  if (refused) return
  const quantity = quantities.get(over), x = swept.x.map((value) => value / size(quantity))
  const numbers = (column) => column.map((value) => value ?? NaN)
  model("swept").data = {x, smash_factor: numbers(swept.smash_factor), coefficient_of_restitution: numbers(swept.coefficient_of_restitution)}
  model("here").data = {x: [shown.values[over] / size(quantity)]}
  model("sweep").x_range.setv({start: x[0], end: x.at(-1)})
  model("sweep").below[0].axis_label = `${quantity.label} (${quantity.unit in facts.speeds ? unit() : quantity.unit})`
}

// Everything that depends on the instant: the sample nearest to the scrub's place is the cursor's one row.
function moveCursor() {
  const {time} = shown.path, last = time.length - 1
  const at = time[0] + Number(get("scrub").value) * (time[last] - time[0])
  let i = 0
  while (i < last && Math.abs(time[i + 1] - at) <= Math.abs(time[i] - at)) i++
  const row = Object.fromEntries(Object.entries(shown.path).map(([name, column]) => [name, [column[i]]]))
  model("cursor").data = row
  const number = (value, digits) => value.toFixed(digits).replace("-", "−")
  const slower = Math.round(6 / (time[last] - time[0]) / 100) * 100
  const lines = [
    ["time", `${number(1e6 * row.time[0], 1)} µs`], ["force", `${number(row.force[0], 0)} N`],
    ["compression", `${number(1e3 * row.compression[0], 2)} mm`], ["club", `${number(row.club_shown[0], 2)} ${unit()}`],
    ["ball", `${number(row.ball_shown[0], 2)} ${unit()}`], ["played", `${slower} × slower`],
  ]
  get("cursor").replaceChildren(...lines.map(([name, value]) => tag("tr", {}, tag("th", {scope: "row"}, name), tag("td", {}, value))))
}

// Pointer or finger: the cursor goes to the nearest sample, unless the animation plays.
function point(picture, columns, {x, y}) {
  if (get("play").ariaPressed == "true") return
  const {path} = shown, {x_range, y_range} = picture
  const width = x_range.end - x_range.start, height = columns[1] ? y_range.end - y_range.start : Infinity
  let nearest = 0, least = Infinity
  for (let i = 0; i < path.time.length; i++) {
    const distance = ((path[columns[0]][i] - x) / width) ** 2 + (((path[columns[1]]?.[i] ?? y) - y) / height) ** 2
    if (distance < least) [nearest, least] = [i, distance]
  }
  const {time} = path
  get("scrub").value = (time[nearest] - time[0]) / (time.at(-1) - time[0])
  moveCursor()
}

const playing = (on) => { get("play").ariaPressed = String(on); get("play").textContent = on ? "⏸ Pause" : "▶ Play" }
function play() {
  playing(get("play").ariaPressed != "true")
  const scrub = get("scrub"), duration = 6000  // ms for the whole run
  let before = null, place = Number(scrub.value)
  const frame = (now) => {
    if (get("play").ariaPressed != "true") return
    if (before != null) place += (now - before) / duration
    if (place > 1) place = 0
    before = now
    scrub.value = place
    moveCursor()
    requestAnimationFrame(frame)
  }
  requestAnimationFrame(frame)
}

// Pins

function pin(name = "") {
  if (pins.length == COLOURS.length) return
  const color = COLOURS.find((colour) => pins.every((pin) => pin.color != colour))
  // Without a name: its ball, and what else differs from the start values.
  const ball = get("ball").value, given = [...new URLSearchParams(shown.query)].filter(([variable]) => !ball || !facts.contact.includes(variable))
  const club = facts.clubs.some((club) => club.name == shown.example) && shown.example
  pins = [...pins, {...shown, color, name: name || club || [...(ball ? [ball] : []), ...given.map((pair) => pair.join(" = "))].join(", ")}]
  drawPins()
}

function drawPins() {
  get("pin").disabled = pins.length == COLOURS.length
  const button = (label, n, click) => tag("button", {type: "button", textContent: label, ariaLabel: `${label} pin ${n}`, onclick: click})
  const rows = pins.map((pin, n) => tag("tr", {},
    tag("th", {scope: "row"}, tag("span", {style: `color: ${pin.color}`, ariaHidden: "true"}, "━━ "),
      tag("input", {type: "text", value: pin.name, ariaLabel: `Name of pin ${n + 1}`, onchange: (event) => { pin.name = event.target.value }})),
    ...pin.readouts.map(({value}) => tag("td", {}, value)),
    tag("td", {}, button("Reopen", n + 1, () => requestImpact(pin.values, "law")), " ",
      button("Remove", n + 1, () => { pins = pins.filter((other) => other != pin); drawPins(); get("pin").focus() }))))
  const head = ["case", ...shown.readouts.map(({label}) => label), ""].map((label) => tag("th", {scope: "col"}, label))
  get("pins").replaceChildren(...(pins.length ? [tag("thead", {}, tag("tr", {}, ...head)), tag("tbody", {}, ...rows)] : []))
  draw()
}

async function changeUnit() {
  for (const [name, quantity] of quantities) if (quantity.unit in facts.speeds) {
    document.querySelector(`[data-unit="${name}"]`).textContent = unit()
    Object.assign(get(`${name}_slider`), {min: Math.round(quantity.low / size(quantity)), max: Math.round(quantity.high / size(quantity))})
  }
  const repin = (pin) => request(pin.color, {values: pin.values, unit: unit()}, (result) => Object.assign(pin, result))
  await Promise.all([requestImpact({}, "law"), ...pins.map(repin)])
  pins = [...pins]
  drawPins()
}

async function openExample({name, values, beside}) {
  if (beside && pins.length < COLOURS.length) {
    await requestImpact({...facts.defaults, ...beside}, "law")
    pin(name.split(" | ")[0])
  }
  requestImpact({...facts.defaults, ...values}, "law")
}

// Downloads: files are made in the browser. Curves and metrics are physical quantities in SI.

const UNITS = {
  ...facts.units, time: "s", club_energy: "J", ball_energy: "J", spring_energy: "J", lost_energy: "J",
  momentum_initial: facts.units.momentum, momentum_final: facts.units.momentum,
}

const inSi = (columns) => Object.keys(columns).filter((name) => name in UNITS)

function csv(rows, names) {
  const cell = (x) => typeof x == "string" ? `"${x.replaceAll('"', '""')}"` : String(x)
  const head = names.map((name) => UNITS[name] ? `${name} (${UNITS[name]})` : name)
  return new Blob([[head, ...rows.map((row) => names.map((name) => cell(row[name])))].map((line) => line.join(",") + "\n").join("")], {type: "text/csv"})
}

async function download(choice) {
  const [name, kind] = choice.split("."), {path, metrics} = shown
  if (kind != "csv") model(name).hold_render = false
  const file = kind != "csv" ? await Bokeh.index.find_one(model(name)).export(kind).to_blob()
    : name == "path" ? csv(path.time.map((_, i) => Object.fromEntries(Object.keys(path).map((column) => [column, path[column][i]]))), inSi(path))
    : csv(pins.map((pin) => ({...pin, ...pin.metrics})), ["name", "query", ...inSi(metrics)])
  const link = tag("a", {href: URL.createObjectURL(file), download: `golf-impact-${choice}`})
  link.click()
  // Not at once: the browser may not have begun to read it.
  setTimeout(() => URL.revokeObjectURL(link.href), 60000)
}

function setDark(dark) {
  document.documentElement.dataset.theme = dark ? "dark" : "light"
  properties.clear()
  get("dark").textContent = dark ? "Light" : "Dark"
  // Canvases are painted again to take the colours.
  for (const name of figures) Bokeh.index.find_one(model(name)).request_repaint()
}

// Controls

function listen() {
  for (const [name, quantity] of quantities) {
    get(name).onchange = ({target}) => {
      if (target.value != "") requestImpact({[name]: toSi(quantity, Number(target.value))}, name)
      else get(`${name}_refused`).textContent = `${quantity.label} must be a number`
    }
    const slider = get(`${name}_slider`)
    if (slider) slider.oninput = () => requestImpact({[name]: toSi(quantity, Number(slider.value))}, name)
  }
  for (const button of document.getElementsByName("law")) button.onchange = () => requestImpact({law: Number(button.value)}, "law")
  get("ball").onchange = ({target}) => {
    const ball = facts.balls.find((ball) => ball.name == target.value)
    if (ball) requestImpact({...Object.fromEntries(facts.contact.map((name) => [name, facts.defaults[name]])), ...ball.values}, "k")
  }
  for (const button of document.querySelectorAll("[data-example]")) button.onclick = () => openExample(facts.examples[button.dataset.example])
  get("club").onchange = ({target}) => { if (target.value) openExample(facts.clubs[target.value]) }
  get("pin").onclick = () => pin()
  get("unit").onchange = changeUnit
  get("over").onchange = () => request("sweep", {values: shown.values, over: get("over").value}, drawSweep)
  get("copy").onclick = async () => {
    get("command").select()
    try { await navigator.clipboard.writeText(shown.command) } catch { document.execCommand("copy") }
    get("copy").textContent = "Copied"
    setTimeout(() => { get("copy").textContent = "Copy command" }, 1200)
  }
  get("download").onchange = ({target}) => { download(target.value); target.value = "" }
}

async function start() {
  while (!Bokeh.documents[0]?.is_idle) await new Promise(requestAnimationFrame)
  // Figures out of sight aren't painted: on a phone that is most of them.
  const sight = new IntersectionObserver((all) => { for (const {target, isIntersecting} of all) model(target.id.slice(8)).hold_render = !isIntersecting })
  for (const picture of document.querySelectorAll(".picture")) sight.observe(picture)
  const dark = matchMedia("(prefers-color-scheme: dark)")
  setDark(dark.matches)
  dark.onchange = () => setDark(dark.matches)
  get("dark").onclick = () => setDark(document.documentElement.dataset.theme != "dark")
  get("play").onclick = play
  get("scrub").oninput = moveCursor
  const columns = {loop: ["compression", "force"], force: ["time"], energies: ["time"], velocities: ["time"], positions: ["time"]}
  for (const [name, used] of Object.entries(columns))
    for (const event of ["mousemove", "tap"]) model(name).on_event(event, (at) => point(model(name), used, at))
  draw()
  const given = Object.fromEntries(new URLSearchParams(location.search))
  try {
    if (facts.worker) await startWorker()
  } catch (error) {
    return report(`The sliders don't work: ${error.message}.`, true)
  }
  listen()
  if (Object.keys(given).length) requested = given
  await requestImpact({}, "")
  requested = {...shown.values}
  document.body.dataset.ready = "yes"
}
start()
