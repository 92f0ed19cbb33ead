// The page: values that the user sets go to the physics; its results fill tables and pictures, within the event that asked for them.
const get = (id) => document.getElementById(id)
const all = (css) => document.querySelectorAll(css)
const facts = JSON.parse(get("facts").textContent)
const START = Object.fromEntries(Object.values(facts.inputs).map(({name, start}) => [name, start]))
const controls = Object.values(facts.inputs).filter(({label}) => label)
// What the simple level doesn't show has these values.
const SIMPLE = {...Object.fromEntries(controls.filter(({group}) => group).map(({name}) => [name, START[name]])), law: 2}
const HINT = "Move a slider, or type any number that the FMU allows, also with a unit (95mph). Point at a curve, or press Play, to see one instant in all pictures."
const NO_CONTACT = "No contact: the club never reaches the ball. It must be faster than the ball."
const NO_SEPARATION = "No separation: the bodies stay in contact (a valid result of law 1's drag)."

function tag(name, attributes, ...children) {
  const element = Object.assign(document.createElement(name), attributes)
  element.append(...children)
  return element
}
function setText(element, text) { if (element.textContent != text) element.textContent = text }
// A text whose symbols, such as m_C, have their index as a subscript.
const subscripts = (text) => text.split(/_(\w)/).map((part, n) => n % 2 ? tag("sub", {}, part) : part)

// THE CASE: `shown` is the last accepted one, `requested` has the values asked for last.

let physics, shown, requested, past = [], sliding = null, typing = null
const isSimple = () => get("level").value == "simple"
const opening = () => facts.opening[get("level").value]
const presetOf = (kind, values) => facts[kind].find((one) => Object.entries(one.values).every(([name, value]) => values[name] == value))

// Say at a control why its value is refused, and at none other.
function mark(refused, why) {
  for (const place of all(".refused")) setText(place, place.id == `${refused}_refused` ? why : "")
  for (const {name} of controls) get(name).ariaInvalid = name == refused
  get(`${refused}_refused`)?.closest("details")?.setAttribute("open", "")
}
// Whether an action is accepted; else it is said why not.
function accepts(action, control) {
  try {
    action()
    return true
  } catch (error) {
    if (!(error instanceof Refused)) throw error
    mark(error.about || control, error.message)
    setText(get("hint"), `${error.message}. The pictures show the last accepted case.`)
    return false
  }
}
function request(changes, control = Object.keys(changes)[0]) {
  requested = {...requested, ...changes}
  return accepts(() => {
    const result = physics.impact(requested)
    shown = {values: requested, ...result, path: physics.path(requested, result)}
    draw()
  }, control)
}
function change(changes, before = shown.values) {
  if (!request(changes)) return false
  past.push(before)
  get("undo").disabled = false
  return true
}
// Return to the accepted values.
function redraw() { request(shown.values) }
function undo() {
  let values = past.pop()
  while (past.length && JSON.stringify(values) == JSON.stringify(shown.values)) values = past.pop()
  get("undo").disabled = !past.length
  if (values) request(values)
}

// ADDRESS: SI units, the FMU's names; at least one of them, since an empty address is the opening.

function query() {
  const changed = Object.entries(shown.values).filter(([name, value]) => value != START[name])
  return new URLSearchParams(changed.length ? changed : [["law", 1]]).toString()
}
let addressSoon
function setAddress() {
  const hash = `#${query()}${get("unit").value == "m/s" ? "" : `&unit=${get("unit").value}`}${isSimple() ? "&level=simple" : ""}`
  get("address").value = location.href.replace(/[?#].*/, "") + hash
  // Browsers refuse frequent changes.
  clearTimeout(addressSoon)
  addressSoon = setTimeout(() => history.replaceState(null, "", location.pathname + hash), 300)
}

// Open the case of the address, or else of this file, or else of the level: its own where something in the address is refused.
function openAddress() {
  const {level, unit, ...given} = Object.fromEntries([...new URLSearchParams(location.search), ...new URLSearchParams(location.hash.slice(1))])
  if (facts.speeds.includes(unit)) get("unit").value = unit
  setUnit()
  const isInput = (name) => Object.hasOwn(START, name), names = Object.keys(given).filter(isInput), ignored = Object.keys(given).filter((name) => !isInput(name))
  // An address with a case, but without a level, is one that All wrote.
  setLevel(["all", "simple"].includes(level) ? level : names.length ? "all" : "simple")
  request(opening())
  const values = names.length ? {...START, ...isSimple() && {law: 2}} : level ? {} : {...facts.case}
  const isAccepted = accepts(() => { for (const name of names) values[name] = read(facts.inputs[name], given[name], facts.inputs[name].si) })
  if (isAccepted && !request(values, names[0])) requested = shown.values
  if (ignored.length) setText(get("hint"), `Ignored in the address: ${ignored.join(", ")}. Inputs are those of ClubBallImpact; loft and flight are in the scenarios loft and system. ${get("hint").textContent}`)
}

// LEVELS: the simple one is law 2 without exponent, COR line, force, and with a ball at rest.

function setLevel(level) { get("level").value = document.documentElement.dataset.level = level }
const fitsSimple = (values) => Object.keys(SIMPLE).every((name) => values[name] == SIMPLE[name])
function changeLevel() {
  setLevel(get("level").value)
  if (isSimple() && !fitsSimple(shown.values)) change(SIMPLE)
  else redraw()
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
  for (const input of controls) {
    const {name} = input, field = get(name), slider = get(`${name}_slider`), unit = unitOf(input)
    const value = digits(values[name], sizeOf(unit)), why = IDLE[name]?.(values)
    // What is being typed stays.
    if (name != typing) field.value = value
    if (slider) Object.assign(slider, {value, ariaValueText: `${value} ${unit}`.trim()})
    for (const control of [field, slider, get("over").querySelector(`[value=${name}]`)]) if (control) control.disabled = Boolean(why)
    setText(get(`${name}_idle`), why || remarkOn(name, values[name], unit))
  }
  if (get("over").selectedOptions[0].disabled) get("over").value = "club_speed"
  get("controls").law.value = values.law
  const ball = presetOf("balls", values), closing = values.club_speed - values.ball_speed, [low, high] = ball?.speeds ?? []
  const isOutside = low && (closing < low || closing > high), range = low ? `For ${low} to ${high} m/s${isOutside ? `, not for ${digits(closing, 1)}` : ""}. ` : ""
  get("ball").value = ball?.name ?? ""
  // Folded, but for what concerns this case.
  if (isOutside) get("about").open = true
  setText(get("source"), ball ? `${range}${ball.limits} Source: ${ball.source}` : "")
}

function drawResults({values, metrics, touched, separated}) {
  const {published = {}, source} = presetOf("examples", values) ?? {}
  const cells = facts.readouts.map((row) => {
    // An impact without separation has maxima.
    const {metric} = row, isThere = separated || touched && metric.startsWith("max_"), [text, unit] = isThere ? format(row, metrics[metric]) : ["–", ""]
    const printed = isThere && metric in published ? `${source}: ${published[metric]} ${row.unit}` : ""
    return {...row, text, shownUnit: unit, printed, value: isThere ? metrics[metric] : "", words: isThere ? fill(row.meaning, metrics) : ""}
  })
  get("readouts").replaceChildren(...cells.map(({metric, label, level, text, shownUnit, value, words, printed}) => tag("tr", {className: level},
    tag("th", {scope: "row"}, label, tag("small", {}, words)), tag("td", {}, tag("data", {id: metric, value}, text), ` ${shownUnit}`, tag("small", {}, printed)))))
  const [s, , , ball] = cells
  setText(get("headline"), `S = ${s.text}   ball ${ball.text} ${ball.shownUnit}`.trim())
  setText(get("state"), separated ? "" : touched ? NO_SEPARATION : NO_CONTACT)
  return cells
}

function equations({values, metrics, separated}) {
  const {law, exponent, restitution_at_rest, k, club_speed, ball_speed, m_ball, m_club} = values
  const kinds = {"": true, " linear": exponent == 1, " power": exponent != 1, " COR": restitution_at_rest, " separated": separated}
  const lines = Object.keys(kinds).filter((kind) => kinds[kind]).flatMap((kind) => facts.equations[law + kind] ?? [])
  const numbers = {...values, ...metrics, stiffness: k / 1e3, approach: club_speed - ball_speed, ratio: m_ball / m_club}
  return lines.flatMap((line) => subscripts(`${fill(line, numbers)}\n`))
}

const titleOf = (values) => {
  const ball = presetOf("balls", values)
  const own = Object.keys(values).filter((name) => values[name] != START[name] && !(name in (ball?.values ?? {})))
  return [ball?.name, ...own.map((name) => `${name} = ${digits(values[name], 1)}`)].filter(Boolean).join(", ") || "start values"
}

function draw() {
  if (isSimple() && !fitsSimple(shown.values)) setLevel("all")
  mark()
  drawControls(shown)
  shown.cells = drawResults(shown)
  get("equations").replaceChildren(...equations(shown))
  setText(get("hint"), !isSimple() && presetOf("examples", shown.values)?.hint || HINT)
  get("command").value = ["golf-impact run", ...[...new URLSearchParams(query())].map((pair) => pair.join("="))].join(" --set ")
  setAddress()
  drawCharts()
}

const charts = {}
let sweepSoon
function drawCharts() {
  const {path, metrics: m, touched, values} = shown, lost = `${m.energy_lost.toFixed(2)} J`, speed = ["velocity", get("unit").value, sizeOf(get("unit").value)]
  const peak = `${m.max_force.toFixed(0)} N at ${(m.time_of_max_force * 1e6).toFixed(0)} µs`
  const notes = touched ? {force: peak, loop: values.law == 1 ? `no loop: F = k d; the drag takes ${lost}` : `loop area: ${lost}, the energy lost`} : {force: "no contact", loop: "no contact"}
  const axis = (name) => name == "velocity" ? speed : AXES[name]
  for (const [name, chart] of Object.entries(charts)) if (name != "sweep" && !(isSimple() && chart.level)) {
    const words = notes[name] ?? (name == "energies" ? `${lost} are lost.` : "")
    chart.draw({data: path, pins, x: axis(chart.x), y: axis(chart.y), note: notes[name], words})
  }
  moveCursor()
  // Heavy damping takes a millisecond an impact: at most once a frame.
  cancelAnimationFrame(sweepSoon)
  if (!isSimple()) sweepSoon = requestAnimationFrame(drawSweep)
}

function drawSweep() {
  const over = facts.inputs[get("over").value], size = sizeOf(over.unit)
  const swept = physics.sweep(shown.values, over.name, over.low * size, over.high * size)
  const here = swept.x.indexOf(shown.values[over.name]), [s, cor] = here < 0 ? ["–", "–"] : [swept.smash_factor[here].toFixed(4), swept.coefficient_of_restitution[here].toFixed(4)]
  charts.sweep.draw({data: swept, x: [over.label, unitOf(over), sizeOf(unitOf(over))], y: AXES.ratio, words: `Over ${over.label}; here S ${s}, COR ${cor}.`})
  charts.sweep.point(here)
}

// CURSOR: the sample that is nearest to a time is shown in all pictures.

const PLAYED = 6  // s for the whole run
const OPENED = get("scrub").value
function moveCursor() {
  const {path, values: {ball_diameter}} = shown, start = path.time[0], duration = path.time.at(-1) - start
  const time = start + Number(get("scrub").value) * duration, unit = get("unit").value
  const n = path.time.reduce((best, t, i, times) => Math.abs(t - time) < Math.abs(times[best] - time) ? i : best, 0)
  for (const name in charts) if (name != "sweep") charts[name].point(n)
  const text = (name, size, decimals, of) => `${minus((path[name][n] / size).toFixed(decimals))} ${of}`
  const cells = {
    time: text("time", 1e-6, 1, "µs"), force: text("force", 1, 0, "N"), compression: text("compression", 1e-3, 2, "mm"),
    club: text("club_velocity", sizeOf(unit), 2, unit), ball: text("ball_velocity", sizeOf(unit), 2, unit), played: `${Math.round(PLAYED / duration / 100) * 100} × slower`,
  }
  get("cursor").replaceChildren(...Object.entries(cells).map(([label, value]) => tag("tr", {}, tag("th", {scope: "row"}, label), tag("td", {}, value))))
  get("scrub").ariaValueText = cells.time
  // The ball is an ellipse that keeps its volume when it is compressed.
  const [rect, ellipse] = all("#animation :is(rect, ellipse)"), width = Math.max(1 - path.compression[n] / ball_diameter, 0.02)
  place(rect, {x: path.club_position[n] / ball_diameter - 0.72})
  place(ellipse, {cx: path.ball_position[n] / ball_diameter + 1 - 0.5 * width, rx: 0.5 * width, ry: 0.5 / Math.sqrt(width)})
}
function point(chart, x, y) {
  if (playing || chart.name == "sweep") return
  const {time} = shown.path
  get("scrub").value = (time[chart.nearest(x, y)] - time[0]) / (time.at(-1) - time[0])
  moveCursor()
}

let playing = ""
// How: "once", to the end of the run as the page opens; "around" until it is stopped; "" stops.
function play(how) {
  playing = how
  get("play").ariaPressed = Boolean(how)
  setText(get("play"), how ? "⏸ Pause" : "▶ Play")
  const begin = performance.now() / 1000 - PLAYED * get("scrub").value
  const frame = (now) => {
    if (playing != how || !how) return
    const elapsed = (now / 1000 - begin) / PLAYED, isOver = how == "once" && elapsed >= 1
    get("scrub").value = isOver ? OPENED : elapsed % 1
    moveCursor()
    if (isOver) play("")
    else requestAnimationFrame(frame)
  }
  requestAnimationFrame(frame)
}

// CONTROLS

function setUnit() {
  const unit = get("unit").value, size = sizeOf(unit)
  for (const {name, low, high, ...input} of controls) if (facts.speeds.includes(input.unit)) {
    setText(get(`${name}_unit`), unit)
    Object.assign(get(`${name}_slider`), {min: Math.round(low / size), max: Math.round(high / size)})
  }
}

function setInput({type, target: {name, type: kind, value}}) {
  // A field is read when its text is complete, a slider while it moves: all its way is one step of undo.
  if (kind == "range" && type == "change") sliding = null
  if (kind == "text") typing = type == "input" ? name : null
  if (!name || type != (kind == "range" ? "input" : "change")) return
  accepts(() => {
    const changes = {[name]: name == "law" ? Number(value) : read(facts.inputs[name], value, unitOf(facts.inputs[name]))}
    if (sliding == name) request(changes)
    else if (change(changes) && kind == "range") sliding = name
  })
}

function openGroups(open) { for (const group of all("#controls details.wide")) group.open = open }
function printSheet(id) {
  document.body.dataset.print = id
  get(id).querySelector("details").open = true
  print()
}

function makePictures() {
  for (const [name, kind] of Object.entries(CHARTS)) {
    charts[name] = new Chart(name, kind, point)
    const title = name == "sweep" ? get("sweep_over") : kind.title
    get("pictures").append(tag("figure", {id: `${name}_figure`, className: kind.level ?? ""}, tag("figcaption", {}, title), charts[name].svg))
    get("download").append(tag("option", {value: `${name}.svg`}, `${kind.title} (SVG)`))
  }
}

function listen() {
  get("controls").oninput = get("controls").onchange = setInput
  get("controls").onfocusout = () => { typing = null }
  get("controls").onsubmit = (event) => event.preventDefault()
  get("ball").onchange = ({target}) => change(facts.balls.find(({name}) => name == target.value)?.values ?? {})
  for (const button of all("nav button")) button.onclick = () => {
    const {name, values, beside} = facts.examples[button.value]
    openBeside(values, beside, name.split(" | ")[0])
  }
  for (const link of all("#tasks a")) link.onclick = (event) => {
    event.preventDefault()
    setLevel("simple")
    openBeside(facts.opening.simple, facts.opening.simple, link.textContent)
    scrollTo(0, 0)
  }
  for (const button of all("button[value=worksheet], button[value=key]")) button.onclick = () => printSheet(button.value)
  // Its hash isn't a case.
  document.querySelector("header a").onclick = (event) => {
    event.preventDefault()
    get("k").focus()
  }
  get("level").onchange = changeLevel
  get("undo").onclick = undo
  get("reset").onclick = () => change(opening())
  get("pin").onclick = () => pin()
  get("unit").onchange = () => { setUnit(); redraw(); drawPins() }
  get("over").onchange = drawSweep
  get("download").onchange = ({target}) => { download(target.value); target.value = "" }
  get("play").onclick = () => play(playing ? "" : "around")
  get("scrub").oninput = moveCursor
  // Whatever the user does ends the one run as the page opens.
  for (const type of ["pointerdown", "keydown", "input"]) addEventListener(type, ({target}) => {
    if (playing == "once" && target != get("play")) play("")
  }, true)
  addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.shiftKey || event.key != "z" || typing) return
    event.preventDefault()
    undo()
  })
  addEventListener("hashchange", openAddress)
  addEventListener("beforeprint", () => openGroups(true))
  addEventListener("afterprint", () => { delete document.body.dataset.print })
}

const bytes = Uint8Array.from(atob(get("physics").textContent), (character) => character.charCodeAt(0))
physics = new Physics((await WebAssembly.instantiate(bytes)).instance.exports, facts)
makePictures()
openGroups(!matchMedia("(max-width: 760px)").matches)
openAddress()
listen()
for (const fieldset of all("fieldset:disabled")) fieldset.disabled = false
get("undo").disabled = true
if (isSimple() && !matchMedia("(prefers-reduced-motion: reduce)").matches) {
  get("scrub").value = 0
  play("once")
}
document.body.dataset.ready = "yes"
