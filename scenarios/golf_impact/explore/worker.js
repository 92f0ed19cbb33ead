// Python in the browser: evaluator.py computes the results of the page's requests from the physics of the FMU.
import {loadPyodide} from "./pyodide/pyodide.mjs"

const load = async ({files, archive, fmus, facts}) => {
  // loadPyodide never returns if a file is missing.
  for (const file of [...files, archive]) {
    const {ok, status} = await fetch(file, {method: "HEAD"})
    if (!ok) throw new Error(`${file} is missing (HTTP status ${status})`)
  }
  const python = await loadPyodide({indexURL: new URL("pyodide/", self.location).href})
  const data = await (await fetch(archive)).arrayBuffer()
  python.FS.writeFile("/physics.zip", new Uint8Array(data))
  python.runPython("import sys; sys.path.insert(0, '/physics.zip')")
  return python.pyimport("golf_explore.in_browser").make_evaluator(fmus, facts)
}

let evaluate = null
self.onmessage = async ({data}) => {
  // What a promise rejects here would go unreported.
  try {
    if (data.load) {
      const [callable, check] = await load(data.load)
      evaluate = callable
      self.postMessage({check: JSON.parse(check)})
    } else {
      self.postMessage({result: JSON.parse(evaluate(JSON.stringify(data.request)))})
    }
  } catch (error) {
    self.postMessage({failed: String(error?.message ?? error).trim().split("\n").at(-1)})
  }
}
