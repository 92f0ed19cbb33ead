// The animation: the scrub runs from its place to the end, and begins again, until the button is released.
const toggle = cb_obj
toggle.label = toggle.active ? "⏸ Pause" : "▶ Play"
const duration = 6000  // ms for the whole course
let before = null
function frame(now) {
  if (!toggle.active) return
  if (before != null) {
    const next = scrub.value + (now - before) / duration
    scrub.value = next > 1 ? 0 : next
  }
  before = now
  requestAnimationFrame(frame)
}
if (toggle.active) requestAnimationFrame(frame)
