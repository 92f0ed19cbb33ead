// Pictures: SVG in a box of fixed size that CSS scales, on screen and on paper. Colours and dashes are classes in page.css.
const WIDTH = 360, HEIGHT = 206, LEFT = 56, RIGHT = 346, TOP = 8, BOTTOM = 168

// Axes: label, unit and its size in SI; a speed has the unit that the user chose.
const AXES = {
  time: ["time since touch", "µs", 1e-6], force: ["force", "kN", 1e3], compression: ["compression", "mm", 1e-3], energy: ["energy", "J", 1],
  momentum: ["momentum", "N·s", 1], velocity: ["velocity", "speed"], position: ["position", "mm", 1e-3], ratio: ["S, COR", "", 1],
}
const bodies = (what) => [[`club_${what}`, "club", "club"], [`ball_${what}`, "ball", "ball"]]
const energies = ["ball", "spring", "club", "lost"].map((name) => [`${name}_energy`, name, name])

// By name: title, axes, columns with class and label, what is filled (below a line, or areas upon each other), room above the data.
const CHARTS = {
  force: {title: "Contact force", x: "time", y: "force", columns: [["force", "ball", ""]], fill: "area", margin: 1.2},
  loop: {title: "Force over compression", x: "compression", y: "force", columns: [["force", "ball", ""]], fill: "area", margin: 1.2},
  energies: {title: "Where the energy is", x: "time", y: "energy", columns: energies, fill: "stack", margin: 1.02},
  momenta: {title: "Momentum", x: "time", y: "momentum", columns: [...bodies("momentum"), ["total_momentum", "total", "total"]], margin: 1.12},
  velocities: {title: "Velocities", x: "time", y: "velocity", columns: bodies("velocity"), margin: 1.12},
  positions: {title: "Positions", x: "time", y: "position", columns: bodies("position"), margin: 1.12},
  sweep: {title: "S and COR", x: "x", y: "ratio", columns: [["smash_factor", "ball", "S"], ["coefficient_of_restitution", "total", "COR"]], margin: 1.12},
}

function place(element, attributes) {
  for (const key in attributes) element.setAttribute(key, attributes[key])
  return element
}
function make(name, attributes = {}, ...children) {
  const element = place(document.createElementNS("http://www.w3.org/2000/svg", name), attributes)
  element.append(...children)
  return element
}
const minus = (text) => String(text).replace("-", "−")

// Round numbers on an axis, 3 to 6 of them.
function ticks([low, high]) {
  const rough = (high - low) / 4, power = 10 ** Math.floor(Math.log10(rough))
  const step = power * [1, 2, 2.5, 5, 10].find((factor) => factor * power >= rough * 0.999)
  const first = Math.ceil(low / step - 1e-9), count = Math.floor(high / step + 1e-9) - first + 1
  return Array.from({length: count}, (_, n) => Number(((first + n) * step).toPrecision(8)))
}

class Chart {
  constructor(name, kind, pointed) {
    Object.assign(this, kind, {name})
    const each = (tag, attributes) => this.columns.map(([, style]) => make(tag, attributes(style)))
    this.axes = make("g")
    this.pinned = make("g")
    this.area = make("path", {class: `area ${this.columns[0][1]}`})
    this.lines = each("path", (style) => ({class: `${this.fill == "stack" ? "stack" : "line"} ${style}`}))
    this.dots = this.fill == "stack" ? [] : each("circle", (style) => ({class: style, r: 3.5}))
    this.names = this.columns.map(([, , label]) => make("text", {class: "name"}, label))
    this.note = make("text", {class: "name", x: LEFT + 6, y: TOP + 13})
    this.cursor = make("line", {class: "cursor", y1: TOP, y2: BOTTOM})
    const parts = [this.axes, this.area, this.pinned, ...this.lines, this.cursor, ...this.dots, ...this.names, this.note]
    this.svg = make("svg", {viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img"}, ...parts)
    this.svg.onpointermove = this.svg.onpointerdown = ({clientX, clientY}) => {
      const {left, top, width, height} = this.svg.getBoundingClientRect()
      pointed(this, (clientX - left) / width * WIDTH, (clientY - top) / height * HEIGHT)
    }
  }

  // `data` and the `path` of pins: columns by name, SI. `x`, `y`: label, unit and its size. `note` is in the picture, `words` describe it.
  draw({data, pins = [], x, y, note = "", words = ""}) {
    const [, , width] = x, [, , height] = y
    const scaled = (columns) => {
      const below = columns[this.x].map(() => 0)
      const up = (value, n) => this.fill == "stack" ? below[n] += value / height : value / height
      return {across: columns[this.x].map((value) => value / width), up: this.columns.map(([name]) => columns[name].map(up))}
    }
    Object.assign(this, scaled(data))
    const others = this.fill == "stack" ? [] : pins.map(({color, path}) => ({color, ...scaled(path)}))
    const all = [this, ...others], heights = all.flatMap(({up}) => up.flat()), widths = all.flatMap(({across}) => across)
    const low = Math.min(0, ...heights), range = [low < 0 ? -nice(-this.margin * low) : 0, nice(this.margin * Math.max(0, ...heights))]
    const domain = this.x == "compression" ? [0, nice(1.02 * Math.max(...widths))] : [Math.min(...widths, Infinity), Math.max(...widths, -Infinity)]
    if (!(domain[1] > domain[0])) domain.splice(0, 2, 0, 1)
    const text = [domain, range, x, y].join(), hasNewAxes = text != this.drawn
    if (hasNewAxes) this.drawAxes(domain, range, x, y)
    if (hasNewAxes || pins != this.drawnPins) this.drawPins(others)
    Object.assign(this, {drawn: text, drawnPins: pins})
    this.drawLines()
    this.note.textContent = note
    place(this.svg, {"aria-label": `${this.title}. ${words}`})
  }

  drawAxes(domain, range, [xLabel, xUnit], [yLabel, yUnit]) {
    this.X = (value) => LEFT + (value - domain[0]) / (domain[1] - domain[0]) * (RIGHT - LEFT)
    this.Y = (value) => BOTTOM - (value - range[0]) / (range[1] - range[0]) * (BOTTOM - TOP)
    const label = (name, unit) => unit ? `${name} (${unit})` : name, middle = {"text-anchor": "middle"}
    const grid = ticks(range).map((value) => `M${LEFT},${this.Y(value).toFixed(1)}H${RIGHT}`)
    this.axes.replaceChildren(make("path", {class: "axis", d: grid.join("")}),
      ...ticks(range).map((value) => make("text", {x: LEFT - 5, y: this.Y(value) + 4, "text-anchor": "end"}, minus(value))),
      ...ticks(domain).map((value) => make("text", {x: this.X(value), y: BOTTOM + 15, ...middle}, minus(value))),
      make("text", {x: (LEFT + RIGHT) / 2, y: HEIGHT - 6, ...middle}, label(xLabel, xUnit)),
      make("text", {transform: `translate(13 ${(TOP + BOTTOM) / 2}) rotate(-90)`, ...middle}, label(yLabel, yUnit)))
  }

  points({across}, column) { return across.map((value, n) => `${this.X(value).toFixed(1)},${this.Y(column[n]).toFixed(1)}`) }

  drawPins(others) {
    const lines = others.flatMap((one) => one.up.map((column, n) => {
      const d = column.length ? `M${this.points(one, column).join("L")}` : ""
      return make("path", {class: `line pinned ${this.columns[n][1]}`, style: `stroke: ${one.color}`, d})
    }))
    this.pinned.replaceChildren(...lines)
  }

  drawLines() {
    const curves = this.up.map((column) => this.points(this, column)), base = this.Y(0).toFixed(1), ground = `L${RIGHT},${base}L${LEFT},${base}`
    const isEmpty = !this.across.length
    curves.forEach((curve, n) => {
      const floor = n ? `L${[...curves[n - 1]].reverse().join("L")}` : ground
      place(this.lines[n], {d: isEmpty ? "" : `M${curve.join("L")}${this.fill == "stack" ? `${floor}Z` : ""}`})
    })
    if (this.fill == "area") place(this.area, {d: isEmpty ? "" : `M${curves[0].join("L")}${this.x == "time" ? ground : ""}Z`})
    if (!isEmpty) this.drawNames()
  }

  // At the ends of lines, or in each area where it is thickest; 15 apart from each other.
  drawNames() {
    const middle = (n, i) => (this.Y(this.up[n][i]) + this.Y(n ? this.up[n - 1][i] : 0)) / 2 + 4
    const thick = (n, i) => this.up[n][i] - (n ? this.up[n - 1][i] : 0)
    const inside = this.across.flatMap((value, i) => Math.abs(this.X(value) - (LEFT + RIGHT) / 2) < 120 ? [i] : [])
    const labels = this.names.map((text, n) => {
      if (this.fill != "stack") return {text, x: RIGHT - 3, y: this.Y(this.up[n].at(-1)) - 6, anchor: "end"}
      const i = inside.reduce((best, other) => thick(n, other) > thick(n, best) ? other : best)
      return {text, x: this.X(this.across[i]), y: middle(n, i), anchor: "middle", hidden: this.Y(0) - this.Y(thick(n, i)) < 3}
    })
    const put = []
    for (const {text, x, y, anchor, hidden} of labels.sort((a, b) => b.y - a.y)) {
      const near = put.filter((other) => Math.abs(other.x - x) < 40).map((other) => other.y - 15)
      const at = Math.max(TOP + 10, Math.min(y, ...near))
      if (!hidden) put.push({x, y: at})
      place(text, {x, y: at, "text-anchor": anchor, visibility: hidden ? "hidden" : "visible"})
    }
  }

  // The sample that is nearest to a place in the picture.
  nearest(x, y) {
    const isLoop = this.x == "compression"
    const far = (n) => Math.hypot(this.X(this.across[n]) - x, isLoop ? this.Y(this.up[0][n]) - y : 0)
    return this.across.reduce((best, _, n) => far(n) < far(best) ? n : best, 0)
  }

  point(n) {
    const x = this.X(this.across[n] ?? NaN).toFixed(1)
    if (x == "NaN") return
    place(this.cursor, {x1: x, x2: x})
    this.dots.forEach((dot, k) => place(dot, {cx: x, cy: this.Y(this.up[k][n]).toFixed(1)}))
  }
}
