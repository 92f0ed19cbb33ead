// Everything that depends on the time shown: the sample nearest to the scrub's place becomes the cursor's one row.
const {time} = path.data
if (!time || time.length == 0) return
const last = time.length - 1
const at = time[0] + scrub.value * (time[last] - time[0])
let i = 0
while (i < last && Math.abs(time[i + 1] - at) <= Math.abs(time[i] - at)) i++

const row = Object.fromEntries(Object.entries(path.data).map(([name, column]) => [name, [column[i]]]))
cursor.data = row

const number = (value, digits) => value.toFixed(digits).replace("-", "−")
const slowed = Math.round(6 / (time[last] - time[0]) / 100) * 100
const line = (name, value, unit) => `<tr><th>${name}</th><td>${value} ${unit}</td></tr>`
words.text = `<table>${[
  line("time", number(1e6 * row.time[0], 1), "µs"),
  line("force", number(row.force[0], 0), "N"),
  line("compression", number(1e3 * row.compression[0], 2), "mm"),
  line("club", number(row.club_velocity[0], 2), "m/s"),
  line("ball", number(row.ball_velocity[0], 2), "m/s"),
  line("to scale", `${slowed} ×`, "slower"),
].join("")}</table>`
