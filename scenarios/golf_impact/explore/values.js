// Values as text: read with their units, printed in the user's.
const symbolOf = (text) => text.replace(/[µμ]/g, "u").replace(/[.·*\s]/g, "")
const sizeOf = (unit) => unit ? facts.symbols[symbolOf(unit)][1] : 1
const unitOf = ({unit}) => facts.speeds.includes(unit) ? get("unit").value : unit
const digits = (value, size) => Number((value / size).toPrecision(6))

// The value of a text for an input in SI units, of a number without a unit in `unit`; throws Refused.
function read({name, si}, text, unit) {
  const refuse = (why) => { throw new Refused(`${name}=${text} is refused: ${why}`, name) }
  const [, number, given] = text.trim().replace("−", "-").match(/^([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:e[-+]?\d+)?)\s*([^\d\s,.].*)?$/i) ?? []
  if (number == undefined) refuse(/^[-+]?\d+(,\d{3})+/.test(text.trim()) ? `write ${text.replaceAll(",", "")}` : `'${text}' is not a number (e.g. 1.5)`)
  if (/^[-+]?[1-9]\d{0,2},\d{3}$/.test(number)) refuse(`write ${number.replace(",", "")} or ${number.replace(",", ".")}`)
  const [base, size] = given ? Object.hasOwn(facts.symbols, symbolOf(given)) ? facts.symbols[symbolOf(given)] : [] : [si, sizeOf(unit)]
  const known = () => Object.keys(facts.symbols).filter((symbol) => facts.symbols[symbol][0] == si).join(", ")
  if (base != si) refuse(`'${given}' isn't a unit it may have: ${known() || "none"}`)
  const value = Number(number.replace(",", "."))
  return size == 1 ? value : Number((value * size).toPrecision(15))
}

// A remark on a value (SI units) that looks like one in another unit than the user's; else empty.
function remarkOn(name, value, unit) {
  const [low, high, ...units] = facts.remarkable[name] ?? [0, Infinity], number = digits(value, sizeOf(unit)), isLow = value < low
  if (!(value > 0) || !isLow && value <= high) return ""
  const meant = units.filter((other) => number * sizeOf(other) >= low && number * sizeOf(other) <= high).map((other) => `${number} ${other}`)
  const limit = `${isLow ? "less" : "more"} than golf has (${digits(isLow ? low : high, sizeOf(unit))} ${unit})`
  return `${number} ${unit} is ${limit}.${meant.length ? ` Write ${meant.join(" or ")} if you mean that.` : ""}`
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
