// What a browser fetches before the page stands, compressed as it is served, must stay within the budget.
import { readFileSync } from 'node:fs'
import { dirname, join, relative } from 'node:path'
import { brotliCompressSync } from 'node:zlib'

const BUDGET = 45_000
// What the gateway writes into the document for a site of four controllers; e2e/slow.test.ts weighs the real one.
const SITE = 3_000
const DIST = new URL('../dist/', import.meta.url).pathname

/** The page, what it names, and what that imports at once; what is imported later is not the first view. */
function firstView(file, found = new Set()) {
  if (found.has(file)) return found
  found.add(file)
  const text = readFileSync(file, 'utf8')
  const names = file.endsWith('.html')
    ? [...text.matchAll(/(?:src|href)="(\.\/[^"]+)"/g)]
    : file.endsWith('.js')
      ? [...text.matchAll(/(?:^|[;\s}])(?:import|export)\s*(?:[^"'();]*?from\s*)?["'](\.[^"']+)["']/g)]
      : []
  for (const [, name] of names) firstView(join(dirname(file), name), found)
  return found
}

let total = SITE
for (const file of firstView(join(DIST, 'index.html'))) {
  const size = brotliCompressSync(readFileSync(file)).length
  total += size
  console.log(`${(size / 1000).toFixed(1).padStart(6)} KB  ${relative(DIST, file)}`)
}
console.log(`${(SITE / 1000).toFixed(1).padStart(6)} KB  the site in the document`)
console.log(`${(total / 1000).toFixed(1).padStart(6)} KB  first view, brotli; budget ${BUDGET / 1000} KB`)
if (total > BUDGET) {
  console.error(
    `The first view is ${((total - BUDGET) / 1000).toFixed(1)} KB over its budget: load less of it at once.`,
  )
  process.exitCode = 1
}
