// Values as text: read with their units, printed in the user's.
const symbolOf = (text) => text.replace(/[µμ]/g, "u").replace(/[.·*\s]/g, "")
const sizeOf = (unit) => unit ? facts.symbols[symbolOf(unit)][1] : 1
const unitOf = ({unit}) => facts.speeds.includes(unit) ? get("unit").value : unit
const digits = (value, size) => Number((value / size).toPrecision(6))

// The value of a text in SI units, of a number without a unit in `unit`; throws Refused.
function read(quantity, text, unit) {
  const refuse = (why) => { throw new Refused(`${quantity.name}=${text} is refused: ${why}`, quantity.name) }
  const [, number, given] = text.trim().replace("−", "-").match(/^([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:e[-+]?\d+)?)\s*([^\d\s,.].*)?$/i) ?? []
  if (number == undefined) refuse(/^[-+]?\d+(,\d{3})+/.test(text.trim()) ? `write ${text.replaceAll(",", "")}` : `'${text}' is not a number (e.g. 1.5)`)
  if (/^[-+]?[1-9]\d{0,2},\d{3}$/.test(number)) refuse(`write ${number.replace(",", "")} or ${number.replace(",", ".")}`)
  const [si, size] = given ? Object.hasOwn(facts.symbols, symbolOf(given)) ? facts.symbols[symbolOf(given)] : [] : [quantity.si, sizeOf(unit)]
  const known = () => Object.keys(facts.symbols).filter((symbol) => facts.symbols[symbol][0] == quantity.si).join(", ")
  if (si != quantity.si) refuse(`'${given}' isn't a unit it may have: ${known() || "none"}`)
  const value = Number(number.replace(",", "."))
  remarks[quantity.name] = remarkOn(quantity.name, value, given ?? unit)
  return size == 1 ? value : Number((value * size).toPrecision(15))
}

// A remark on a number that looks like one in another unit; else empty.
let remarks = {}
function remarkOn(name, number, unit) {
  const [low, high, ...units] = facts.remarkable[name] ?? [], size = sizeOf(unit), value = number * size
  if (low == undefined || !(value > 0) || value >= low && value <= high) return ""
  const meant = units.filter((other) => other != unit && number * sizeOf(other) >= low && number * sizeOf(other) <= high)
  const limit = value < low ? `less than golf has (${digits(low, size)} ${unit})` : `more than golf has (${digits(high, size)} ${unit})`
  return `${number} ${unit} is ${limit}.${meant.length ? ` Write ${meant.map((other) => `${number} ${other}`).join(" or ")} if you mean that.` : ""}`
}

// A text with numbers: {name}, {name:decimals}, {name:%}.
const fill = (text, numbers) => text.replace(/\{(\w+)(?::(\w|%))?\}/g, (_, name, form) => {
  const value = numbers[name]
  return minus(form == "%" ? `${(100 * value).toFixed(1)} %` : form ? value.toFixed(Number(form)) : Number(value.toPrecision(4)))
})

// A metric as quantities.toml has it; a speed in the user's unit.
function format({unit, factor, decimals}, value) {
  const isSpeed = facts.speeds.includes(unit), shownUnit = isSpeed ? get("unit").value : unit
  const text = (isSpeed ? value / sizeOf(shownUnit) : value * factor).toFixed(decimals)
  return [minus(Number(text) ? text : text.replace("-", "")), shownUnit]
}
