// The physics in WebAssembly: started, stepped and read by value references, by the rules of golf_impact.data.runs.
class Refused extends Error {
  constructor(message, about = "") { super(message); this.about = about }
}

const energyOf = (mass, speed) => 0.5 * mass * speed * speed
// Communication points before touch, in contact, after it; the number of values over which S and COR are drawn.
const BEFORE = 8, WITHIN = 100, AFTER = 16, SWEPT = 25
// Bodies that approach no faster, m/s, don't touch.
const SLOWEST = 1e-30

class Physics {
  constructor(wasm, facts) {
    Object.assign(this, {wasm, facts})
    wasm._initialize()
  }

  refusal(about) {
    const bytes = new Uint8Array(this.wasm.memory.buffer, this.wasm.text())
    const text = new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)))
    return new Refused(text || "This impact leaves the range of double precision.", about)
  }

  start(values) {
    const {wasm, facts: {inputs}} = this
    wasm.reset()
    for (const name in values) if (!wasm.set(inputs[name].reference, values[name])) throw this.refusal(name)
    if (wasm.start()) return
    const reference = wasm.about()
    throw this.refusal(Object.keys(inputs).find((name) => inputs[name].reference == reference))
  }

  step(point, size) {
    // A step alone is refused where it would reach a touch at a speed for which COR leaves 0 to 1.
    if (!this.wasm.step(point, size)) throw this.refusal("club_speed")
  }

  read(name) {
    const value = this.wasm.get(this.facts.outputs[name])
    if (!Number.isFinite(value)) throw this.refusal()
    return value
  }

  // The contact time without damping, s; an estimate if the exponent isn't 1.
  halfPeriod({m_club, m_ball, k, exponent: n, club_speed, ball_speed, reference_compression: d_r}) {
    const period = Math.PI * Math.sqrt(1 / (1 / m_club + 1 / m_ball) / k), closing = Math.abs(club_speed - ball_speed)
    if (!(n > 1 && closing > SLOWEST)) return period
    const ratio = closing * period / (Math.PI * d_r)
    return Math.PI * d_r * (0.5 * (n + 1) * ratio * ratio) ** (1 / (n + 1)) / closing
  }

  // A communication step, s, within which the bodies touch and separate, if they ever do.
  horizon(values) {
    const {gap, club_speed, ball_speed} = values
    const step = Math.max(1, 20 * this.halfPeriod(values)) + (club_speed - ball_speed > SLOWEST ? gap / (club_speed - ball_speed) : 0)
    return step > 0 && step < Infinity ? step : 1
  }

  // Results of an impact, with what follows from them and the values; `touched` and `separated`.
  impact(values) {
    this.start(values)
    this.step(0, this.horizon(values))
    let separated = this.read("separated") == 1
    if (values.club_force && separated) {
      // At separation: the head goes on accelerating.
      const end = this.read("touch_time") + this.read("contact_time")
      this.start(values)
      this.step(0, end * (1 + 2 ** -51))
    }
    const m = Object.fromEntries(this.facts.metrics.map((name) => [name, this.read(name)])), touched = this.read("touched") == 1
    const work = values.club_force ? values.club_force * (this.read("club_position") - values.ball_speed * m.touch_time) : 0
    for (const name of this.facts.undefined[separated ? "separated" : touched ? "touched" : "apart"]) m[name] = NaN
    const {m_club, m_ball, club_speed, ball_speed, ball_diameter} = values
    const before = m_club * club_speed + m_ball * ball_speed, energy = energyOf(m_club, club_speed) + energyOf(m_ball, ball_speed)
    Object.assign(m, {
      momentum_kept: before ? m.momentum / before : 0,
      club_share: energyOf(m_club, m.club_velocity) / (energy || 1), ball_share: energyOf(m_ball, m.ball_velocity) / (energy || 1),
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
    if (times.length < BEFORE + WITHIN + AFTER || times.at(-1) + lead == times.at(-1))
      throw new Refused(`A contact of ${contact.toPrecision(3)} s is too short or too long to be drawn.`)
    this.start(touched ? {...values, gap: (club_speed - ball_speed) * lead} : values)
    const path = {time: times.map((time) => time - lead)}, moved = ball_speed * lead
    for (const name of this.facts.path) path[name] = []
    times.forEach((time, n) => {
      if (n) this.step(times[n - 1], time - times[n - 1])
      for (const name of this.facts.path) path[name].push(this.read(name))
    })
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
    const swept = {x: [], smash_factor: [], coefficient_of_restitution: []}
    const all = Array.from({length: SWEPT}, (_, n) => low + n / (SWEPT - 1) * (high - low))
    for (const x of [...new Set([...all, values[over]])].sort((a, b) => a - b)) {
      try {
        const {metrics, separated} = this.impact({...values, [over]: x})
        if (separated) for (const name in swept) swept[name].push({...metrics, x}[name])
      } catch (error) {
        if (!(error instanceof Refused)) throw error
      }
    }
    return swept
  }
}

// The next of 1, 1.5, 2, 2.5, 3 … times a power of ten: the end of an axis.
function nice(limit) {
  if (!(limit > 1e-300 && limit < Infinity)) return 1
  const unit = 0.5 * 10 ** Math.floor(Math.log10(limit))
  return Math.ceil(limit / unit - 1e-9) * unit
}
