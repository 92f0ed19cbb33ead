// The physics in WebAssembly (fmu_src/native/rows.c), by the rules of golf_impact.data.runs.
class Refused extends Error {
  constructor(message, about = "") { super(message); this.about = about }
}

const energyOf = (mass, speed) => 0.5 * mass * speed * speed
const columns = (names, rows) => Object.fromEntries(names.map((name) => [name, rows.map((row) => row[name])]))
// Communication points before touch, in contact, after it; the number of values over which S and COR are drawn.
const BEFORE = 8, WITHIN = 100, AFTER = 16, SWEPT = 25
// Bodies that approach no faster, m/s, don't touch.
const SLOWEST = 1e-30

// As in rows.c: the most rows, or instants, of a call; how a row ends.
const ROWS = 4096, REFUSED = 0, TOUCHED = 2, SEPARATED = 3

class Physics {
  constructor(wasm, facts) {
    Object.assign(this, {wasm, facts, inputs: Object.keys(facts.inputs), outputs: Object.keys(facts.outputs)})
    wasm._initialize()
    // The memory that rows.c shares; it never grows. The last column of the values has instants.
    let at = wasm.space()
    const shared = (Numbers, length) => {
      const part = new Numbers(wasm.memory.buffer, at, length)
      at += part.byteLength
      return part
    }
    this.values = shared(Float64Array, (this.inputs.length + 1) * ROWS)
    this.results = shared(Float64Array, this.outputs.length * ROWS)
    shared(Uint32Array, this.outputs.length).set(Object.values(facts.outputs))
    this.ends = shared(Uint8Array, ROWS)
    this.counts = shared(Int32Array, 2)
  }

  // Throws why values are refused, by the place of the input to be corrected, if there is one.
  check(place) {
    if (place < 0) return
    const bytes = new Uint8Array(this.wasm.memory.buffer, this.wasm.text())
    throw new Refused(new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0))), this.inputs[place])
  }

  // Set rows of values, and a number of rows or instants.
  prepare(rows, count = rows.length) {
    this.inputs.forEach((name, n) => this.values.set(rows.map((values) => values[name]), n * ROWS))
    this.counts.set([count, this.outputs.length])
  }

  // Results of a row, or at an instant, by name.
  read(names, row) {
    return Object.fromEntries(names.map((name) => [name, this.results[this.outputs.indexOf(name) * ROWS + row]]))
  }

  // The contact time without damping, s; an estimate if the exponent isn't 1.
  halfPeriod({m_club, m_ball, k, exponent: n, club_speed, ball_speed, reference_compression: d_r}) {
    const period = Math.PI * Math.sqrt(1 / (1 / m_club + 1 / m_ball) / k), closing = Math.abs(club_speed - ball_speed)
    if (closing < SLOWEST) return period
    const ratio = closing * period / (Math.PI * d_r)
    return Math.PI * d_r * (0.5 * (n + 1) * ratio * ratio) ** (1 / (n + 1)) / closing
  }

  // Results of an impact, with what follows from them and the values; `touched` and `separated`.
  impact(values) {
    this.prepare([values])
    this.wasm.impacts()
    const end = this.ends[0], touched = end >= TOUCHED, separated = end == SEPARATED
    if (end == REFUSED) this.check(this.wasm.explain(0))
    const m = this.read(this.facts.metrics, 0), {club_position} = this.read(["club_position"], 0)
    const work = values.club_force ? values.club_force * (club_position - values.ball_speed * m.touch_time) : 0
    if (!separated) for (const name of this.facts.undefined[touched ? "touched" : "apart"]) m[name] = NaN
    const {m_club, m_ball, club_speed, ball_speed, ball_diameter} = values
    const before = m_club * club_speed + m_ball * ball_speed, energy = energyOf(m_club, club_speed) + energyOf(m_ball, ball_speed)
    Object.assign(m, {
      momentum_kept: before ? m.momentum / before : 0,
      club_share: energyOf(m_club, m.club_velocity) / energy, ball_share: energyOf(m_ball, m.ball_velocity) / energy,
      energy_lost: Math.max(0, energy + work - m.kinetic_energy),
      contact_displacement_over_diameter: m.contact_displacement / ball_diameter,
      compression_over_diameter: m.max_compression / ball_diameter,
      touch_time_us: m.touch_time * 1e6, time_of_max_force_us: m.time_of_max_force * 1e6,
    })
    return {metrics: m, touched, separated}
  }

  // Columns over the time since touch (SI units), closer at both ends of the contact; the approach is shown for any gap.
  path(values, {metrics, touched, separated}) {
    const {club_speed, ball_speed} = values, half = this.halfPeriod(values)
    const contact = separated ? metrics.contact_time : touched ? 10 * half : half, end = nice(1.15 * contact), lead = 0.1 * end
    const shares = Array.from({length: WITHIN}, (_, n) => 0.5 * (1 - Math.cos(Math.PI * (n + 1) / WITHIN)))
    const points = Array.from({length: BEFORE}, (_, n) => n / BEFORE * lead)
    points.push(...[-1e-6, 1e-6, ...shares].map((share) => lead + share * contact), lead + (metrics.time_of_max_force || 0))
    points.push(...Array.from({length: AFTER}, (_, n) => lead + contact + (n + 1) / AFTER * (end - contact)))
    const times = [...new Set(points)].sort((a, b) => a - b)
    this.prepare([touched ? {...values, gap: (club_speed - ball_speed) * lead} : values], times.length)
    this.values.set(times, this.inputs.length * ROWS)
    this.check(this.wasm.begin(times.at(-1)))
    this.check(this.wasm.instants(0))
    const rows = times.map((time, n) => ({time: time - lead, ...this.read(this.facts.path, n)})), moved = ball_speed * lead
    const path = columns(["time", ...this.facts.path], rows)
    for (const name of ["club_position", "ball_position"]) path[name] = path[name].map((x) => x - moved)
    return {...path, ...this.balances(values, path)}
  }

  // Energies and momenta of these states. The spring's energy is ∫ k d_r (d/d_r)^n dd.
  balances({m_club, m_ball, club_speed, ball_speed, club_force, k, exponent: n, reference_compression: d_r}, path) {
    const of = (function_) => path.time.map((_, i) => function_(i))
    const club_momentum = path.club_velocity.map((v) => m_club * v), ball_momentum = path.ball_velocity.map((v) => m_ball * v)
    const club_energy = path.club_velocity.map((v) => energyOf(m_club, v)), ball_energy = path.ball_velocity.map((v) => energyOf(m_ball, v))
    const spring_energy = path.compression.map((d) => k * d_r ** 2 / (n + 1) * (d / d_r) ** (n + 1))
    const before = energyOf(m_club, club_speed) + energyOf(m_ball, ball_speed)
    const work = (i) => path.time[i] > 0 ? club_force * path.club_position[i] : 0
    const lost_energy = of((i) => Math.max(0, before + work(i) - club_energy[i] - ball_energy[i] - spring_energy[i]))
    const total_momentum = of((i) => club_momentum[i] + ball_momentum[i])
    return {club_energy, ball_energy, spring_energy, lost_energy, club_momentum, ball_momentum, total_momentum}
  }

  // S and COR over one variable from low to high, SI units, where it is accepted and the bodies separate.
  sweep(values, over, low, high) {
    const results = ["smash_factor", "coefficient_of_restitution"]
    const spread = Array.from({length: SWEPT}, (_, n) => low + n / (SWEPT - 1) * (high - low))
    const swept = [...new Set([...spread, values[over]])].sort((a, b) => a - b)
    this.prepare(swept.map((x) => ({...values, [over]: x})))
    this.wasm.impacts()
    const rows = swept.flatMap((x, n) => this.ends[n] == SEPARATED ? [{x, ...this.read(results, n)}] : [])
    return columns(["x", ...results], rows)
  }
}

// The next of 1, 1.5, 2, 2.5, 3 … times a power of ten: the end of an axis.
function nice(limit) {
  if (!(limit > 1e-300 && limit < Infinity)) return 1
  const unit = 0.5 * 10 ** Math.floor(Math.log10(limit))
  return Math.ceil(limit / unit - 1e-9) * unit
}
