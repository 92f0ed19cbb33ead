// Python in the browser: evaluator.py computes the results of the page's requests from the physics.
import {loadPyodide} from "./pyodide/pyodide.mjs"

async function load() {
  // loadPyodide never returns if a file is missing.
  for (const file of ["physics.zip", "pyodide/pyodide.asm.js", "pyodide/pyodide.asm.wasm", "pyodide/python_stdlib.zip"]) {
    const {ok, status} = await fetch(file, {method: "HEAD"})
    if (!ok) throw new Error(`${file} is missing (HTTP status ${status})`)
  }
  const python = await loadPyodide()
  const archive = await fetch("physics.zip")
  python.unpackArchive(await archive.arrayBuffer(), "zip")
  return python.pyimport("golf_impact.explore.evaluator").make_evaluator()
}

const loaded = load()
self.onmessage = async ({data}) => {
  // What a promise rejects here would go unreported.
  try {
    const evaluate = await loaded
    self.postMessage({result: evaluate(data)})
  } catch (error) {
    self.postMessage({failed: String(error?.message ?? error).trim().split("\n").at(-1)})
  }
}
