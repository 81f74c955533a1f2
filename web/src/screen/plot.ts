// Numbers as lines and bars: the scale of an axis, the path of a trace.

/** The next 1, 2 or 5 with noughts that is not below a number: where an axis ends. */
export function ceiling(value: number): number {
  if (!(value > 0) || !Number.isFinite(value)) return 1
  const power = 10 ** Math.floor(Math.log10(value))
  const step = [1, 2, 5, 10].find((step) => step * power >= value * (1 - 1e-9)) ?? 10
  // Powers below one are not whole in binary: 3 * 0.1 is not 0.3.
  return Number((step * power).toPrecision(12))
}

/** The samples of a trace; undefined for anything else. */
export function samplesOf(value: unknown): readonly number[] | undefined {
  if (!Array.isArray(value) || value.length < 2) return undefined
  return value.every((sample): sample is number => Number.isFinite(sample)) ? value : undefined
}

export interface Trace {
  /** A path in a box `width` wide, 0 in its middle, `height` from top to bottom. */
  path: string
  min: number
  max: number
  /** What the upper and the lower edge stand for. */
  edge: number
}

export function traceOf(samples: readonly number[], width: number, height: number): Trace {
  const min = Math.min(...samples)
  const max = Math.max(...samples)
  const edge = ceiling(Math.max(Math.abs(min), Math.abs(max)))
  const path = samples
    .map((sample, index) => {
      const x = (index / (samples.length - 1)) * width
      const y = height / 2 - (sample / edge) * (height / 2)
      return `${index === 0 ? 'M' : 'L'}${round(x)} ${round(y)}`
    })
    .join('')
  return { path, min, max, edge }
}

function round(value: number): number {
  return Math.round(value * 100) / 100
}
