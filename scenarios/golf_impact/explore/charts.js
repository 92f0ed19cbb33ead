// Pictures: SVG in a box of fixed size that CSS scales, on screen and on paper. Colours and dashes are classes in page.css.
const WIDTH = 360, HEIGHT = 206, LEFT = 56, RIGHT = 346, TOP = 8, BOTTOM = 168

// Axes: label, unit and its size in SI; a speed has the unit that the user chose.
const AXES = {
  time: ["time since touch", "µs", 1e-6], force: ["force", "kN", 1e3], compression: ["compression", "mm", 1e-3], energy: ["energy", "J", 1],
  momentum: ["momentum", "N·s", 1], velocity: ["velocity", "speed"], position: ["position", "mm", 1e-3], ratio: ["S, COR", "", 1],
}
const bodies = (what) => [[`club_${what}`, "club", "club"], [`ball_${what}`, "ball", "ball"]]
const energies = ["ball", "spring", "club", "lost"].map((name) => [`${name}_energy`, name, name])

// By name: title, axes, columns with class and label, what is filled (below a line, or areas upon each other), margin above the data, level.
const CHARTS = {
  force: {title: "Contact force", x: "time", y: "force", columns: [["force", "ball", ""]], fill: "area", margin: 1.2},
  loop: {title: "Force over compression", x: "compression", y: "force", columns: [["force", "ball", ""]], fill: "area", margin: 1.2, level: "all"},
  energies: {title: "Where the energy is", x: "time", y: "energy", columns: energies, fill: "stack", margin: 1.02},
  momenta: {title: "Momentum", x: "time", y: "momentum", columns: [...bodies("momentum"), ["total_momentum", "total", "total"]], margin: 1.12},
  velocities: {title: "Velocities", x: "time", y: "velocity", columns: bodies("velocity"), margin: 1.12},
  positions: {title: "Positions", x: "time", y: "position", columns: bodies("position"), margin: 1.12, level: "all"},
  sweep: {title: "S and COR", x: "x", y: "ratio", columns: [["smash_factor", "ball", "S"], ["coefficient_of_restitution", "total", "COR"]], margin: 1.12, level: "all"},
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
    Object.assign(this, kind, {name, across: []})
    this.picture = make("g")
    this.cursor = make("line", {class: "cursor", y1: TOP, y2: BOTTOM})
    this.dots = this.fill == "stack" ? [] : this.columns.map(([, style]) => make("circle", {class: style, r: 3.5}))
    this.marks = make("g", {}, this.cursor, ...this.dots)
    this.svg = make("svg", {viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img"}, this.picture, this.marks)
    this.svg.onpointermove = this.svg.onpointerdown = ({clientX, clientY}) => {
      const {left, top, width, height} = this.svg.getBoundingClientRect()
      pointed(this, (clientX - left) / width * WIDTH, (clientY - top) / height * HEIGHT)
    }
  }

  // `data` and the `path` of pins: columns by name, SI. `x`, `y`: label, unit and its size. `note` is in the picture, `words` describe it.
  draw({data, pins = [], x, y, note = "", words = ""}) {
    const isStack = this.fill == "stack", others = (isStack ? [] : pins).map(({color, path}) => ({color, ...this.scale(path, x, y)}))
    Object.assign(this, this.scale(data, x, y))
    const all = [this, ...others], heights = all.flatMap(({up}) => up.flat()), widths = all.flatMap(({across}) => across)
    const low = Math.min(0, ...heights), range = [low < 0 ? -nice(-this.margin * low) : 0, nice(this.margin * Math.max(0, ...heights))]
    const domain = this.x == "compression" ? [0, nice(1.02 * Math.max(...widths))] : [Math.min(...widths, Infinity), Math.max(...widths, -Infinity)]
    if (!(domain[1] > domain[0])) domain.splice(0, 2, 0, 1)
    this.X = (value) => LEFT + (value - domain[0]) / (domain[1] - domain[0]) * (RIGHT - LEFT)
    this.Y = (value) => BOTTOM - (value - range[0]) / (range[1] - range[0]) * (BOTTOM - TOP)
    const curves = this.across.length ? [...others.flatMap((one) => this.lines(one)), ...isStack ? this.areas() : this.lines(this), ...this.labels()] : []
    const noted = make("text", {class: "name", x: LEFT + 6, y: TOP + 13}, note)
    this.picture.replaceChildren(...this.axes(domain, range, x, y), ...curves, noted)
    place(this.svg, {"aria-label": `${this.title}. ${words}`})
  }

  // In the units of the axes; each column upon the one before if they are stacked.
  scale(columns, [, , width], [, , height]) {
    const below = columns[this.x].map(() => 0)
    const up = (value, n) => this.fill == "stack" ? below[n] += value / height : value / height
    return {across: columns[this.x].map((value) => value / width), up: this.columns.map(([name]) => columns[name].map(up))}
  }

  axes(domain, range, [xLabel, xUnit], [yLabel, yUnit]) {
    const label = (name, unit) => unit ? `${name} (${unit})` : name, middle = {"text-anchor": "middle"}
    const grid = ticks(range).map((value) => `M${LEFT},${this.Y(value).toFixed(1)}H${RIGHT}`)
    return [make("path", {class: "axis", d: grid.join("")}),
      ...ticks(range).map((value) => make("text", {x: LEFT - 5, y: this.Y(value) + 4, "text-anchor": "end"}, minus(value))),
      ...ticks(domain).map((value) => make("text", {x: this.X(value), y: BOTTOM + 15, ...middle}, minus(value))),
      make("text", {x: (LEFT + RIGHT) / 2, y: HEIGHT - 6, ...middle}, label(xLabel, xUnit)),
      make("text", {transform: `translate(13 ${(TOP + BOTTOM) / 2}) rotate(-90)`, ...middle}, label(yLabel, yUnit))]
  }

  points(column, across = this.across) { return across.map((value, n) => `${this.X(value).toFixed(1)},${this.Y(column[n]).toFixed(1)}`) }
  get ground() { return [`${RIGHT},${this.Y(0).toFixed(1)}`, `${LEFT},${this.Y(0).toFixed(1)}`] }

  // Of this case, or of a pin, which has a colour.
  lines({across, up, color}) {
    const look = color ? {class: "line pinned", style: `stroke: ${color}`} : {class: "line"}
    const lines = up.map((column, n) => make("path", {...look, class: `${look.class} ${this.columns[n][1]}`, d: `M${this.points(column, across).join("L")}`}))
    if (this.fill != "area" || color) return lines
    const outline = [...this.points(up[0]), ...this.x == "time" ? this.ground : []]
    return [make("path", {class: `area ${this.columns[0][1]}`, d: `M${outline.join("L")}Z`}), ...lines]
  }
  areas() {
    return this.up.map((column, n) => {
      const below = n ? this.points(this.up[n - 1]).reverse() : this.ground
      return make("path", {class: `stack ${this.columns[n][1]}`, d: `M${[...this.points(column), ...below].join("L")}Z`})
    })
  }

  // At the ends of lines, or in each area where it is thickest; 15 apart from each other.
  labels() {
    const thick = (n, i) => this.up[n][i] - (n ? this.up[n - 1][i] : 0), put = []
    const inside = this.across.flatMap((value, i) => Math.abs(this.X(value) - (LEFT + RIGHT) / 2) < 120 ? [i] : [])
    const labels = this.columns.flatMap(([, , text], n) => {
      if (this.fill != "stack") return [{text, x: RIGHT - 3, y: this.Y(this.up[n].at(-1)) - 6, anchor: "end"}]
      const i = inside.reduce((best, other) => thick(n, other) > thick(n, best) ? other : best)
      const middle = this.Y(this.up[n][i] - thick(n, i) / 2) + 4
      return this.Y(0) - this.Y(thick(n, i)) < 3 ? [] : [{text, x: this.X(this.across[i]), y: middle, anchor: "middle"}]
    })
    return labels.sort((a, b) => b.y - a.y).map(({text, x, y, anchor}) => {
      const near = put.filter((other) => Math.abs(other.x - x) < 40).map((other) => other.y - 15)
      put.push({x, y: Math.max(TOP + 10, Math.min(y, ...near))})
      return make("text", {class: "name", "text-anchor": anchor, ...put.at(-1)}, text)
    })
  }

  // The sample that is nearest to a place in the picture.
  nearest(x, y) {
    const isLoop = this.x == "compression"
    const far = (n) => Math.hypot(this.X(this.across[n]) - x, isLoop ? this.Y(this.up[0][n]) - y : 0)
    return this.across.reduce((best, _, n) => far(n) < far(best) ? n : best, 0)
  }

  point(n) {
    const isThere = n in this.across
    place(this.marks, {visibility: isThere ? "visible" : "hidden"})
    if (!isThere) return
    const x = this.X(this.across[n]).toFixed(1)
    place(this.cursor, {x1: x, x2: x})
    this.dots.forEach((dot, k) => place(dot, {cx: x, cy: this.Y(this.up[k][n]).toFixed(1)}))
  }
}
