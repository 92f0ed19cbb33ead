// The address bar holds the case: a link reopens it.
const query = cb_obj.value
history.replaceState(null, "", query ? `?${query}` : location.pathname)
