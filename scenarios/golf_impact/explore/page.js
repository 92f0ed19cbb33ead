// The page: values that the user sets go to the physics; its results fill tables and pictures, within the event that asked for them.
const get = (id) => document.getElementById(id)
const facts = JSON.parse(get("facts").textContent)
const quantities = new Map(facts.quantities.map((quantity) => [quantity.name, quantity]))
const START = Object.fromEntries(Object.entries(facts.inputs).map(([name, {start}]) => [name, start]))
const HINT = "Move a slider, or type any number that the FMU allows, also with a unit (95mph). Point at a curve, or press Play, to see one instant in all pictures."
const NO_CONTACT = "No contact: the club never reaches the ball. It must be faster than the ball."
const NO_SEPARATION = "No separation: the bodies stay in contact (a valid result of law 1's drag)."
// Results that an impact without separation has.
const MAXIMA = ["max_force", "max_compression"]

function tag(name, attributes, ...children) {
  const element = Object.assign(document.createElement(name), attributes)
  element.append(...children)
  return element
}
function setText(element, text) { if (element.textContent != text) element.textContent = text }

// THE CASE: `shown` is the last accepted one, `requested` has the values asked for last.

let physics, shown, requested, past = [], sliding = null, typing = null
const isSimple = () => get("level").value == "simple"
const opening = () => facts.opening[get("level").value]
const presetOf = (kind, values) => facts[kind].find((one) => Object.entries(one.values).every(([name, value]) => values[name] == value))

// Why an action is refused, by the name that is concerned; empty if it is done.
function refusals(action, name) {
  try {
    action()
    return {}
  } catch (error) {
    if (!(error instanceof Refused)) throw error
    return {[error.about || name]: error.message}
  }
}
function solve(values) {
  const result = physics.impact(values)
  return {values, ...result, path: physics.path(values, result)}
}

// Show the case with these values, or why it is refused at the control that is concerned.
function request(changes, control = Object.keys(changes)[0]) {
  requested = {...requested, ...changes}
  const refused = refusals(() => { shown = solve(requested) }, control)
  refuse(refused)
  const isAccepted = shown.values == requested
  if (isAccepted) draw()
  return isAccepted
}
function change(changes) {
  const before = shown.values
  if (!request(changes)) return false
  past.push(before)
  get("undo").disabled = false
  return true
}
// Return to the accepted values.
function redraw() {
  requested = shown.values
  refuse()
  draw()
}
function undo() {
  const now = JSON.stringify(shown.values)
  let values = past.pop()
  while (past.length && JSON.stringify(values) == now) values = past.pop()
  get("undo").disabled = !past.length
  remarks = {}
  if (values) request(values)
}

// Say why values are refused: at their controls, on top if they have none.
function refuse(refused = {}) {
  for (const place of document.querySelectorAll(".refused")) {
    const why = refused[place.id.replace("_refused", "")] ?? ""
    setText(place, why)
    if (why) place.closest("details")?.setAttribute("open", "")
  }
  for (const name of quantities.keys()) get(name).setAttribute("aria-invalid", name in refused)
  const names = Object.keys(refused), labels = names.filter((name) => get(`${name}_refused`)).map((name) => quantities.get(name)?.label ?? name)
  const others = names.filter((name) => !get(`${name}_refused`)).map((name) => refused[name])
  if (labels.length) others.unshift(`Refused: see ${labels.join(", ")}. The pictures show the last accepted case.`)
  if (names.length) setText(get("hint"), others.join(" "))
  setText(get("announced"), Object.values(refused).join(". "))
}

// ADDRESS: SI units, the FMU's names; at least one of them, since an empty address is the opening.

function query() {
  const changed = Object.entries(shown.values).filter(([name, value]) => value != START[name])
  return new URLSearchParams(changed.length ? changed : [["law", 1]]).toString()
}
const hash = () => `#${query()}${get("unit").value == "m/s" ? "" : `&unit=${get("unit").value}`}${isSimple() ? "&level=simple" : ""}`
let addressSoon
function setAddress() {
  get("address").value = location.href.replace(/[?#].*/, "") + hash()
  // Browsers refuse frequent changes.
  clearTimeout(addressSoon)
  addressSoon = setTimeout(() => history.replaceState(null, "", location.pathname + hash()), 300)
}

// Open the case of the address, or else of this file, or else of the level: its own where something in the address is refused.
function openAddress() {
  const {level, unit, ...given} = Object.fromEntries([...new URLSearchParams(location.search), ...new URLSearchParams(location.hash.slice(1))])
  if (facts.speeds.includes(unit)) get("unit").value = unit
  setUnit()
  const isInput = (name) => Object.hasOwn(START, name), names = Object.keys(given).filter(isInput), ignored = Object.keys(given).filter((name) => !isInput(name))
  // A case without a level is that of an address which All wrote, or of a file that Simple may not show.
  setLevel(["all", "simple"].includes(level) ? level : names.length || facts.case && !fitsSimple(facts.case) ? "all" : "simple")
  remarks = {}
  const base = names.length ? {...START, ...isSimple() && {law: 2}} : level ? opening() : facts.case ?? opening(), refused = {}
  let values = base
  for (const name of names) Object.assign(refused, refusals(() => {
    values = {...values, [name]: read(quantities.get(name) ?? {name, si: ""}, given[name], quantities.get(name)?.si ?? "")}
  }, name))
  // The physics names one value at a time: the others show when that one isn't there.
  for (const first of names) for (const [name, why] of Object.entries(refusals(() => solve(values), first))) {
    refused[name] = why
    values = {...values, [name]: base[name]}
  }
  const isRefused = Object.keys(refused).length > 0
  if (isRefused) remarks = {}
  request(isRefused ? opening() : values)
  if (isRefused) refuse(refused)
  if (ignored.length) setText(get("hint"), `${isRefused ? `${get("hint").textContent} ` : ""}Ignored in the address: ${ignored.join(", ")}. Inputs are those of ClubBallImpact; loft and flight are in the scenarios loft and system.`)
}

// LEVELS: the simple one is law 2 without exponent, COR line, force, and with a ball at rest.

function setLevel(level) {
  get("level").value = document.documentElement.dataset.level = level
  for (const option of get("picture").options) option.hidden = option.value != "animation" && isSimple() && !facts.simple.pictures.includes(option.value)
  if (get("picture").selectedOptions[0].hidden) get("picture").value = "force"
  choosePicture()
}
const SIMPLE = {...Object.fromEntries(["exponent", "restitution_at_rest", "restitution_slope", "ball_speed", "club_force"].map((name) => [name, START[name]])), law: 2}
const fitsSimple = (values) => Object.keys(SIMPLE).every((name) => values[name] == SIMPLE[name])
function changeLevel() {
  setLevel(get("level").value)
  if (isSimple() && !fitsSimple(shown.values)) change(SIMPLE)
  else redraw()
}

// On a phone one picture is beside the sliders.
function choosePicture() {
  for (const one of document.querySelectorAll("main > figure, #animation")) one.classList.toggle("chosen", [get("picture").value, `${get("picture").value}_figure`].includes(one.id))
  if (shown) drawCharts()
}

// DRAWING

// Why a control has no effect.
const IDLE = {
  b: ({restitution_at_rest}) => restitution_at_rest && "no effect: the COR line determines the damping",
  exponent: ({law, exponent}) => law == 1 && exponent == 1 && "no effect: law 1 has n = 1",
  restitution_at_rest: ({law, restitution_at_rest}) => law == 1 && !restitution_at_rest && "no effect: law 1 has no COR line",
  restitution_slope: ({restitution_at_rest}) => !restitution_at_rest && "no effect while COR at zero speed is 0",
  reference_compression: ({exponent}) => exponent == 1 && "no effect while n is 1",
}

function drawControls({values}) {
  for (const [name, quantity] of quantities) {
    const field = get(name), slider = get(`${name}_slider`), unit = unitOf(quantity), value = digits(values[name], sizeOf(unit)), why = IDLE[name]?.(values)
    // What is being typed stays.
    if (name != typing) field.value = value
    if (slider) {
      slider.value = value
      slider.ariaValueText = `${value} ${unit}`.trim()
    }
    for (const control of [field, slider, get("over").querySelector(`[value=${name}]`)]) if (control) control.disabled = Boolean(why)
    setText(get(`${name}_idle`), why || remarks[name] || "")
  }
  if (get("over").selectedOptions[0].disabled) get("over").value = "club_speed"
  get("controls").law.value = values.law
  const ball = presetOf("balls", values), closing = values.club_speed - values.ball_speed, [low, high] = ball?.speeds ?? []
  get("ball").value = ball?.name ?? ""
  const range = low && (closing < low || closing > high) ? `It holds for ${low} to ${high} m/s, not for ${digits(closing, 1)}. ` : low ? `For ${low} to ${high} m/s. ` : ""
  // Folded, but for what concerns this case.
  if (range.startsWith("It")) get("about").open = true
  setText(get("source"), ball ? `${range}${ball.limits} Source: ${ball.source}` : "")
}

const levelOf = (metric) => facts.simple.metrics.includes(metric) ? "" : "all"

function drawResults({values, metrics, touched, separated}) {
  const {published = {}, source} = presetOf("examples", values) ?? {}
  const cells = facts.readouts.map((row) => {
    const {metric, factor, decimals} = row, isThere = separated || touched && MAXIMA.includes(metric)
    const [text, unit] = isThere ? format(row, metrics[metric]) : ["–", ""]
    const printed = isThere && metric in published ? `${source}: ${published[metric]}${row.unit && ` ${row.unit}`}` : ""
    return {...row, text, unit, printed, value: isThere ? metrics[metric] : "", meaning: isThere ? fill(row.meaning, metrics) : ""}
  })
  if (!get("readouts").rows.length) get("readouts").append(...cells.map(({metric, label}) => {
    const value = tag("data", {})
    value.dataset.name = metric
    return tag("tr", {className: levelOf(metric)}, tag("th", {scope: "row"}, label, tag("small")), tag("td", {}, value, tag("span"), tag("small")))
  }))
  cells.forEach(({text, unit, value, meaning, printed}, n) => {
    const [small, data, span, other] = get("readouts").rows[n].querySelectorAll("small, data, span")
    data.value = value
    setText(data, text), setText(span, unit && ` ${unit}`), setText(small, meaning), setText(other, printed)
  })
  setText(get("headline"), separated ? `S = ${cells[0].text}   ball ${cells[3].text} ${cells[3].unit}` : "–")
  setText(get("summary").firstElementChild, `S ${cells[0].text}  ${cells[3].text} ${cells[3].unit}\nCOR ${cells[1].text}`)
  setText(get("state"), separated ? "" : touched ? NO_SEPARATION : NO_CONTACT)
  return cells
}

function equations({values, metrics, separated}) {
  const {law, exponent, restitution_at_rest, k, club_speed, ball_speed, m_ball, m_club} = values
  const kinds = {"": true, " linear": exponent == 1, " power": exponent != 1, " COR": restitution_at_rest, " separated": separated}
  const lines = Object.keys(kinds).filter((kind) => kinds[kind]).flatMap((kind) => facts.equations[law + kind] ?? [])
  const numbers = {...values, ...metrics, stiffness: k / 1e3, approach: club_speed - ball_speed, ratio: m_ball / m_club}
  return lines.map((line) => fill(line, numbers)).join("\n")
}

const titleOf = (values) => {
  const ball = presetOf("balls", values)
  const own = Object.keys(values).filter((name) => values[name] != START[name] && !(name in (ball?.values ?? {})))
  return [ball?.name, ...own.map((name) => `${name} = ${digits(values[name], 1)}`)].filter(Boolean).join(", ") || "start values"
}

function draw() {
  const {values} = shown, example = presetOf("examples", values)
  drawControls(shown)
  shown.cells = drawResults(shown)
  setText(get("equations"), equations(shown))
  setText(get("hint"), !isSimple() && example?.hint || HINT)
  setText(get("announced"), get("state").textContent || Object.values(remarks).filter(Boolean).join(" "))
  get("command").value = ["golf-impact run", ...[...new URLSearchParams(query())].map((pair) => pair.join("="))].join(" --set ")
  setAddress()
  drawCharts()
}

const charts = {}
const isVisible = (name) => !isSimple() || facts.simple.pictures.includes(name)
const isNarrow = matchMedia("(max-width: 760px)")
let sweepSoon, sweepIsFast = true
function drawCharts(all = false) {
  const {path, metrics: m, touched, values} = shown, lost = `${m.energy_lost.toFixed(2)} J`, speed = ["velocity", get("unit").value, sizeOf(get("unit").value)]
  const peak = `${m.max_force.toFixed(0)} N at ${(m.time_of_max_force * 1e6).toFixed(0)} µs`
  const notes = touched ? {force: peak, loop: values.law == 1 ? `no loop: F = k d; the drag takes ${lost}` : `loop area: ${lost}, the energy lost`} : {force: "no contact", loop: "no contact"}
  const axis = (name) => name == "velocity" ? speed : AXES[name]
  for (const name in charts) if (name != "sweep" && isVisible(name) && (all || !isNarrow.matches || get("picture").value == name)) {
    const {x, y} = CHARTS[name], words = notes[name] ?? (name == "energies" ? `${lost} are lost.` : "")
    charts[name].draw({data: path, pins, x: axis(x), y: axis(y), note: notes[name], words})
  }
  moveCursor()
  // Heavy damping takes a millisecond an impact: the sweep follows when nothing has changed for a moment.
  clearTimeout(sweepSoon)
  if (all || sweepIsFast) drawSweep()
  else sweepSoon = setTimeout(drawSweep, 100)
}

function drawSweep() {
  if (!isVisible("sweep")) return
  const over = quantities.get(get("over").value), size = sizeOf(over.unit), begin = performance.now()
  const swept = physics.sweep(shown.values, over.name, over.low * size, over.high * size)
  sweepIsFast = performance.now() - begin < 5
  const here = swept.x.indexOf(shown.values[over.name]), [s, cor] = here < 0 ? ["–", "–"] : [swept.smash_factor[here].toFixed(4), swept.coefficient_of_restitution[here].toFixed(4)]
  charts.sweep.draw({data: swept, x: [over.label, unitOf(over), sizeOf(unitOf(over))], y: AXES.ratio, words: `Over ${over.label}; here S ${s}, COR ${cor}.`})
  charts.sweep.point(here)
}

// CURSOR: the sample that is nearest to a time is shown in all pictures.

const PLAYED = 6  // s for the whole run
const OPENED = get("scrub").value
const nearestTo = (time) => shown.path.time.reduce((best, t, n, all) => Math.abs(t - time) < Math.abs(all[best] - time) ? n : best, 0)
function moveCursor() {
  const {path, values: {ball_diameter}} = shown, start = path.time[0], duration = path.time.at(-1) - start
  const n = nearestTo(start + Number(get("scrub").value) * duration), unit = get("unit").value
  for (const name in charts) if (name != "sweep" && charts[name].across) charts[name].point(Math.min(n, charts[name].across.length - 1))
  const text = (name, size, decimals, of) => `${minus((path[name][n] / size).toFixed(decimals))} ${of}`
  const cells = Object.entries({
    time: text("time", 1e-6, 1, "µs"), force: text("force", 1, 0, "N"), compression: text("compression", 1e-3, 2, "mm"),
    club: text("club_velocity", sizeOf(unit), 2, unit), ball: text("ball_velocity", sizeOf(unit), 2, unit), played: `${Math.round(PLAYED / duration / 100) * 100} × slower`,
  })
  if (!get("cursor").rows.length) get("cursor").append(...cells.map(([label]) => tag("tr", {}, tag("th", {scope: "row"}, label), tag("td"))))
  cells.forEach(([, value], row) => setText(get("cursor").rows[row].lastChild, value))
  get("scrub").ariaValueText = cells[0][1]
  // The ball is an ellipse that keeps its volume when it is compressed.
  const [rect, ellipse] = document.querySelectorAll("#animation :is(rect, ellipse)"), width = Math.max(1 - path.compression[n] / ball_diameter, 0.02)
  place(rect, {x: path.club_position[n] / ball_diameter - 0.72})
  place(ellipse, {cx: path.ball_position[n] / ball_diameter + 1 - 0.5 * width, rx: 0.5 * width, ry: 0.5 / Math.sqrt(width)})
}
function point(chart, x, y) {
  if (playing() || chart.name == "sweep") return
  const {time} = shown.path
  get("scrub").value = (time[chart.nearest(x, y)] - time[0]) / (time.at(-1) - time[0])
  moveCursor()
}

const still = matchMedia("(prefers-reduced-motion: reduce)")
const playing = () => get("play").ariaPressed == "true"
// `once`: to the end of the run, as the page opens; else around until it is stopped.
function play(once = false) {
  get("play").ariaPressed = !playing()
  setText(get("play"), playing() ? "⏸ Pause" : "▶ Play")
  const begin = performance.now() / 1000 - PLAYED * get("scrub").value
  const frame = (now) => {
    if (!playing()) return
    const elapsed = (now / 1000 - begin) / PLAYED, share = elapsed % 1
    if (once && elapsed >= 1) {
      get("scrub").value = OPENED
      stop()
      return moveCursor()
    }
    // Less motion: twelve stills.
    get("scrub").value = still.matches ? Math.floor(12 * share) / 12 : share
    moveCursor()
    requestAnimationFrame(frame)
  }
  requestAnimationFrame(frame)
}

function stop() { if (playing()) play() }
// The ball moves once by itself; whatever the user does ends that.
function playOnce() {
  if (!isSimple() || still.matches) return
  get("scrub").value = 0
  play(true)
  const types = ["pointerdown", "keydown", "input"], end = ({target}) => {
    for (const type of types) removeEventListener(type, end, true)
    if (target != get("play")) stop()
  }
  for (const type of types) addEventListener(type, end, true)
}

// CONTROLS

function setUnit() {
  for (const [name, quantity] of quantities) if (facts.speeds.includes(quantity.unit)) {
    setText(get(`${name}_unit`), get("unit").value)
    const size = sizeOf(get("unit").value)
    Object.assign(get(`${name}_slider`), {min: Math.round(quantity.low / size), max: Math.round(quantity.high / size)})
  }
}

function setQuantity({type, target: {name, type: kind, value}}) {
  // A field is read when its text is complete, a slider while it moves: all its way is one step of undo.
  if (kind == "range" && type == "change") sliding = null
  if (kind == "text") typing = type == "input" ? name : null
  if (!name || type != (kind == "range" ? "input" : "change")) return
  try {
    const quantity = quantities.get(name), changes = {[name]: quantity ? read(quantity, value, unitOf(quantity)) : Number(value)}
    if (sliding == name) request(changes)
    else if (change(changes) && kind == "range") sliding = name
  } catch (error) {
    if (!(error instanceof Refused)) throw error
    refuse({[name]: error.message})
  }
}

// Arrow keys step a field: by its slider's step, or by a unit of the second digit.
function stepField(event) {
  const {target, key} = event, {name, type, value} = target
  if (type != "text" || !/^Arrow(Up|Down)$/.test(key) || !Number.isFinite(Number(value))) return
  event.preventDefault()
  const step = quantities.get(name).step ?? 10 ** Math.floor(Math.log10(Math.abs(value) || 1) - 1)
  target.value = Number((Number(value) + (key == "ArrowUp" ? step : -step)).toPrecision(8))
  setQuantity({type: "change", target})
}

function setDark(dark) {
  document.documentElement.dataset.theme = dark ? "dark" : "light"
  setText(get("dark"), dark ? "Light" : "Dark")
}

function openGroups(open) { for (const group of document.querySelectorAll("#controls details.wide")) group.open = open }
function printSheet(id) {
  document.body.dataset.print = id
  get(id).querySelector("details").open = true
  print()
}

function makePictures() {
  get("picture").append(tag("option", {value: "animation"}, "Club and ball"))
  for (const [name, kind] of Object.entries(CHARTS)) {
    charts[name] = new Chart(name, kind, point)
    const title = name == "sweep" ? get("sweep_over") : kind.title
    get("sweep_over").parentElement.append(tag("figure", {id: `${name}_figure`, className: facts.simple.pictures.includes(name) ? "" : "all"}, tag("figcaption", {}, title), charts[name].svg))
    get("picture").append(tag("option", {value: name, selected: name == "force"}, kind.title))
    get("download").append(tag("option", {value: `${name}.svg`}, `${kind.title} (SVG)`))
  }
}

function listen() {
  get("controls").oninput = get("controls").onchange = setQuantity
  get("controls").onkeydown = stepField
  get("controls").onfocusout = () => { typing = null }
  get("controls").onsubmit = (event) => event.preventDefault()
  get("ball").onchange = ({target}) => { remarks = {}; change(facts.balls.find(({name}) => name == target.value)?.values ?? {}) }
  for (const button of document.querySelectorAll("nav button")) button.onclick = () => {
    const {name, values, beside} = facts.examples[button.value]
    openBeside(values, beside, name.split(" | ")[0])
  }
  for (const link of document.querySelectorAll("#tasks a")) link.onclick = (event) => {
    event.preventDefault()
    setLevel("simple")
    openBeside(facts.opening.simple, facts.opening.simple, link.textContent)
    scrollTo(0, 0)
  }
  for (const button of document.querySelectorAll("button[value=worksheet], button[value=key]")) button.onclick = () => printSheet(button.value)
  // Its hash isn't a case.
  document.querySelector("header a").onclick = (event) => {
    event.preventDefault()
    get("k").focus()
  }
  get("level").onchange = changeLevel
  get("undo").onclick = undo
  get("reset").onclick = () => { remarks = {}; change(opening()) }
  get("pin").onclick = () => pin()
  get("unit").onchange = () => { setUnit(); redraw(); drawPins() }
  get("over").onchange = drawSweep
  get("copy").onclick = () => {
    get("command").select()
    document.execCommand("copy")
    setText(get("hint"), "The command is copied.")
  }
  get("download").onchange = ({target}) => { download(target.value); target.value = "" }
  get("dark").onclick = () => setDark(document.documentElement.dataset.theme != "dark")
  get("play").onclick = () => play()
  get("scrub").oninput = moveCursor
  get("picture").onchange = choosePicture
  isNarrow.onchange = () => drawCharts()
  addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.shiftKey || event.key != "z" || typing) return
    event.preventDefault()
    undo()
  })
  addEventListener("hashchange", openAddress)
  addEventListener("beforeprint", () => {
    openGroups(true)
    drawCharts(true)
  })
  addEventListener("afterprint", () => { delete document.body.dataset.print })
}

setDark(matchMedia("(prefers-color-scheme: dark)").matches)
const bytes = Uint8Array.from(atob(get("physics").textContent), (character) => character.charCodeAt(0))
physics = new Physics((await WebAssembly.instantiate(bytes)).instance.exports, facts)
makePictures()
openGroups(!isNarrow.matches)
// It stays where this file's case can't be drawn.
request(opening())
openAddress()
listen()
for (const fieldset of document.querySelectorAll("fieldset:disabled")) fieldset.disabled = false
get("undo").disabled = true
playOnce()
document.body.dataset.ready = "yes"
