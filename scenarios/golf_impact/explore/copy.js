navigator.clipboard.writeText(command.value)
const label = cb_obj.origin.label
cb_obj.origin.label = "Copied"
setTimeout(() => { cb_obj.origin.label = label }, 1200)
