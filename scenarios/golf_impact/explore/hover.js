// The pointer moves the cursor of all pictures to the nearest sample, unless the animation plays.
if (play.active) return
const {time} = path.data
const {x_range, y_range} = picture
const width = x_range.end - x_range.start, height = y_range.end - y_range.start
let nearest = 0, least = Infinity
for (let i = 0; i < time.length; i++) {
  const dx = (path.data[x][i] - cb_obj.x) / width
  const dy = y == null ? 0 : (path.data[y][i] - cb_obj.y) / height
  const distance = dx * dx + dy * dy
  if (distance < least) [nearest, least] = [i, distance]
}
scrub.value = (time[nearest] - time[0]) / (time[time.length - 1] - time[0])
